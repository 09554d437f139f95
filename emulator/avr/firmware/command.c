#include "command.h"

#include <avr/pgmspace.h>
#include <stdbool.h>
#include <string.h>

#include "controller.h"
#include "decimal.h"
#include "encoder.h"
#include "line.h"
#include "table_constants.h"

#define FIRST_POSITION (-(INT64_C(1) << (31 + MOTION_BITS)))
#define LAST_POSITION ((int64_t)INT32_MAX << MOTION_BITS)
#define LONGEST_DISTANCE (INT64_C(1) << (31 + MOTION_BITS))

static const struct scale position_scale = SCALE(POSITION_NUMERATOR, MOTION_BITS, POSITION_DIVISOR);
static const struct scale speed_scale = SCALE(SPEED_NUMERATOR, MOTION_BITS, SPEED_DIVISOR);
static const struct scale acceleration_scale = SCALE(ACCELERATION_NUMERATOR, MOTION_BITS, ACCELERATION_DIVISOR);

static const char *const refusals[] = {
    [REFUSED_UNKNOWN_COMMAND] = "ERR 1 unknown command\r",
    [REFUSED_BAD_NUMBER] = "ERR 2 bad number\r",
    [REFUSED_OUT_OF_RANGE] = "ERR 3 out of range\r",
    [REFUSED_LINE_TOO_LONG] = "ERR 4 line too long\r",
    [REFUSED_BAD_BYTE] = "ERR 5 bad byte\r",
};

/* S and A for the motions to come. */
static struct profile next_profile;
static struct decimal speed_limit, acceleration_limit;

void command_init(void)
{
    static const char speed[] = SPEED_LIMIT, acceleration[] = ACCELERATION_LIMIT;
    decimal_read(&speed_limit, speed, sizeof speed - 1);
    decimal_read(&acceleration_limit, acceleration, sizeof acceleration - 1);
    next_profile.speed = POWER_ON_SPEED;
    next_profile.acceleration = POWER_ON_ACCELERATION;
    next_profile.far = profiler_far(POWER_ON_ACCELERATION);
}

static void accept(void)
{
    line_write("OK\r", 3);
}

void command_refuse(uint8_t reason)
{
    if (!STRICT_TABLE1) {
        line_write(refusals[reason], (uint8_t)strlen(refusals[reason]));
    }
}

static void answer_angle(char letter, int32_t count)
{
    char reply[LINE_LIMIT + 1];
    reply[0] = letter;
    reply[1] = ' ';
    uint8_t length = (uint8_t)(2U + decimal_write_angle(reply + 2, count));
    reply[length++] = '\r';
    line_write(reply, length);
}

/* Return an angle with MOTION_BITS; false when it is outside of all ranges. */
static bool scaled_angle(const struct decimal *number, int64_t *angle)
{
    if (number->is_huge || number->whole > POSITION_WHOLE_MAX) {
        return false;
    }
    *angle = (int64_t)decimal_scaled(number, &position_scale);
    if (number->is_negative) {
        *angle = -*angle;
    }
    return true;
}

static bool begin_motion(int64_t distance)
{
    if (distance < -LONGEST_DISTANCE || distance > LONGEST_DISTANCE) {
        return false;
    }
    controller_move(&next_profile, distance);
    return true;
}

static bool move_to(const struct decimal *number)
{
    int64_t target;
    if (!scaled_angle(number, &target) || target < FIRST_POSITION || target > LAST_POSITION) {
        return false;
    }
    const struct reference reference = controller_reference();
    return begin_motion(target - (int64_t)reference.position * (INT64_C(1) << MOTION_BITS) - reference.fraction);
}

static bool move_by(const struct decimal *number)
{
    int64_t distance;
    return scaled_angle(number, &distance) && begin_motion(distance);
}

/* Set S or A. The limit holds for the number that was sent, the register may hold a rounded one. */
static bool set(int32_t *setting, const struct decimal *number, const struct decimal *limit, const struct scale *scale)
{
    if (number->is_negative || decimal_exceeds(number, limit)) {
        return false;
    }
    const int32_t value = (int32_t)decimal_scaled(number, scale);
    if (value < 1) {
        return false;
    }
    *setting = value;
    return true;
}

static bool set_speed(const struct decimal *number)
{
    return set(&next_profile.speed, number, &speed_limit, &speed_scale);
}

static bool set_acceleration(const struct decimal *number)
{
    if (!set(&next_profile.acceleration, number, &acceleration_limit, &acceleration_scale)) {
        return false;
    }
    next_profile.far = profiler_far(next_profile.acceleration);
    return true;
}

static void carry_out(bool (*command)(const struct decimal *), const char *text, uint8_t length)
{
    struct decimal number;
    if (!decimal_read(&number, text, length)) {
        command_refuse(REFUSED_BAD_NUMBER);
    } else if (!command(&number)) {
        command_refuse(REFUSED_OUT_OF_RANGE);
    } else {
        accept();
    }
}

static void read_register(char letter, int32_t count, uint8_t length)
{
    if (length != 0) {
        command_refuse(REFUSED_BAD_NUMBER);
    } else {
        answer_angle(letter, count);
    }
}

void command_execute(const char *line, uint8_t length)
{
    const char *text = line + 1;
    --length;
    while (length != 0 && text[length - 1] == ' ') {
        --length;
    }
    while (length != 0 && *text == ' ') {
        ++text;
        --length;
    }
    switch (line[0]) {
    case 'H':
        read_register('H', controller_count(), length);
        break;
    case 'L':
        read_register('L', encoder_latch(), length);
        break;
    case 'P':
        carry_out(move_to, text, length);
        break;
    case 'R':
        carry_out(move_by, text, length);
        break;
    case 'S':
        carry_out(set_speed, text, length);
        break;
    case 'A':
        carry_out(set_acceleration, text, length);
        break;
    default:
        command_refuse(REFUSED_UNKNOWN_COMMAND);
    }
}
