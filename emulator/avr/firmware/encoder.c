#include "encoder.h"

#include <avr/interrupt.h>
#include <stdbool.h>
#include <util/atomic.h>

#include "board.h"

volatile int32_t wake_count = 0;
volatile int32_t latched_count;

/* The interrupt counts modulo 2^16, which is quick. The two low bits are the phase of the encoder. */
static volatile uint16_t edges;
static uint16_t sampled_edges;
int32_t encoder_position; /* brought level at each tick */
static bool trigger_was_high;

/* Return the 32-bit count after some edges since the last tick. In unsigned arithmetic, where running over the end of
   the range is defined: the counter goes on at the other. */
static inline int32_t count_after(uint16_t edges_since)
{
    return (int32_t)((uint32_t)encoder_position + (uint32_t)(int32_t)(int16_t)edges_since);
}

/* Where between four counts the encoder stands: channels A and B are a Gray code. */
static inline uint8_t phase(void)
{
    const uint8_t channels = board_encoder_channels();
    return (uint8_t)(channels ^ (channels >> 1));
}

void encoder_init(void)
{
    edges = sampled_edges = phase();
    encoder_position = latched_count = wake_count;
    trigger_was_high = board_trigger_is_high();
}

/* An edge on either channel. An interrupt that comes late sees two edges at once: then the shaft still turns as it did
   at the last one. A glitch that is over by now changes nothing, so errors do not add up. */
ISR(INT0_vect)
{
    static int8_t last_step = 1;
    uint16_t now = edges;
    const uint8_t change = (uint8_t)(phase() - (uint8_t)now) & 3U;
    if (change == 1U) {
        ++now;
        last_step = 1;
    } else if (change == 3U) {
        --now;
        last_step = -1;
    } else if (change == 2U) {
        now = (uint16_t)(now + (uint16_t)(2 * last_step));
    }
    edges = now;
}
ISR_ALIAS(INT1_vect, INT0_vect);

/* The trigger is active low. A pulse that is over before the interrupt runs counts too: the pin was high before. */
ISR(PCINT1_vect)
{
    const bool is_high = board_trigger_is_high();
    if (!is_high || trigger_was_high) {
        latched_count = count_after((uint16_t)(edges - sampled_edges));
    }
    trigger_was_high = is_high;
}

int32_t encoder_sample(void)
{
    const uint16_t now = edges;
    encoder_position = count_after((uint16_t)(now - sampled_edges));
    sampled_edges = now;
    return encoder_position;
}

int32_t encoder_latch(void)
{
    int32_t count;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        count = latched_count;
    }
    return count;
}
