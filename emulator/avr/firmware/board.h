/* The board: an ATmega328P at 16 MHz, its pins and its timers.

   | pin       | Arduino | is                                                              |
   |-----------|---------|-----------------------------------------------------------------|
   | PD0, PD1  | D0, D1  | serial line                                                     |
   | PD2, PD3  | D2, D3  | encoder, channels A and B, on the external interrupts           |
   | PB1       | D9      | PWM to the H-bridge (OC1A)                                      |
   | PB0       | D8      | direction to the H-bridge: low drives forwards                  |
   | PC0       | A0      | trigger of the probe, active low, on a pin change interrupt     |
*/
#ifndef BOARD_H
#define BOARD_H

#include <avr/io.h>
#include <stdbool.h>
#include <stdint.h>

void board_init(void);

/* Put a duty on the bridge, in PWM steps; below 0 it drives backwards. At 0 the bridge shorts the motor. */
void board_drive(int16_t duty);

/* Return channel A in bit 0 and channel B in bit 1. */
static inline uint8_t board_encoder_channels(void)
{
    return (uint8_t)((PIND >> PIND2) & 3U);
}

static inline bool board_trigger_is_high(void)
{
    return (PINC & _BV(PINC0)) != 0;
}

#endif
