/* An ATmega328P in simavr, as a shared library that a simulated plant calls once for each control tick.

   Time is cut at the firmware's tick. A slice ends a little after the tick's interrupt was entered: by then it has put
   the duty on the bridge and sampled the encoder. What happens in the coming tick (edges of the encoder, bytes that
   arrive, edges of the trigger) is placed on the cycles up to a little before the next tick. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <simavr/avr_extint.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_interrupts.h>
#include <simavr/sim_irq.h>

DEFINE_FIFO(uint16_t, uart_fifo);

#define FREQUENCY 16000000UL
#define TICK_VECTOR 7      /* TIMER2_COMPA */
#define AFTER_TICK 300     /* cycles from the entry of the tick's interrupt to the end of the slice */
#define GUARD 150          /* cycles that are kept free of events before a tick and after a slice */
#define TRIGGER_PULSE 400  /* cycles */
#define BEAT 20            /* cycles */
#define MOST_EVENTS 1024
#define MOST_SENT 256
#define FIRST_PHASE 2      /* of the encoder: both channels high, as the pull-ups hold them */

/* Addresses in the data space, from the data sheet. */
#define PINS_B 0x25        /* PORTB */
#define TCCR1B 0x81
#define ICR1_LOW 0x86
#define ICR1_HIGH 0x87
#define OCR1A_LOW 0x88
#define OCR1A_HIGH 0x89
#define DIRECTION 0x01     /* PB0 */
#define WGM13 0x10         /* set in the modes whose period is ICR1, among those with WGM10 clear */

enum kind { EDGE_FORWARD, EDGE_BACKWARD, TRIGGER_DOWN, BYTE };

struct event {
    avr_cycle_count_t when;
    uint8_t kind;
    uint8_t byte;
};

/* The first fields are read by the caller, by the same declaration in Python. */
struct chip {
    int32_t duty;            /* on the bridge, below 0 backwards */
    uint32_t longest_tick;   /* cycles from the entry of the tick's interrupt to its end */
    uint32_t lost_edges;     /* interrupts that came while the last one of the same channel still waited */
    uint32_t duty_changes;   /* ticks amid which the duty became another */
    uint32_t overrun_bytes;  /* that came while two others waited in the hardware */
    int32_t pwm_steps;       /* of a period */
    int32_t line_count;      /* bytes that are leaving */
    uint32_t sent_count;     /* bytes whose stop bit has left */
    uint8_t sent[MOST_SENT];

    avr_t *avr;
    avr_uart_t *uart;
    avr_irq_t *channel[2], *trigger;
    avr_cycle_count_t tick_period, tick_entry, slice_end, byte_cycles, line_free;
    uint8_t has_started, has_ticked, phase, is_unguarded;
    struct event events[MOST_EVENTS];
    int first_event, event_count;
    uint8_t on_the_line[MOST_SENT];
    avr_cycle_count_t left_at[MOST_SENT];
    int line_first;
};

static void sleep_in_no_time(avr_t *avr, avr_cycle_count_t cycles)
{
    (void)avr;
    (void)cycles;
}

static avr_cycle_count_t end_of_slice(avr_t *avr, avr_cycle_count_t when, void *param)
{
    (void)avr;
    (void)when;
    (void)param;
    return 0; /* it only keeps `avr_run` from sleeping beyond the slice */
}

/* Keeps `avr_run` from sleeping for more than a few cycles. */
static avr_cycle_count_t beat(avr_t *avr, avr_cycle_count_t when, void *param)
{
    (void)avr;
    (void)param;
    return when + BEAT;
}

static int32_t bridge_duty(const struct chip *chip)
{
    const uint8_t *data = chip->avr->data;
    const int32_t steps = data[OCR1A_LOW] | data[OCR1A_HIGH] << 8;
    return data[PINS_B] & DIRECTION ? -steps : steps;
}

/* ICR1 can be written only while timer 1 is in a mode whose period it is. simavr would take it at any time. */
static void write_period(avr_t *avr, avr_io_addr_t address, uint8_t byte, void *param)
{
    (void)param;
    if (avr->data[TCCR1B] & WGM13) {
        avr->data[address] = byte;
    }
}

