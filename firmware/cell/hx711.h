/* The converter of a load cell, an HX711: its data on PD4 (pin 4), its clock on PD5 (pin 5), channel A, gain 128. */
#ifndef HX711_H
#define HX711_H

#include <stdbool.h>
#include <stdint.h>

void hx711_begin(void);

/* Whether there is a new reading. */
bool hx711_ready(void);

/* The new reading, -8388608 to 8388607; an end of this range where it is saturated. */
int32_t hx711_read(void);

#endif
