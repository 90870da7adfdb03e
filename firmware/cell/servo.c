#include "servo.h"

#include <avr/io.h>

#include "settings.h"

void servo_begin(void) {
    servo_set(REST);
    ICR1 = (uint16_t)(PERIOD * TICKS_PER_SECOND) - 1;
    TCCR1A = 1 << COM1A1 | 1 << WGM11; /* fast PWM up to ICR1, OC1A high until its match */
    TCCR1B = 1 << WGM13 | 1 << WGM12 | 1 << CS11; /* a tick each 8 cycles */
    DDRB |= 1 << DDB1;
}

void servo_set(float angle) { /* the timer holds a new width back until the next pulse; no interrupt uses timer 1 */
    float pulse = LEAST_PULSE + angle / MOST_ANGLE * (MOST_PULSE - LEAST_PULSE);
    OCR1A = (uint16_t)(pulse * TICKS_PER_SECOND + 0.5f) - 1;
}
