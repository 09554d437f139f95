/* The quadrature encoder on the motor's shaft, its 32-bit counter, and the latch of the probe's trigger. */
#ifndef ENCODER_H
#define ENCODER_H

#include <stdint.h>

/* The counter at power-on. It is a variable, so that a debugger that halts at main() can start it elsewhere. */
extern volatile int32_t wake_count;

/* The count at the last edge of the trigger. Read it with `encoder_latch`. */
extern volatile int32_t latched_count;

void encoder_init(void);

/* Bring the 32-bit counter level with the edges, and return it. Call it with interrupts off, once a tick: the edges of
   a tick must fit 16 bits. */
int32_t encoder_sample(void);

/* Return the count at the last edge of the trigger. */
int32_t encoder_latch(void);

#endif
