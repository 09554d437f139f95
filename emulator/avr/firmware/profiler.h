/* The trapezoidal velocity profile: reference position and speed of the control loop.

   Nothing is planned ahead. At each tick the reference takes the greatest speed that acceleration, top speed and the
   distance left to brake allow, so a new target may come at any time. Positions are counts, speeds counts a tick,
   accelerations counts a tick squared, all with MOTION_BITS fraction bits unless a comment says otherwise. */
#ifndef PROFILER_H
#define PROFILER_H

#include <stdbool.h>
#include <stdint.h>

struct profile {
    int32_t speed;        /* the greatest */
    int32_t acceleration;
    int64_t far;          /* counts: from there any speed can be braked; see `profiler_far` */
};

struct reference {
    int32_t position;     /* whole counts; it runs over */
    uint32_t fraction;
    int32_t speed;
    int64_t distance;     /* to the target */
};

/* Return the distance up to which a tick of this acceleration stays within 64 bits. It takes a long division, so it
   belongs where the command is read. */
int64_t profiler_far(int32_t acceleration);

bool profiler_is_at_rest(const struct reference *reference);

/* Take the reference one tick on. */
void profiler_step(const struct profile *profile, struct reference *reference);

#endif
