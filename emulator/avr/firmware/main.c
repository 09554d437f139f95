/* A rotary table's controller for an ATmega328P at 16 MHz; the protocol is docs/protocol.md.

   Three levels of urgency. The interrupts of encoder, trigger and line are short and may come at any time. The tick's
   interrupt runs the controller with interrupts on, so that they may. The main loop reads and answers lines in the time
   that is left, between two ticks. */
#include <avr/interrupt.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <stdbool.h>

#include "board.h"
#include "command.h"
#include "controller.h"
#include "encoder.h"
#include "line.h"
#include "table_constants.h"

/* What this firmware was built for, so that a simulator can see that it has the plant for it. */
const char table_digest[] __attribute__((used, section(".progmem.digest"))) = TABLE_DIGEST;

volatile uint16_t overruns; /* ticks that came before the last one was over */

static volatile bool is_tick_over;

ISR(TIMER2_COMPA_vect)
{
    static bool is_running;
    if (is_running) { /* the controller is amid its step: nothing of it may be read */
        ++overruns;
        return;
    }
    board_drive(controller.pid.duty); /* the duty of the last tick: it changes at the same instant of each tick */
    const int32_t count = encoder_sample();
    line_release();
    is_running = true;
    sei();
    controller_step(count);
    cli();
    is_running = false;
    is_tick_over = true;
}

/* Wait for the end of the next tick. The flag is read with interrupts off: none may come between that and the sleep. */
static void sleep_until_tick_is_over(void)
{
    cli();
    while (!is_tick_over) {
        SMCR = _BV(SE); /* idle: the timers run on */
        sei();
        sleep_cpu();
        SMCR = 0;
        cli();
    }
    is_tick_over = false;
    sei();
}

int main(void)
{
    board_init();
    encoder_init();
    controller_init(wake_count);
    command_init();
    line_init();
    wdt_enable(WDTO_60MS); /* a program that is stuck would leave the bridge on; a reset switches it off */
    for (;;) {
        sleep_until_tick_is_over();
        wdt_reset();
        line_poll();
    }
}