static void tick_changed(avr_irq_t *irq, uint32_t is_running, void *param)
{
    struct chip *chip = param;
    (void)irq;
    if (is_running) {
        chip->duty_changes += chip->has_started && bridge_duty(chip) != chip->duty;
        chip->has_ticked = 1;
        chip->tick_entry = chip->avr->cycle;
        chip->slice_end = chip->avr->cycle + AFTER_TICK;
        avr_cycle_timer_register(chip->avr, AFTER_TICK, end_of_slice, chip);
    } else {
        const uint32_t cycles = (uint32_t)(chip->avr->cycle - chip->tick_entry);
        chip->longest_tick = cycles > chip->longest_tick ? cycles : chip->longest_tick;
    }
}

static void byte_sent(avr_irq_t *irq, uint32_t byte, void *param)
{
    struct chip *chip = param;
    (void)irq;
    if (chip->line_count == MOST_SENT) {
        return;
    }
    const avr_cycle_count_t start = chip->avr->cycle > chip->line_free ? chip->avr->cycle : chip->line_free;
    const int last = (chip->line_first + chip->line_count++) % MOST_SENT;
    chip->line_free = start + chip->byte_cycles;
    chip->on_the_line[last] = (uint8_t)byte;
    chip->left_at[last] = chip->line_free;
}

static void turn(struct chip *chip, int step)
{
    const uint8_t before = chip->phase;
    chip->phase = (uint8_t)(before + step) & 3U;
    const uint8_t now = (uint8_t)(chip->phase ^ (chip->phase >> 1)), then = (uint8_t)(before ^ (before >> 1));
    const int changed = (now ^ then) == 1 ? 0 : 1; /* a Gray code: channel A is bit 0, channel B bit 1 */
    const uint8_t flags = chip->avr->data[0x3C];   /* EIFR */
    chip->lost_edges += (flags >> changed) & 1U;
    avr_raise_irq(chip->channel[changed], (now >> changed) & 1U);
}

static avr_cycle_count_t end_of_pulse(avr_t *avr, avr_cycle_count_t when, void *param)
{
    struct chip *chip = param;
    (void)avr;
    (void)when;
    avr_raise_irq(chip->trigger, 1);
    return 0;
}

static void pull_trigger(struct chip *chip)
{
    avr_raise_irq(chip->trigger, 1);
    avr_raise_irq(chip->trigger, 0);
    avr_cycle_timer_register(chip->avr, TRIGGER_PULSE, end_of_pulse, chip);
}

/* A byte is in the receiver. simavr's own pump is not used: it knows no instant of arrival. */
static void receive(struct chip *chip, uint8_t byte)
{
    avr_uart_t *uart = chip->uart;
    if (uart_fifo_get_read_size(&uart->input) >= 2) { /* as many as the hardware holds */
        avr_regbit_set(chip->avr, uart->dor);
        ++chip->overrun_bytes;
        return;
    }
    uart_fifo_write(&uart->input, byte);
    uart->rx_cnt = 0;
    uart->rxc_raise_time = chip->avr->cycle;
    avr_raise_interrupt(chip->avr, &uart->rxc);
}

static avr_cycle_count_t next_event(avr_t *avr, avr_cycle_count_t when, void *param)
{
    struct chip *chip = param;
    (void)when;
    while (chip->first_event < chip->event_count && chip->events[chip->first_event].when <= avr->cycle) {
        const struct event *event = &chip->events[chip->first_event++];
        switch (event->kind) {
        case EDGE_FORWARD:
            turn(chip, 1);
            break;
        case EDGE_BACKWARD:
            turn(chip, -1);
            break;
        case TRIGGER_DOWN:
            pull_trigger(chip);
            break;
        default:
            receive(chip, event->byte);
        }
    }
    return chip->first_event < chip->event_count ? chip->events[chip->first_event].when : 0;
}

