/* The pulses of a servo, by timer 1 on OC1A (pin 9). */
#ifndef SERVO_H
#define SERVO_H

void servo_begin(void);

/* Angle [deg], 0 to 180, from the next pulse on. */
void servo_set(float angle);

#endif
