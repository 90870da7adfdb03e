#include "pulse.h"

#include <avr/interrupt.h>
#include <avr/io.h>

#include "settings.h"

#define PERIOD ((uint16_t)(SAMPLE_TIME * TICKS_PER_SECOND))

static volatile uint32_t periods; /* ticks of all periods that are over */

ISR(TIMER1_OVF_vect) { periods += PERIOD; }

void pulse_begin(void) {
    pulse_set(0.0f);
    OCR1B = PERIOD - (uint16_t)(LEAD * TICKS_PER_SECOND);
    ICR1 = PERIOD - 1;
    TIMSK1 = 1 << TOIE1 | 1 << OCIE1B;
    TCCR1A = 1 << COM1A1 | 1 << WGM11; /* fast PWM up to ICR1, OC1A high until its match */
    TCCR1B = 1 << WGM13 | 1 << WGM12 | 1 << CS11; /* a tick each 8 cycles */
    DDRB |= 1 << DDB1;
}

void pulse_set(float share) { OCR1A = (uint16_t)((NEUTRAL_PULSE + share * PULSE_SPAN) * TICKS_PER_SECOND + 0.5f) - 1; }

uint32_t pulse_ticks(void) {
    uint16_t ticks = TCNT1;
    if (TIFR1 & 1 << TOV1) /* a period is over that is not counted yet */
        return periods + PERIOD + TCNT1;
    return periods + ticks;
}
