#include "encoder.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <math.h>
#include <stdlib.h>

#include "pulse.h"
#include "settings.h"

#define ANGLE (2.0f * (float)M_PI / COUNTS_PER_TURN) /* of a count [rad] */
#define CHANNELS (PIND >> PIND2 & 3)                 /* A in bit 0, B in bit 1 */

static volatile struct encoder encoder;
static volatile uint8_t channels;

static void edge(void) {
    static const int8_t STEPS[16] = {0, 1, -1, 0, -1, 0, 0, 1, 1, 0, 0, -1, 0, -1, 1, 0}; /* by channels before, now */
    uint8_t now = CHANNELS;
    int8_t step = STEPS[channels << 2 | now];
    channels = now;
    if (step) {
        encoder.count += step;
        encoder.edge = pulse_ticks();
    }
}

ISR(INT0_vect) { edge(); }
ISR(INT1_vect) { edge(); }

void encoder_begin(void) {
    PORTD |= 1 << PORTD2 | 1 << PORTD3; /* pull-ups */
    channels = CHANNELS;
    EICRA = 1 << ISC00 | 1 << ISC10; /* any edge */
    EIMSK = 1 << INT0 | 1 << INT1;
}

struct encoder encoder_read(void) {
    struct encoder reading = {encoder.count, encoder.edge, pulse_ticks()};
    return reading;
}

float encoder_speed(const struct encoder *reading) {
    static struct encoder last;
    static float speed;
    int32_t counts = reading->count - last.count;
    uint32_t since = reading->now - last.edge;
    float bound;
    if (counts) {
        speed = ANGLE * counts * TICKS_PER_SECOND / (float)(reading->edge - last.edge);
        bound = ANGLE * (labs(counts) + 1) / SAMPLE_TIME;
        last.edge = reading->edge;
    } else if (speed == 0.0f || since > (uint32_t)(STANDSTILL * TICKS_PER_SECOND)) {
        bound = 0.0f;
        last.edge = reading->now; /* from where the next counts have begun at the earliest */
    } else
        bound = ANGLE * TICKS_PER_SECOND / (float)since;
    last.count = reading->count;
    speed = fminf(fmaxf(speed, -bound), bound);
    return speed;
}
