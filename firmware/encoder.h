/* Quadrature encoder: channel A on INT0 (pin 2), B on INT1 (pin 3); A leads where the speed is positive. */
#ifndef ENCODER_H
#define ENCODER_H

#include <stdint.h>

struct encoder {
    int32_t count; /* edges */
    uint32_t edge; /* time of the last one, in ticks */
    uint32_t now;  /* in ticks */
};

void encoder_begin(void);

/* What it has counted, at this time; with interrupts off. */
struct encoder encoder_read(void);

/* Speed [rad/s] at a reading, from this one and the one before: counts over the time between their last edges.

   Without a new edge it is at most one count over the time since the last one. In any case the shaft has turned by less
   than one count more than were seen: an edge that trembles is no speed. */
float encoder_speed(const struct encoder *reading);

#endif
