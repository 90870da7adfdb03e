/* The firmware in simavr, with a simulated motor on its pins and its serial port on a pseudo terminal (board.h).

   simulate motor.elf [name=number ...] [log=FILE]

   Names are those of `settings` below, and `pace`. It prints the terminal's path. The log has a row for each
   millisecond: time [s], voltage [V], speed [rad/s], angle [rad]. The motor and the log depend on the chip's clock
   only. */

#include <math.h>
#include <simavr/avr_ioport.h>
#include <stdio.h>

#include "board.h"
#include "motor.h"

#define STEP 320                     /* cycles between steps of the motor: 20 us, less than between two edges */
#define CYCLES_PER_PULSE_TICK 8      /* of timer 1 */
#define PULSE_LOST (CLOCK / 10)      /* cycles without a pulse after which the speed controller gives no voltage */
#define OCR1AL 0x88                  /* address of the register with the width of the pulse */

static struct motor motor = {.inertia = 1e-3};
static double supply = 7.4, counts = 2248.86;
static const struct setting settings[] = {
    {"constant", &motor.constant}, {"resistance", &motor.resistance}, {"friction", &motor.friction},
    {"efficiency", &motor.efficiency}, {"friction_speed", &motor.friction_speed}, {"inertia", &motor.inertia},
    {"drag", &motor.drag}, {"cogging", &motor.cogging}, {"teeth", &motor.teeth},
    {"supply", &supply}, /* [V] */
    {"counts", &counts}, /* of the encoder, per turn */
};

static struct shaft shaft;
static double volts;
static avr_cycle_count_t pulsed; /* when the last pulse began */
static long count;               /* edges of the encoder */

/* The timer holds a new width back until the next pulse begins; simavr does not. So it is read then. */
static void pulse(avr_irq_t *irq, uint32_t high, void *unused) {
    (void)irq, (void)unused;
    if (!high)
        return;
    double ticks = (avr->data[OCR1AL] | avr->data[OCR1AL + 1] << 8) + 1;
    double share = (ticks * CYCLES_PER_PULSE_TICK / CLOCK - 1.5e-3) / 0.5e-3;
    volts = supply * fmin(fmax(share, -1.0), 1.0);
    pulsed = avr->cycle;
}

/* Channels are 90 degrees apart, which are a count: A is high in half of each turn of four counts, B a count later. */
static void show_edges(avr_irq_t **channels) {
    long now = floor(shaft.angle * counts / (2.0 * M_PI));
    while (count != now) {
        count += count < now ? 1 : -1;
        avr_raise_irq(channels[0], (count + 1) >> 1 & 1);
        avr_raise_irq(channels[1], count >> 1 & 1);
    }
}

static avr_cycle_count_t turn(avr_t *chip, avr_cycle_count_t when, void *channels) {
    if (chip->cycle - pulsed > PULSE_LOST)
        volts = 0.0;
    shaft = motor_turned(&motor, shaft, volts, (double)STEP / CLOCK);
    show_edges(channels);
    return when + STEP;
}

static void row(FILE *log) { fprintf(log, "%.6g,%.9g,%.9g\n", volts, shaft.speed, shaft.angle); }

static void begin(void) {
    static avr_irq_t *channels[2];
    for (int k = 0; k < 2; k++)
        channels[k] = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), 2 + k);
    avr_cycle_timer_register(avr, STEP, turn, channels);
    pulsed = avr->cycle;
}

int main(int number, char **arguments) {
    if (number < 2) {
        fprintf(stderr, "simulate motor.elf [name=number ...] [log=FILE]\n");
        return 2;
    }
    board_set(number - 2, arguments + 2, settings, sizeof settings / sizeof *settings);
    board_load(arguments[1]);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('B'), 1), pulse, NULL);
    board_run(begin, row);
    return 0;
}
