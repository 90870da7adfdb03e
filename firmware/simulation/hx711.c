#include "hx711.h"

#include <math.h>

#define BITS 24
#define LEAST -8388608.0
#define MOST 8388607.0
#define LONGEST 60e-6 /* of a pulse [s] */
#define READING 1e-3  /* after a pulse, in which a reading is shifted out [s] */

void hx711_convert(struct hx711 *chip, double counts, double time) {
    if (chip->pulses && chip->pulses <= BITS && time - chip->rose < READING) { /* this one is lost */
        chip->cut++;
        return;
    }
    long limited = lround(fmin(fmax(counts, LEAST), MOST));
    chip->shifting = (uint32_t)limited << 8;
    chip->pulses = 0;
    chip->data = false;
}

void hx711_clock(struct hx711 *chip, bool high, double time) {
    if (high == chip->clock)
        return;
    chip->clock = high;
    if (!high) {
        chip->off += time - chip->rose > LONGEST;
        return;
    }
    chip->rose = time;
    if (chip->pulses++ < BITS) {
        chip->data = chip->shifting >> 31;
        chip->shifting <<= 1;
    } else
        chip->data = true; /* until the next reading */
}
