#include "decimal.h"

#include "table_constants.h"

_Static_assert(POSITION_WHOLE_MAX < 0xFFFFFFFF, "the whole part of a position has 32 bits");

uint32_t divide(uint64_t *number, uint32_t divisor)
{
    uint64_t quotient = *number;
    uint32_t remainder = 0;
    for (uint8_t bit = 64; bit != 0; --bit) {
        const bool carry = (remainder & 0x80000000UL) != 0;
        remainder = (remainder << 1) | (uint32_t)(quotient >> 63);
        quotient <<= 1;
        if (carry || remainder >= divisor) {
            remainder -= divisor;
            quotient |= 1;
        }
    }
    *number = quotient;
    return remainder;
}

/* Divide a number by ten in place, and return the remainder: a byte a round, with a product for the quotient. */
static uint8_t divide_by_ten(uint64_t *number)
{
    uint8_t *bytes = (uint8_t *)number;
    uint8_t remainder = 0;
    for (uint8_t i = sizeof *number; i-- != 0;) {
        const uint16_t part = (uint16_t)(remainder << 8 | bytes[i]);
        const uint8_t quotient = (uint8_t)((part * 6554UL) >> 16); /* exact for parts below 2560 */
        remainder = (uint8_t)(part - quotient * 10U);
        bytes[i] = quotient;
    }
    return remainder;
}

static bool is_digit(char byte)
{
    return byte >= '0' && byte <= '9';
}

bool decimal_read(struct decimal *decimal, const char *text, uint8_t length)
{
    const char *const end = text + length;
    *decimal = (struct decimal){.is_negative = false};
    if (text < end && (*text == '+' || *text == '-')) {
        decimal->is_negative = *text++ == '-';
    }
    if (text == end || !is_digit(*text)) {
        return false;
    }
    for (; text < end && is_digit(*text); ++text) {
        const uint8_t digit = (uint8_t)(*text - '0');
        if (decimal->whole > (UINT32_MAX - 9) / 10) {
            decimal->is_huge = true;
        }
        decimal->whole = decimal->whole * 10 + digit;
    }
    if (text == end) {
        return true;
    }
    if (*text++ != '.') {
        return false;
    }
    decimal->digits = text;
    while (text < end && is_digit(*text)) {
        ++text;
        ++decimal->digit_count;
    }
    return text == end && decimal->digit_count != 0;
}

static char digit_at(const struct decimal *decimal, uint8_t index)
{
    return index < decimal->digit_count ? decimal->digits[index] : '0';
}

bool decimal_exceeds(const struct decimal *decimal, const struct decimal *limit)
{
    if (decimal->is_huge || decimal->whole != limit->whole) {
        return decimal->is_huge || decimal->whole > limit->whole;
    }
    for (uint8_t i = 0; i < decimal->digit_count || i < limit->digit_count; ++i) {
        if (digit_at(decimal, i) != digit_at(limit, i)) {
            return digit_at(decimal, i) > digit_at(limit, i);
        }
    }
    return false;
}

uint64_t decimal_scaled(const struct decimal *decimal, const struct scale *scale)
{
    /* The digits after the point, the last one first: twice the factor times 0.d1 d2 ... is (d1 twice + (d2 twice + ...
       ) / 10) / 10. Each quotient is rounded down, and so is their whole; whether anything was lost is kept. */
    uint64_t twice = 0;
    bool is_inexact = false;
    for (uint8_t i = decimal->digit_count; i-- != 0;) {
        twice += scale->twice * (uint8_t)(decimal->digits[i] - '0');
        is_inexact |= divide_by_ten(&twice) != 0;
    }
    if (scale->divisor == 1) {
        twice += scale->twice * decimal->whole;
    } else {
        twice += scale->twice * (decimal->whole % scale->divisor);
        is_inexact |= divide(&twice, scale->divisor) != 0;
        twice += scale->twice * (decimal->whole / scale->divisor);
    }
    const bool is_odd_half = (twice & 1) != 0, is_even_below = (twice & 2) == 0;
    twice >>= 1;
    return is_odd_half && (is_inexact || !is_even_below) ? twice + 1 : twice;
}

/* Return the magnitude of a count in units of the last decimal. */
static uint64_t angle_units(uint32_t magnitude)
{
    uint64_t twice = (uint64_t)magnitude * ANGLE_NUMERATOR;
    bool is_inexact;
    if ((ANGLE_DIVISOR & (ANGLE_DIVISOR - 1)) == 0) {
        is_inexact = (twice & (ANGLE_DIVISOR - 1)) != 0;
        twice /= ANGLE_DIVISOR;
    } else {
        is_inexact = divide(&twice, ANGLE_DIVISOR) != 0;
    }
    const bool is_odd_half = (twice & 1) != 0, is_even_below = (twice & 2) == 0;
    twice >>= 1;
    return is_odd_half && (is_inexact || !is_even_below) ? twice + 1 : twice;
}

uint8_t decimal_write_angle(char *text, int32_t count)
{
    char reversed[20];
    uint64_t units = angle_units(count < 0 ? -(uint32_t)count : (uint32_t)count);
    const bool is_negative = count < 0 && units != 0; /* -0.0 is never sent */
    uint8_t length = 0, written = 0;
    do {
        if (length == DECIMALS) {
            reversed[length++] = '.';
        }
        reversed[length++] = (char)('0' + divide_by_ten(&units));
    } while (units != 0 || length <= DECIMALS + 1);
    if (is_negative) {
        text[written++] = '-';
    }
    while (length != 0) {
        text[written++] = reversed[--length];
    }
    return written;
}
