/* Made by `python -m tools.firmware_header` from emulator/config/default.toml: do not edit. */
#ifndef TABLE_CONSTANTS_H
#define TABLE_CONSTANTS_H

#define TABLE_DIGEST "45ce4bc6f728a61e"

/* Timers and line, at 16 MHz. */
#define TICK_HZ                      1000
#define TICK_TIMER_CLOCK             4 /* prescaler 64 */
#define TICK_TIMER_TOP               249
#define UART_DIVIDER                 103
#define UART_DOUBLE_SPEED            0
#define DUTY_MAX                     1023

/* Replies. */
#define DECIMALS                     1
#define STRICT_TABLE1                0

/* Controller; speeds in counts a tick with MOTION_BITS fraction bits. */
#define MOTION_BITS                  26
#define SPEED_WINDOW_TICKS           8
#define ARRIVAL_COUNT                1L
#define ARRIVAL_TICKS                100UL
#define APPROACH_RATE                536871L
#define APPROACH_SPEED               17179869L
#define STALL_DUTY                   512
#define STALL_TICKS                  250UL
#define SETTLING_TICKS               3000UL
#define POWER_ON_SPEED               343597384L
#define POWER_ON_ACCELERATION        687195L

/* Limits, as the decimals that a command must not exceed. */
#define SPEED_LIMIT                  "40.0"
#define ACCELERATION_LIMIT           "100.0"
#define POSITION_WHOLE_MAX           4194304UL

/* From degrees to counts, as fractions in lowest terms. */
#define POSITION_NUMERATOR           512UL
#define POSITION_DIVISOR             1UL
#define SPEED_NUMERATOR              64UL
#define SPEED_DIVISOR                125UL
#define ACCELERATION_NUMERATOR       8UL
#define ACCELERATION_DIVISOR         15625UL

/* From counts to half units of the last decimal of a reply. */
#define ANGLE_NUMERATOR              5UL
#define ANGLE_DIVISOR                128UL

#ifndef TABLE_GAINS_H /* else `gains.h` of `python -m tools.tune` has been included before */
/* Gains: PWM steps for a speed error of one count a window. */
#define GAIN_FRACTION_BITS           12
#define INTEGRAL_GAIN_FRACTION_BITS  16
#define GAINS_RAMP_PROPORTIONAL      14936L
#define GAINS_RAMP_INTEGRAL          37932L
#define GAINS_RAMP_DERIVATIVE        19417L
#define GAINS_HOLD_PROPORTIONAL      17493L
#define GAINS_HOLD_INTEGRAL          24552L
#define GAINS_HOLD_DERIVATIVE        17493L
#elif GAINS_TICK_HZ != 1000 || GAINS_SPEED_WINDOW_TICKS != 8 || GAINS_DUTY_MAX != 1023
#error "gains.h is for another tick, window or PWM"
#endif

#endif
