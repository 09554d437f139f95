#include "controller.h"

#include <stdlib.h>
#include <string.h>
#include <util/atomic.h>

#include "table_constants.h"

struct controller controller;

/* The counts of the last ticks, as a ring: the next one to be replaced is as old as the speed window is long. */
static int32_t window[SPEED_WINDOW_TICKS];
static uint8_t oldest;

void controller_init(int32_t count)
{
    memset(&controller, 0, sizeof controller);
    controller.pid.gain_set = GAIN_SET_HOLD;
    controller.reference.position = controller.count = count;
    for (uint8_t i = 0; i < SPEED_WINDOW_TICKS; ++i) {
        window[i] = count;
    }
}

/* Return the difference of two counts, also across the end of the counter's range. */
static int32_t counts_between(int32_t from, int32_t to)
{
    return (int32_t)((uint32_t)to - (uint32_t)from);
}

/* Return the measured speed, counts a window, and put the new count into the window. */
static int32_t measure(int32_t count)
{
    const int32_t measured = counts_between(window[oldest], count);
    window[oldest] = count;
    oldest = (uint8_t)(oldest + 1U) % SPEED_WINDOW_TICKS;
    return measured;
}

static void switch_off(uint8_t motion, int32_t measured)
{
    controller.motion = motion;
    pid_switch_off(&controller.pid, measured);
    controller.still_ticks = controller.settling_ticks = controller.arrived_ticks = 0;
}

/* Return the way from the encoder to the reference, in whole counts. */
static int32_t remaining_counts(int32_t count)
{
    const uint32_t is_upper_half = controller.reference.fraction >> (MOTION_BITS - 1);
    return counts_between(count, (int32_t)((uint32_t)controller.reference.position + is_upper_half));
}

/* Follow the profile; return its speed as the demand. */
static int32_t follow_profile(uint8_t *gain_set)
{
    const int32_t last_speed = controller.reference.speed;
    profiler_step(&controller.profile, &controller.reference);
    *gain_set = controller.reference.speed == last_speed ? GAIN_SET_HOLD : GAIN_SET_RAMP;
    if (profiler_is_at_rest(&controller.reference)) {
        controller.motion = MOTION_SETTLING;
    }
    return controller.reference.speed;
}

/* Creep to the target; return the speed to creep at, 0 there. */
static int32_t settle(int32_t remaining)
{
    const bool is_there = remaining >= -ARRIVAL_COUNT && remaining <= ARRIVAL_COUNT;
    controller.arrived_ticks = is_there ? controller.arrived_ticks + 1 : 0;
    ++controller.settling_ticks;
    return is_there ? 0 : clamp((int64_t)remaining * APPROACH_RATE, APPROACH_SPEED);
}

void controller_step(int32_t count)
{
    const int32_t measured = measure(count);
    const bool is_still = count == controller.count;
    controller.count = count;
    if (controller.motion == MOTION_IDLE || controller.motion == MOTION_STALLED) {
        switch_off(controller.motion, measured);
        return;
    }

    uint8_t gain_set = GAIN_SET_HOLD;
    int32_t demand;
    if (controller.motion == MOTION_MOVING) {
        demand = follow_profile(&gain_set);
    } else {
        demand = settle(remaining_counts(count));
        if (controller.arrived_ticks >= ARRIVAL_TICKS) {
            switch_off(MOTION_IDLE, measured);
            return;
        }
    }
    const int32_t window_demand = (int32_t)(((int64_t)demand * SPEED_WINDOW_TICKS) >> (MOTION_BITS - ERROR_BITS));
    pid_step(&controller.pid, gain_set, window_demand, measured);

    const bool is_blocked = is_still && abs(controller.pid.duty) >= STALL_DUTY;
    controller.still_ticks = is_blocked ? controller.still_ticks + 1 : 0;
    if (controller.still_ticks >= STALL_TICKS || controller.settling_ticks >= SETTLING_TICKS) {
        const struct reference here = {.position = count};
        controller.reference = here;
        switch_off(MOTION_STALLED, measured);
    }
}

struct reference controller_reference(void)
{
    struct reference reference;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        reference = controller.reference;
    }
    return reference;
}

int32_t controller_count(void)
{
    int32_t count;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        count = controller.count;
    }
    return count;
}

void controller_move(const struct profile *profile, int64_t distance)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        controller.profile = *profile;
        controller.reference.distance = distance;
        controller.motion = MOTION_MOVING;
        controller.still_ticks = controller.settling_ticks = controller.arrived_ticks = 0;
    }
}
