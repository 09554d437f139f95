#include "profiler.h"

#include "arithmetic.h"
#include "table_constants.h"

#define FRACTION_MASK ((1UL << MOTION_BITS) - 1)

int64_t profiler_far(int32_t acceleration)
{
    uint64_t far = 1ULL << 61;
    divide(&far, (uint32_t)acceleration);
    return (int64_t)far;
}

bool profiler_is_at_rest(const struct reference *reference)
{
    return reference->speed == 0 && reference->distance == 0;
}

/* Return v (v + a): the room that a speed takes. */
static uint64_t room_for(uint32_t speed, uint32_t acceleration)
{
    return (uint64_t)speed * (speed + acceleration);
}

/* Return 2v + a for the greatest speed v that the spare room allows, from the slope 2v + a of the start, by at most
   `span`. A step s costs s (2v + a + s) of the room, as in a root by hand; what is left of it is in units of the step.
   A function of its own, so that all of it stays in registers. */
static __attribute__((noinline)) uint32_t climb(uint32_t slope, uint32_t span, uint64_t spare)
{
    uint32_t step = 0x80000000UL, left = (uint32_t)(spare >> 31), next_bits = (uint32_t)spare << 1;
    bool carry = false;
    do {
        if (step <= span) {
            slope += step;
            if (carry || left >= slope) {
                left -= slope;
                slope += step;
            } else {
                slope -= step;
            }
        }
        carry = (left & 0x80000000UL) != 0;
        left = left << 1 | next_bits >> 31;
        next_bits <<= 1;
        step >>= 1;
    } while (step != 0);
    return slope;
}

/* Return the greatest speed v from `low` up to below `high` with v (v + a) <= room, or `low` if there is none; `high` is
   too fast. One bit of it a round, on 32 bits: a division of 64 bits would take half of the tick. */
static uint32_t fastest_that_can_brake(uint32_t low, uint32_t high, uint32_t acceleration, uint64_t room)
{
    const uint64_t taken = room_for(low, acceleration);
    if (room <= taken) {
        return low;
    }
    return (climb(2 * low + acceleration, high - low, room - taken) - acceleration) >> 1;
}

/* Return the way until the next tick towards a target ahead, and set the speed of the next tick.

   From the next speed v' the table brakes at a over v'^2 / 2a. It stops in time when
   (v + v') / 2 + v'^2 / 2a <= distance, that is v'^2 + a (v + v') <= 2 a distance. */
static int32_t advance(const struct profile *profile, int32_t *speed, int64_t distance)
{
    const int32_t now = *speed, acceleration = profile->acceleration;
    const int32_t slowest = now - acceleration;
    int32_t fastest = now + acceleration;
    if (slowest > profile->speed) {
        fastest = slowest;
    } else if (fastest > profile->speed) {
        fastest = profile->speed;
    }
    if (now >= 0 && now <= acceleration && (2 * distance < now || distance <= (acceleration >> 2) + 2)) {
        *speed = 0; /* the rest of the way is shorter than a tick */
        return (int32_t)distance;
    }
    if (fastest > 0 && distance < profile->far) {
        const int64_t twice = 2 * distance - now;
        const uint64_t room = twice > 0 ? (uint64_t)twice * (uint32_t)acceleration : 0;
        if (room_for((uint32_t)fastest, (uint32_t)acceleration) > room) {
            const uint32_t low = slowest > 0 ? (uint32_t)slowest : 0;
            fastest = (int32_t)fastest_that_can_brake(low, (uint32_t)fastest, (uint32_t)acceleration, room);
        }
    }
    *speed = fastest;
    return now + ((fastest - now) >> 1); /* their sum may be more than 32 bits */
}

void profiler_step(const struct profile *profile, struct reference *reference)
{
    int32_t way;
    if (reference->distance > 0 || (reference->distance == 0 && reference->speed < 0)) {
        way = advance(profile, &reference->speed, reference->distance);
    } else { /* the target is behind: the same in the mirror */
        int32_t speed = -reference->speed;
        way = -advance(profile, &speed, -reference->distance);
        reference->speed = -speed;
    }
    reference->distance -= way;
    uint32_t fraction = reference->fraction + ((uint32_t)way & FRACTION_MASK);
    uint32_t counts = (uint32_t)(way >> MOTION_BITS);
    if (fraction > FRACTION_MASK) {
        fraction -= FRACTION_MASK + 1;
        ++counts;
    }
    reference->fraction = fraction;
    reference->position = (int32_t)((uint32_t)reference->position + counts);
}
