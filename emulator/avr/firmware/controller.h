/* The controller: what a tick makes of the encoder's count, and the states of a motion.

   IDLE      the drive is off; friction holds the table
   MOVING    the profile runs, the PID follows its speed
   SETTLING  the profile has ended; the table creeps until the encoder has stayed at the target for a while, then IDLE
   STALLED   the motor was driven but the encoder stood still: the drive is off until the next motion */
#ifndef CONTROLLER_H
#define CONTROLLER_H

#include <stdbool.h>
#include <stdint.h>

#include "pid.h"
#include "profiler.h"

enum motion { MOTION_IDLE, MOTION_MOVING, MOTION_SETTLING, MOTION_STALLED };

struct controller {
    uint8_t motion;
    struct pid pid;
    struct profile profile;
    struct reference reference;
    int32_t count;            /* of the last tick */
    uint32_t still_ticks;     /* driven hard without a change of the count */
    uint32_t settling_ticks;  /* since the profile ended */
    uint32_t arrived_ticks;   /* within the arrival window without a break */
};

/* Only the tick's interrupt changes it, and `controller_move`, with interrupts off. */
extern struct controller controller;

void controller_init(int32_t count);

/* Take the controller one tick on, at the end of which the encoder's counter reads `count`. */
void controller_step(int32_t count);

/* Return the reference between two ticks. */
struct reference controller_reference(void);

/* Return the encoder's count of the last tick. */
int32_t controller_count(void);

/* Begin a motion by a distance (MOTION_BITS) from the reference, which goes on from its position and speed. */
void controller_move(const struct profile *profile, int64_t distance);

#endif
