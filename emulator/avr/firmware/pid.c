#include "pid.h"

#include <stdbool.h>

#include "table_constants.h"

#define ERROR_MAX ((1L << 29) - 1) /* four products of it with a gain fit 64 bits */
#define INTEGRAL_SHIFT (ERROR_BITS + INTEGRAL_GAIN_FRACTION_BITS - OUTPUT_BITS)
#define OUTPUT_MAX ((int32_t)DUTY_MAX << OUTPUT_BITS)

struct gains {
    int32_t proportional;
    int32_t integral;
    int32_t derivative;
};

static const struct gains gain_sets[] = {
    [GAIN_SET_RAMP] = {GAINS_RAMP_PROPORTIONAL, GAINS_RAMP_INTEGRAL, GAINS_RAMP_DERIVATIVE},
    [GAIN_SET_HOLD] = {GAINS_HOLD_PROPORTIONAL, GAINS_HOLD_INTEGRAL, GAINS_HOLD_DERIVATIVE},
};

int32_t clamp(int64_t number, int32_t bound)
{
    return number > bound ? bound : number < -bound ? -bound : (int32_t)number;
}

/* Return what a gain set makes of error and change, without its integral. */
static int64_t direct(const struct gains *gains, int32_t error, int32_t change)
{
    return (int64_t)gains->proportional * error - (int64_t)gains->derivative * change;
}

void pid_step(struct pid *pid, uint8_t gain_set, int32_t demand, int32_t measured)
{
    const struct gains *gains = &gain_sets[gain_set];
    const int32_t error = clamp(demand - (int64_t)measured * (1 << ERROR_BITS), ERROR_MAX);
    const int32_t change = clamp(((int64_t)measured - pid->measured) * (1 << ERROR_BITS), ERROR_MAX);
    const int64_t output = direct(gains, error, change);
    const int64_t growth = ((int64_t)gains->integral * error) >> INTEGRAL_SHIFT;
    int64_t integral = pid->integral;
    if (gain_set != pid->gain_set) {
        integral += direct(&gain_sets[pid->gain_set], error, change) - output; /* the output does not jump */
    }
    const int64_t sum = output + integral + growth;
    const bool is_above = sum >= OUTPUT_MAX, is_below = sum <= -OUTPUT_MAX;
    if (!(is_above && growth >= 0) && !(is_below && growth <= 0)) { /* saturated: no further into it */
        integral += growth;
    }
    pid->integral = clamp(integral, OUTPUT_MAX);
    pid->duty = (int16_t)clamp((output + pid->integral + (1L << (OUTPUT_BITS - 1))) >> OUTPUT_BITS, DUTY_MAX);
    pid->measured = measured;
    pid->gain_set = gain_set;
}

void pid_switch_off(struct pid *pid, int32_t measured)
{
    pid->integral = 0;
    pid->measured = measured;
    pid->duty = 0;
}
