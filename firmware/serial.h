/* The serial port: bytes in and out, with buffers that interrupts empty and fill. */
#ifndef SERIAL_H
#define SERIAL_H

#include <stdbool.h>

void serial_begin(void);

/* Whether there is a byte. */
bool serial_waiting(void);

/* The next byte; there must be one. */
char serial_get(void);

/* Send; it waits where the buffer is full. */
void serial_put(char byte);

#endif