/* Run to the end of a slice; return 0, or -1 when no tick came, or -2 when the program crashed. */
static int run_slice(struct chip *chip)
{
    avr_t *avr = chip->avr;
    const avr_cycle_count_t limit = avr->cycle + 4 * chip->tick_period + FREQUENCY / 100;
    chip->has_ticked = 0;
    chip->uart->cycles_per_byte = chip->byte_cycles; /* simavr counts a parity bit that is not sent */
    while (!chip->has_ticked || avr->cycle < chip->slice_end) {
        const int state = avr_run(avr);
        if (state == cpu_Done || state == cpu_Crashed) {
            return -2;
        }
        if (!chip->has_ticked && avr->cycle > limit) {
            return -1;
        }
    }
    chip->duty = bridge_duty(chip);
    chip->pwm_steps = avr->data[ICR1_LOW] | avr->data[ICR1_HIGH] << 8;
    chip->has_started = 1;
    while (chip->line_count && chip->left_at[chip->line_first] <= avr->cycle && chip->sent_count < MOST_SENT) {
        chip->sent[chip->sent_count++] = chip->on_the_line[chip->line_first];
        chip->line_first = (chip->line_first + 1) % MOST_SENT;
        --chip->line_count;
    }
    return 0;
}

static int add_event(struct chip *chip, avr_cycle_count_t when, uint8_t kind, uint8_t byte)
{
    if (chip->event_count == MOST_EVENTS) {
        return -3;
    }
    int place = chip->event_count++;
    while (place > 0 && chip->events[place - 1].when > when) {
        chip->events[place] = chip->events[place - 1];
        --place;
    }
    chip->events[place] = (struct event){when, kind, byte};
    return 0;
}

/* Return the share of the tick at which the shaft is at an edge, on the parabola through both ends of the tick. */
static double share_of(double way, double straight, double total)
{
    const double bend = total - straight;
    if (fabs(bend) < 1e-9 * fabs(total) + 1e-12) {
        return way / total;
    }
    const double root = sqrt(fmax(0.0, straight * straight + 4.0 * bend * way));
    const double share = 2.0 * way / (straight + (total < 0.0 ? -root : root));
    return share >= 0.0 && share <= 1.0 ? share : way / total;
}

struct chip *chip_new(const uint8_t *flash, uint32_t size, uint32_t tick_hz, uint32_t bit_cycles)
{
    struct chip *chip = calloc(1, sizeof *chip);
    if (!chip) {
        return NULL;
    }
    avr_t *avr = avr_make_mcu_by_name("atmega328p");
    if (!avr || size > avr->flashend + 1) {
        free(chip);
        return NULL;
    }
    avr_init(avr);
    avr->frequency = FREQUENCY;
    avr->sleep = sleep_in_no_time;
    avr_loadcode(avr, (uint8_t *)flash, size, 0);
    avr->codeend = size;
    chip->avr = avr;
    for (avr_io_t *io = avr->io_port; io; io = io->next) {
        if (!strcmp(io->kind, "uart")) {
            chip->uart = (avr_uart_t *)io;
        }
    }
    uint32_t flags = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    chip->channel[0] = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), 2);
    chip->channel[1] = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), 3);
    chip->trigger = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('C'), 0);
    chip->phase = FIRST_PHASE;
    chip->tick_period = FREQUENCY / tick_hz;
    chip->byte_cycles = 10 * bit_cycles;
    avr_register_io_write(avr, ICR1_LOW, write_period, chip);
    avr_register_io_write(avr, ICR1_HIGH, write_period, chip);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), byte_sent, chip);
    avr_irq_register_notify(avr_get_interrupt_irq(avr, TICK_VECTOR) + AVR_INT_IRQ_RUNNING, tick_changed, chip);
    return chip;
}

void chip_free(struct chip *chip)
{
    if (chip) {
        avr_terminate(chip->avr);
        free(chip->avr);
        free(chip);
    }
}

/* Halt at main(), as a debugger does, write a number of 32 bits into the memory, and go on to the first tick. */
int chip_start(struct chip *chip, uint32_t main_address, uint16_t data_address, int32_t number)
{
    avr_t *avr = chip->avr;
    for (uint32_t steps = 0; avr->pc != main_address; ++steps) {
        if (steps > FREQUENCY / 10 || avr_run(avr) == cpu_Crashed) {
            return -2;
        }
    }
    memcpy(avr->data + data_address, &number, sizeof number);
    avr->run_cycle_limit = chip->tick_period; /* run to the next cycle timer in one go */
    return run_slice(chip);
}

