#include "board.h"

#include "table_constants.h"

_Static_assert(F_CPU == 16000000UL, "the constants of the timers are for 16 MHz");

void board_init(void)
{
    /* Inputs have pull-ups: an open wire gives no edges and no bytes. PORTC and PORTD are never written again. */
    PORTC = _BV(PORTC0);
    PORTD = _BV(PORTD0) | _BV(PORTD2) | _BV(PORTD3);
    PORTB = 0; /* the bridge is off, whatever a bootloader has left */
    DDRB = _BV(DDB0) | _BV(DDB1);

    /* Both external interrupts on any edge, the pin change interrupt on the trigger alone. */
    EICRA = _BV(ISC10) | _BV(ISC00);
    EIMSK = _BV(INT1) | _BV(INT0);
    PCMSK1 = _BV(PCINT8);
    PCICR = _BV(PCIE1);

    /* Timer 1, phase-correct PWM: the bridge is on for exactly OCR1A of ICR1 steps, 0 and all of them included. ICR1 can
       be written only in such a mode. The pin and the clock come last: a period of 0 would switch the bridge fully on. */
    TCCR1A = _BV(WGM11);
    TCCR1B = _BV(WGM13);
    ICR1 = DUTY_MAX;
    OCR1A = 0;
    TCCR1A = _BV(COM1A1) | _BV(WGM11);
    TCCR1B = _BV(WGM13) | _BV(CS10);

    /* Timer 2, clear on compare match: the tick. */
    OCR2A = TICK_TIMER_TOP;
    TCCR2A = _BV(WGM21);
    TIMSK2 = _BV(OCIE2A);
    TCCR2B = TICK_TIMER_CLOCK;
}

void board_drive(int16_t duty)
{
    if (duty < 0) {
        PORTB |= _BV(PORTB0);
        OCR1A = (uint16_t)-duty;
    } else {
        PORTB &= (uint8_t)~_BV(PORTB0);
        OCR1A = (uint16_t)duty;
    }
}
