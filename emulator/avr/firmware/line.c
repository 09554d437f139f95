#include "line.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <stdbool.h>
#include <util/atomic.h>

#include "command.h"
#include "table_constants.h"

#define RECEIVE_LIMIT 64
#define RECEIVE_SIZE 128  /* a power of two, with room for the marker */
#define TRANSMIT_SIZE 64  /* a power of two */
#define TRANSMIT_LIMIT 63 /* with the byte in the transmitter 64 */
#define LONGEST_REPLY (LINE_LIMIT + 1)

#define CR 0x0D
#define LF 0x0A
#define LOST LF /* LF is ignored wherever it stands, so in the ring its code is free to mark lost bytes */

/* Interrupts advance `receive_head` and `transmit_tail`, the main loop the others; each is one byte. */
volatile uint8_t receive_head, receive_tail, transmit_head, transmit_tail;
volatile uint16_t lost_bytes;
static volatile uint8_t receive_ring[RECEIVE_SIZE], transmit_ring[TRANSMIT_SIZE];
static volatile uint8_t released_head;

static char line[LINE_LIMIT];
static uint8_t line_length;
static uint8_t line_fault; /* the first one, or 0 */

void line_init(void)
{
    UBRR0 = UART_DIVIDER;
    UCSR0A = UART_DOUBLE_SPEED ? _BV(U2X0) : 0;
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00); /* 8N1 */
    UCSR0B = _BV(RXCIE0) | _BV(RXEN0) | _BV(TXEN0);
}

static inline void put_received(uint8_t byte)
{
    receive_ring[receive_head % RECEIVE_SIZE] = byte;
    ++receive_head;
}

/* Mark that bytes are missing here, once for each gap. */
static inline void put_lost(void)
{
    ++lost_bytes;
    if (receive_head == receive_tail || receive_ring[(uint8_t)(receive_head - 1U) % RECEIVE_SIZE] != LOST) {
        put_received(LOST);
    }
}

ISR(USART_RX_vect)
{
    const uint8_t status = UCSR0A;
    const uint8_t byte = UDR0;
    if (status & _BV(DOR0)) { /* the hardware had no room for bytes before this one */
        put_lost();
    }
    if ((status & _BV(FE0)) || (uint8_t)(receive_head - receive_tail) >= RECEIVE_LIMIT) {
        put_lost();
    } else if (byte != LF) {
        put_received(byte);
    }
}

ISR(USART_UDRE_vect)
{
    UDR0 = transmit_ring[transmit_tail % TRANSMIT_SIZE];
    if (++transmit_tail == transmit_head) {
        UCSR0B &= (uint8_t)~_BV(UDRIE0);
    }
}

void line_release(void)
{
    released_head = receive_head;
}

static uint8_t transmit_room(void)
{
    return (uint8_t)(TRANSMIT_LIMIT - (uint8_t)(transmit_head - transmit_tail));
}

void line_write(const char *bytes, uint8_t length)
{
    while (length-- != 0) {
        transmit_ring[transmit_head % TRANSMIT_SIZE] = (uint8_t)*bytes++;
        ++transmit_head;
    }
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) /* the transmit interrupt changes the same register */
    {
        if (transmit_tail != transmit_head) { /* a fast line may have sent all of it during a tick */
            UCSR0B |= _BV(UDRIE0);
        }
    }
}

static bool is_blank(void)
{
    for (uint8_t i = 0; i < line_length; ++i) {
        if (line[i] != ' ') {
            return false;
        }
    }
    return true;
}

static void end_line(void)
{
    if (line_fault != 0) {
        command_refuse(line_fault);
    } else if (!is_blank()) {
        command_execute(line, line_length);
    }
    line_length = line_fault = 0;
}

static void take(uint8_t byte)
{
    if (byte == CR) {
        end_line();
    } else if (line_fault != 0) {
        return; /* of several faults the first one is answered */
    } else if (byte == LOST) {
        line_fault = REFUSED_BAD_BYTE;
    } else if (line_length == LINE_LIMIT) {
        line_fault = REFUSED_LINE_TOO_LONG;
    } else if (byte < ' ' || byte > '~') {
        line_fault = REFUSED_BAD_BYTE;
    } else {
        line[line_length++] = (char)byte;
    }
}

void line_poll(void)
{
    while (receive_tail != released_head && transmit_room() >= LONGEST_REPLY) {
        take(receive_ring[receive_tail % RECEIVE_SIZE]);
        ++receive_tail; /* only now: until then the line is seen to be busy */
    }
}
