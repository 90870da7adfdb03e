/* An HX711 by its data sheet: a reading is shifted out by pulses of its clock, and a long pulse switches it off. */
#ifndef SIMULATED_HX711_H
#define SIMULATED_HX711_H

#include <stdbool.h>
#include <stdint.h>

struct hx711 {
    uint32_t shifting; /* what is left of a reading, the next bit first */
    int pulses;        /* of the clock since the reading */
    double rose;       /* when the clock rose [s] */
    bool clock, data;  /* levels */
    long cut;          /* readings that came while one was shifted out */
    long off;          /* pulses that were too long */
};

/* A new reading of some counts at a time [s], limited to 24 bits. */
void hx711_convert(struct hx711 *chip, double counts, double time);

/* Another level of its clock at a time [s]. */
void hx711_clock(struct hx711 *chip, bool high, double time);

#endif
