/* Timer 1: pulses for the speed controller on OC1A (pin 9), the clock, and the time of each sample. */
#ifndef PULSE_H
#define PULSE_H

#include <stdint.h>

/* Neutral pulses, and samples. */
void pulse_begin(void);

/* Share of the voltage, -1 to 1, from the next pulse on. */
void pulse_set(float share);

/* Time since the start, in ticks; with interrupts off. */
uint32_t pulse_ticks(void);

#endif
