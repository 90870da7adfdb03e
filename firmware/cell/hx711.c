#include "hx711.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/delay.h>

#define DATA PIND4
#define TICK PORTD5
#define BITS 24

void hx711_begin(void) {
    PORTD &= ~(1 << TICK);
    DDRD |= 1 << TICK;
    PORTD |= 1 << DATA; /* pulled up: a converter that is not there is never ready */
}

bool hx711_ready(void) { return !(PIND & 1 << DATA); }

/* A pulse of the clock, and the bit that it shifts out. One that is longer than 60 us switches the converter off
   (HX711, 24-Bit Analog-to-Digital Converter for Weigh Scales, Avia Semiconductor): no interrupt comes within it. */
static uint8_t shifted(void) {
    cli();
    PORTD |= 1 << TICK;
    _delay_us(1);
    uint8_t bit = PIND >> DATA & 1;
    PORTD &= ~(1 << TICK);
    sei();
    _delay_us(1);
    return bit;
}

int32_t hx711_read(void) {
    uint32_t counts = 0;
    for (uint8_t k = 0; k < BITS; k++)
        counts = counts << 1 | shifted();
    shifted(); /* the next reading is of channel A, gain 128 */
    return (int32_t)(counts << 8) >> 8;
}
