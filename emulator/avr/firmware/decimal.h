/* Decimal numbers as they stand on the line, converted without an error beyond the one rounding. */
#ifndef DECIMAL_H
#define DECIMAL_H

#include <stdbool.h>
#include <stdint.h>

struct decimal {
    bool is_negative;
    bool is_huge;         /* the whole part is more than 32 bits hold */
    uint32_t whole;
    const char *digits;   /* after the point */
    uint8_t digit_count;
};

/* A factor from a decimal to a register: `twice` / (2 `divisor`). The reciprocal of the divisor has 64 fraction bits. */
struct scale {
    uint64_t twice;
    uint32_t divisor;
    uint64_t reciprocal;
};

#define SCALE(numerator, fraction_bits, divisor) \
    {(uint64_t)(numerator) << ((fraction_bits) + 1), (divisor), UINT64_MAX / (divisor)}

/* Read `[+-]digits[.digits]`, which must be all of the text; the digits stay where they are. */
bool decimal_read(struct decimal *decimal, const char *text, uint8_t length);

/* Tell whether the magnitude of one number is greater than that of another. */
bool decimal_exceeds(const struct decimal *decimal, const struct decimal *limit);

/* Return the magnitude times the factor, rounded to the nearest integer; halves go to the even one. The whole part must
   be so small that the result fits 62 bits. */
uint64_t decimal_scaled(const struct decimal *decimal, const struct scale *scale);

/* Write the angle of a count in degrees, rounded to DECIMALS places; halves go to the even digit. Return its length. */
uint8_t decimal_write_angle(char *text, int32_t count);

#endif
