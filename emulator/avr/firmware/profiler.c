#include "profiler.h"

#include "decimal.h"
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

static bool can_brake(uint32_t speed, uint32_t acceleration, int64_t room)
{
    return (int64_t)((uint64_t)speed * (speed + acceleration)) <= room;
}

/* Return the greatest speed v from `low` up to below `high` with v (v + a) <= room, or `low` if there is none; `high` is
   too fast.

   One bit of the result a round, as in a root by hand: a step s from v takes s (2v + a + s) of the room. What is left is
   kept in units of s, so that a round works on 32 bits; a division of 64 bits would take half of the tick. */
static uint32_t fastest_that_can_brake(uint32_t low, uint32_t high, uint32_t acceleration, int64_t room)
{
    const int64_t spare = room - (int64_t)((uint64_t)low * (low + acceleration));
    if (spare <= 0 || high == low) {
        return low;
    }
    uint8_t bits = 0;
    while ((high - low) >> bits > 1) {
        ++bits;
    }
    uint32_t left = (uint32_t)((uint64_t)spare >> bits), next_bits = (uint32_t)spare, slope = 2 * low + acceleration;
    bool carry = ((uint64_t)spare >> bits) >> 32 != 0;
    next_bits = bits == 0 ? 0 : next_bits << (32 - bits);
    for (uint32_t step = 1UL << bits;; step >>= 1) {
        if (carry || left >= slope + step) {
            left -= slope + step;
            slope += 2 * step;
            low += step;
        }
        if (step == 1) {
            return low;
        }
        carry = (left & 0x80000000UL) != 0;
        left = left << 1 | next_bits >> 31;
        next_bits <<= 1;
    }
}

/* Return the way until the next tick towards a target ahead, and change the speed to that of the next tick.

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
        const int64_t room = acceleration * (2 * distance - now);
        if (!can_brake((uint32_t)fastest, (uint32_t)acceleration, room)) {
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
