#include "arithmetic.h"

#include <stdbool.h>

uint32_t divide(uint64_t *number, uint32_t divisor)
{
    /* Two words of 32 bits: the compiler calls a function for each shift of 64. */
    uint32_t high = (uint32_t)(*number >> 32), low = (uint32_t)*number, remainder = 0;
    for (uint8_t bit = 64; bit != 0; --bit) {
        const bool carry = (remainder & 0x80000000UL) != 0;
        remainder = remainder << 1 | high >> 31;
        high = high << 1 | low >> 31;
        low <<= 1;
        if (carry || remainder >= divisor) {
            remainder -= divisor;
            low |= 1;
        }
    }
    *number = (uint64_t)high << 32 | low;
    return remainder;
}

uint32_t divide_by_reciprocal(uint64_t *number, uint32_t divisor, uint64_t reciprocal)
{
    const uint32_t high = (uint32_t)(*number >> 32), low = (uint32_t)*number;
    const uint32_t factor_high = (uint32_t)(reciprocal >> 32), factor_low = (uint32_t)reciprocal;
    /* Without its lowest part the product is a little less than the quotient, if anything. */
    uint64_t quotient = (uint64_t)high * factor_high;
    quotient += (uint32_t)(((uint64_t)low * factor_high) >> 32);
    quotient += (uint32_t)(((uint64_t)high * factor_low) >> 32);
    uint64_t remainder = *number - quotient * divisor;
    while (remainder >= divisor) {
        remainder -= divisor;
        ++quotient;
    }
    *number = quotient;
    return (uint32_t)remainder;
}

uint8_t divide_by_ten(uint64_t *number)
{
    uint8_t *byte = (uint8_t *)(number + 1);
    uint8_t remainder = 0;
    do {
        --byte;
        /* remainder * 256 + byte = remainder * 250 + part, and part / 10 is at most 30 */
        const uint16_t part = (uint16_t)(remainder * 6U + *byte);
        const uint8_t quotient = (uint8_t)((uint16_t)(part * 205U) >> 11);
        *byte = (uint8_t)(remainder * 25U + quotient);
        remainder = (uint8_t)(part - quotient * 10U);
    } while (byte != (uint8_t *)number);
    return remainder;
}
