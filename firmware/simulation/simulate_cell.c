/* The firmware of the load cell in simavr: an HX711 on its pins, whose counts a servo's angle changes (board.h).

   simulate_cell cell.elf [name=number ...] [log=FILE]

   Names are those of `settings` below, and `pace`. It prints the terminal's path. The log has a row for each
   millisecond: time [s], width of the servo's last pulse [s], its angle [deg], readings that were lost while one was
   shifted out, and pulses of the clock that were too long. */

#include <simavr/avr_ioport.h>
#include <stdio.h>

#include "board.h"
#include "hx711.h"

#define CYCLES_PER_PULSE_TICK 8 /* of timer 1 */
#define OCR1AL 0x88             /* address of the register with the width of the pulse */

static double load = 81234.0, bend = 1000.0, rate = 80.0, least = 544e-6, most = 2400e-6;
static const struct setting settings[] = {
    {"load", &load},   /* counts at 90 deg */
    {"bend", &bend},   /* counts more per degree */
    {"rate", &rate},   /* of readings [Hz] */
    {"least", &least}, /* pulse at 0 deg [s] */
    {"most", &most},   /* pulse at 180 deg [s] */
};

static struct hx711 converter = {.data = true};
static avr_irq_t *data_pin;
static double width; /* of the last pulse [s] */

static double angle(void) { return (width - least) / (most - least) * 180.0; }

/* The timer holds a new width back until the next pulse begins; simavr does not. So it is read then. */
static void pulse(avr_irq_t *irq, uint32_t high, void *unused) {
    (void)irq, (void)unused;
    if (high)
        width = ((avr->data[OCR1AL] | avr->data[OCR1AL + 1] << 8) + 1.0) * CYCLES_PER_PULSE_TICK / CLOCK;
}

static void clocked(avr_irq_t *irq, uint32_t high, void *unused) {
    (void)irq, (void)unused;
    hx711_clock(&converter, high, (double)avr->cycle / CLOCK);
    avr_raise_irq(data_pin, converter.data);
}

static avr_cycle_count_t convert(avr_t *chip, avr_cycle_count_t when, void *unused) {
    (void)unused;
    hx711_convert(&converter, load + bend * (angle() - 90.0), (double)chip->cycle / CLOCK);
    avr_raise_irq(data_pin, converter.data);
    return when + (avr_cycle_count_t)(CLOCK / rate);
}

static void row(FILE *log) { fprintf(log, "%.9g,%.6g,%ld,%ld\n", width, angle(), converter.cut, converter.off); }

static void begin(void) {
    avr_cycle_timer_register(avr, (avr_cycle_count_t)(CLOCK / rate), convert, NULL);
    avr_raise_irq(data_pin, converter.data);
}

int main(int number, char **arguments) {
    if (number < 2) {
        fprintf(stderr, "simulate_cell cell.elf [name=number ...] [log=FILE]\n");
        return 2;
    }
    board_set(number - 2, arguments + 2, settings, sizeof settings / sizeof *settings);
    board_load(arguments[1]);
    data_pin = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), 4);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), 5), clocked, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('B'), 1), pulse, NULL);
    board_run(begin, row);
    return 0;
}
