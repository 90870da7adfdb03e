/* An ATmega328P in simavr: its clock at a pace, its serial port on a pseudo terminal, resets by signals, and a log.

   SIGUSR1 resets the chip, SIGUSR2 makes it hang, SIGTERM ends all. The chip's clock runs `pace` times as fast as the
   machine's, or slower where the machine is busy: it never catches up. */
#ifndef BOARD_H
#define BOARD_H

#include <simavr/sim_avr.h>
#include <stddef.h>
#include <stdio.h>

struct setting {
    const char *name;
    double *value;
};

extern avr_t *avr;

/* Set what stands in arguments as name=number, and the file of log=FILE; the pace is one of the names. */
void board_set(int number, char **arguments, const struct setting *settings, size_t count);

/* Load a firmware, and print the terminal's path. */
void board_load(const char *firmware);

/* Run until SIGTERM. `begin` makes timers and wires of what is on its pins, at the start and after each reset, which
   has cleared the timers; `row` writes what there is to know of it into the log, each millisecond. */
void board_run(void (*begin)(void), void (*row)(FILE *log));

#endif
