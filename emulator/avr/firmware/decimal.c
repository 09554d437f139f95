#include "decimal.h"

#include "arithmetic.h"
#include "table_constants.h"

_Static_assert(POSITION_WHOLE_MAX < 0xFFFFFFFF, "the whole part of a position has 32 bits");

/* Add a product to a number and divide the sum by 100, both a byte a round; return the remainder. The sum fits. */
static uint8_t add_and_divide(uint64_t *number, const uint64_t *term, uint8_t factor)
{
    uint8_t *byte = (uint8_t *)number;
    const uint8_t *term_byte = (const uint8_t *)term;
    uint8_t carry = 0;
    do {
        const uint16_t sum = (uint16_t)((uint16_t)(*term_byte++ * factor) + *byte + carry);
        *byte++ = (uint8_t)sum;
        carry = (uint8_t)(sum >> 8);
    } while (byte != (uint8_t *)(number + 1));
    uint8_t remainder = 0;
    do {
        --byte;
        /* remainder * 256 + byte = remainder * 200 + part; the quotient of part is right, or one too much */
        const uint16_t part = (uint16_t)(remainder * 56U + *byte);
        uint8_t quotient = (uint8_t)((part * 656UL) >> 16);
        if ((uint16_t)(quotient * 100U) > part) {
            --quotient;
        }
        *byte = (uint8_t)(remainder * 2U + quotient);
        remainder = (uint8_t)(part - quotient * 100U);
    } while (byte != (uint8_t *)number);
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

/* Return half of a number to which less than one is to be added if it is inexact, rounded; halves go to the even one. */
static uint64_t halved(uint64_t twice, bool is_inexact)
{
    const bool is_half = (twice & 1) != 0, is_odd = (twice & 2) != 0;
    return (twice >> 1) + (is_half && (is_inexact || is_odd) ? 1 : 0);
}

uint64_t decimal_scaled(const struct decimal *decimal, const struct scale *scale)
{
    /* The digits after the point in pairs, the last one first: twice the factor times 0.p1 p2 ... is (p1 twice + (p2
       twice + ... ) / 100) / 100. Each quotient is rounded down, and so is their whole; whether anything was lost is
       kept. */
    uint64_t twice = 0;
    bool is_inexact = false;
    for (uint8_t i = (uint8_t)((decimal->digit_count + 1U) & ~1U); i != 0; i = (uint8_t)(i - 2U)) {
        const uint8_t tens = (uint8_t)(digit_at(decimal, (uint8_t)(i - 2U)) - '0');
        const uint8_t ones = (uint8_t)(digit_at(decimal, (uint8_t)(i - 1U)) - '0');
        is_inexact |= add_and_divide(&twice, &scale->twice, (uint8_t)(tens * 10U + ones)) != 0;
    }
    if (scale->divisor == 1) {
        twice += scale->twice * decimal->whole;
    } else {
        const uint32_t quotient = decimal->whole / scale->divisor;
        twice += scale->twice * (decimal->whole - quotient * scale->divisor);
        is_inexact |= divide_by_reciprocal(&twice, scale->divisor, scale->reciprocal) != 0;
        twice += scale->twice * quotient;
    }
    return halved(twice, is_inexact);
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
        is_inexact = divide_by_reciprocal(&twice, ANGLE_DIVISOR, UINT64_MAX / ANGLE_DIVISOR) != 0;
    }
    return halved(twice, is_inexact);
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
