#include "serial.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <stdint.h>

#include "settings.h"

#define BAUD_TOL 3 /* per cent; 115200 is 2.1 % off at 16 MHz, as on every Arduino */
#include <util/setbaud.h>

#define SIZE 128 /* of a buffer: more than the longest line; a power of 2 */

struct buffer {
    volatile uint8_t first, end;
    volatile char bytes[SIZE];
};

static struct buffer in, out;

static bool empty(const struct buffer *b) { return b->first == b->end; }

static bool full(const struct buffer *b) { return (uint8_t)(b->end + 1) % SIZE == b->first; }

static void put(struct buffer *b, char byte) {
    b->bytes[b->end] = byte;
    b->end = (b->end + 1) % SIZE;
}

static char get(struct buffer *b) {
    char byte = b->bytes[b->first];
    b->first = (b->first + 1) % SIZE;
    return byte;
}

ISR(USART_RX_vect) {
    char byte = UDR0;
    if (!full(&in)) /* else the line is damaged, which its checksum tells */
        put(&in, byte);
}

ISR(USART_UDRE_vect) {
    if (empty(&out))
        UCSR0B &= ~(1 << UDRIE0);
    else
        UDR0 = get(&out);
}

void serial_begin(void) {
    UBRR0 = UBRR_VALUE;
#if USE_2X
    UCSR0A = 1 << U2X0;
#endif
    UCSR0B = 1 << RXCIE0 | 1 << RXEN0 | 1 << TXEN0;
}

bool serial_waiting(void) { return !empty(&in); }

char serial_get(void) { return get(&in); }

void serial_put(char byte) {
    while (full(&out))
        ;
    put(&out, byte);
    UCSR0B |= 1 << UDRIE0;
}
