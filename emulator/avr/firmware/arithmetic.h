/* Quotients of 64 bits. The compiler's own division takes more than a tick. */
#ifndef ARITHMETIC_H
#define ARITHMETIC_H

#include <stdint.h>

/* Divide a number in place, and return the remainder: a bit a round. */
uint32_t divide(uint64_t *number, uint32_t divisor);

/* The same with a constant divisor, whose reciprocal is UINT64_MAX / divisor. */
uint32_t divide_by_reciprocal(uint64_t *number, uint32_t divisor, uint64_t reciprocal);

/* Divide a number by ten in place, and return the remainder: a byte a round. */
uint8_t divide_by_ten(uint64_t *number);

#endif