/* Run to the next tick. The shaft goes from `from` to `to`, in counts of the encoder, beginning at a speed with which
   it would go by `straight`; the encoder counts `edges` on the way, below 0 backwards. `bytes` arrive in this tick, and
   the trigger falls at each of `triggers`, shares (0..1) of the tick. Return as `run_slice`, or -3 for too many
   events. */
int chip_tick(struct chip *chip, double from, double straight, double to, int32_t edges, const uint8_t *bytes,
              uint32_t byte_count, const double *triggers, uint32_t trigger_count)
{
    avr_t *avr = chip->avr;
    const avr_cycle_count_t after_tick = chip->tick_entry + AFTER_TICK, next_tick = chip->tick_entry + chip->tick_period;
    const avr_cycle_count_t earliest = chip->is_unguarded ? after_tick : after_tick + GUARD;
    const avr_cycle_count_t start = avr->cycle + 1 > earliest ? avr->cycle + 1 : earliest;
    const avr_cycle_count_t end = chip->is_unguarded ? next_tick + AFTER_TICK : next_tick - GUARD;
    const double room = end > start ? (double)(end - start) : 0.0;
    double last_share = 0.0;
    int failed = 0;
    /* Without the guard the tick may have come before the last edge. */
    chip->event_count -= chip->first_event;
    memmove(chip->events, chip->events + chip->first_event, (size_t)chip->event_count * sizeof *chip->events);
    chip->first_event = 0;
    for (int32_t n = 0, all = edges < 0 ? -edges : edges; n < all; ++n) {
        const double level = edges > 0 ? floor(from) + 1.0 + n : floor(from) - n;
        double share = share_of(level - from, straight, to - from);
        share = share > last_share ? share : last_share;
        last_share = share = share < 1.0 ? share : 1.0;
        failed |= add_event(chip, start + (avr_cycle_count_t)(share * room), edges > 0 ? EDGE_FORWARD : EDGE_BACKWARD, 0);
    }
    for (uint32_t n = 0; n < byte_count; ++n) {
        failed |= add_event(chip, start + (avr_cycle_count_t)(room * (n + 1) / (byte_count + 1)), BYTE, bytes[n]);
    }
    for (uint32_t n = 0; n < trigger_count; ++n) {
        failed |= add_event(chip, start + (avr_cycle_count_t)(triggers[n] * room), TRIGGER_DOWN, 0);
    }
    if (failed) {
        return -3;
    }
    if (chip->event_count) {
        const avr_cycle_count_t first = chip->events[0].when;
        avr_cycle_timer_register(avr, first > avr->cycle ? first - avr->cycle : 1, next_event, chip);
    }
    return run_slice(chip);
}

/* Let events come at any cycle, also while a tick is sampled: then its count is right to one edge. */
void chip_unguard(struct chip *chip)
{
    chip->is_unguarded = 1;
}

/* Run up to `most` ticks in which nothing comes from outside, until a duty is on the bridge; return how many. */
int chip_idle(struct chip *chip, uint32_t most)
{
    uint32_t ticks = 0;
    while (ticks < most) {
        const int failure = run_slice(chip);
        if (failure) {
            return failure;
        }
        ++ticks;
        if (chip->duty || chip->sent_count > MOST_SENT / 2) {
            break;
        }
    }
    return (int)ticks;
}

/* Let the tick that has begun come to its end, and the lines that it released be answered, so that the memory shows
   both: run until the controller sleeps, but leave room for what comes before the next tick. */
void chip_settle(struct chip *chip)
{
    const avr_cycle_count_t limit = chip->tick_entry + chip->tick_period * 3 / 4;
    avr_cycle_timer_register(chip->avr, BEAT, beat, chip);
    while (chip->avr->cycle < limit && chip->avr->state == cpu_Running) {
        avr_run(chip->avr);
    }
    avr_cycle_timer_cancel(chip->avr, beat, chip);
}

/* Put an edge on the trigger now. */
void chip_trigger(struct chip *chip)
{
    const avr_cycle_count_t end = chip->avr->cycle + GUARD;
    pull_trigger(chip);
    avr_cycle_timer_register(chip->avr, GUARD, end_of_slice, chip);
    while (chip->avr->cycle < end) {
        avr_run(chip->avr);
    }
}

void chip_read(const struct chip *chip, uint16_t address, uint8_t *data, uint16_t size)
{
    memcpy(data, chip->avr->data + address, size);
}
