/* The speed PID, with two gain sets, bumpless switching between them, and anti-windup:

       u = K (e + integral(e) / Ti - Td d(omega)/dt),    e = demand - measured

   The derivative acts on the measured speed alone, so a step of the demand gives no kick. */
#ifndef PID_H
#define PID_H

#include <stdint.h>

#define ERROR_BITS 8    /* fraction bits of a speed error, counts a window */
#define OUTPUT_BITS 20  /* fraction bits of the output, PWM steps */

enum gain_set { GAIN_SET_RAMP, GAIN_SET_HOLD };

struct pid {
    int32_t integral;   /* PWM steps, OUTPUT_BITS */
    int32_t measured;   /* counts a window */
    uint8_t gain_set;
    int16_t duty;       /* PWM steps */
};

/* Take the regulator one tick on; the demand has ERROR_BITS, the measured speed none. */
void pid_step(struct pid *pid, uint8_t gain_set, int32_t demand, int32_t measured);

/* Forget everything but the speed: the drive is off. */
void pid_switch_off(struct pid *pid, int32_t measured);

int32_t clamp(int64_t number, int32_t bound);

#endif
