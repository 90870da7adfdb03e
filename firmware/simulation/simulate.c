/* The firmware in simavr, with a simulated motor on its pins and its serial port on a pseudo terminal.

   simulate motor.elf [name=number ...] [log=FILE]

   Names are those of `settings` below. It prints the terminal's path, and runs until it gets SIGTERM; SIGUSR1 resets the
   chip, SIGUSR2 makes it hang. The log has a row for each millisecond: time [s], voltage [V], speed [rad/s], angle
   [rad]. Its clock runs `pace` times as fast as the machine's, or slower where the machine is busy: it never catches up.
   The chip, the motor and the log depend on its clock only. */

#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <pty.h>
#include <signal.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "motor.h"

#define STEP 320                     /* cycles between steps of the motor: 20 us, less than between two edges */
#define TICK (CLOCK / 1000)          /* cycles between rows of the log */
#define BYTE (CLOCK / 11520)         /* cycles of a byte on the line, at 115200 baud */
#define CYCLES_PER_PULSE_TICK 8      /* of timer 1 */
#define PULSE_LOST (CLOCK / 10)      /* cycles without a pulse after which the speed controller gives no voltage */
#define LATE 10000000L               /* of the pace, after which the clock goes on from where it is [ns] */
#define OCR1AL 0x88                  /* address of the register with the width of the pulse */
#define STUCK 0xCFFF                 /* instruction: a jump to itself */

static struct motor motor = {.inertia = 1e-3};
static double supply = 7.4, counts = 2248.86, pace = 1.0;
static const struct {
    const char *name;
    double *value;
} settings[] = {
    {"constant", &motor.constant}, {"resistance", &motor.resistance}, {"friction", &motor.friction},
    {"efficiency", &motor.efficiency}, {"friction_speed", &motor.friction_speed}, {"inertia", &motor.inertia},
    {"drag", &motor.drag}, {"cogging", &motor.cogging}, {"teeth", &motor.teeth},
    {"supply", &supply}, /* [V] */
    {"counts", &counts}, /* of the encoder, per turn */
    {"pace", &pace},
};

static avr_t *avr;
static struct shaft shaft;
static double volts;
static avr_cycle_count_t pulsed; /* when the last pulse began */
static long count;               /* edges of the encoder */
static int terminal;
static FILE *log_file;
static void (*own_reset)(avr_t *);
static bool restarted;
static volatile sig_atomic_t stop, reset, hang; /* asked for by signals */

static void signalled(int number) { *(number == SIGUSR1 ? &reset : number == SIGUSR2 ? &hang : &stop) = 1; }

static void chip_reset(avr_t *chip) { /* by a signal, or by the watchdog of the chip */
    own_reset(chip);
    restarted = true;
}

static void nap(avr_t *chip, avr_cycle_count_t cycles) { /* the pace is kept elsewhere */
    (void)chip, (void)cycles;
}

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

static void sent(avr_irq_t *irq, uint32_t byte, void *unused) {
    (void)irq, (void)unused;
    char one = byte;
    if (write(terminal, &one, 1) < 0 && errno != EAGAIN)
        stop = 1;
}

static avr_cycle_count_t listen(avr_t *chip, avr_cycle_count_t when, void *irq) {
    unsigned char byte;
    (void)chip;
    if (read(terminal, &byte, 1) == 1)
        avr_raise_irq(irq, byte);
    return when + BYTE;
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

static avr_cycle_count_t tick(avr_t *chip, avr_cycle_count_t when, void *unused) {
    static long milliseconds; /* a reset begins the chip's cycles anew, not these */
    static struct timespec next;
    struct timespec now;
    (void)chip, (void)unused;
    if (log_file)
        fprintf(log_file, "%.3f,%.6g,%.9g,%.9g\n", ++milliseconds / 1e3, volts, shaft.speed, shaft.angle);
    next.tv_nsec += (long)(1e6 / pace);
    next.tv_sec += next.tv_nsec / 1000000000L;
    next.tv_nsec %= 1000000000L;
    clock_gettime(CLOCK_MONOTONIC, &now);
    if ((now.tv_sec - next.tv_sec) * 1000000000.0 + (now.tv_nsec - next.tv_nsec) > LATE)
        next = now;
    else
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, NULL);
    return when + TICK;
}

static void set(const char *argument) {
    const char *equals = strchr(argument, '=');
    size_t length = equals ? (size_t)(equals - argument) : 0;
    if (length == 3 && !strncmp(argument, "log", 3)) {
        log_file = fopen(equals + 1, "w");
        if (!log_file) {
            perror(equals + 1);
            exit(2);
        }
        setvbuf(log_file, NULL, _IOLBF, 0);
        return;
    }
    for (size_t k = 0; k < sizeof settings / sizeof *settings; k++)
        if (length == strlen(settings[k].name) && !strncmp(argument, settings[k].name, length)) {
            *settings[k].value = atof(equals + 1);
            return;
        }
    fprintf(stderr, "%s is no setting of the simulation.\n", argument);
    exit(2);
}

static int pseudo_terminal(void) {
    int end, other; /* the other end stays open: a host may come and go */
    struct termios raw;
    if (openpty(&end, &other, NULL, NULL, NULL) || tcgetattr(other, &raw)) {
        perror("pseudo terminal");
        exit(2);
    }
    cfmakeraw(&raw);
    tcsetattr(other, TCSANOW, &raw);
    fcntl(end, F_SETFL, O_NONBLOCK);
    puts(ttyname(other));
    fflush(stdout);
    return end;
}

static avr_t *chip_with(const char *path) {
    elf_firmware_t firmware = {.frequency = CLOCK};
    avr_t *chip = avr_make_mcu_by_name("atmega328p");
    if (!chip || elf_read_firmware(path, &firmware)) {
        fprintf(stderr, "%s is no firmware for an ATmega328P.\n", path);
        exit(2);
    }
    avr_init(chip);
    chip->log = 0;
    own_reset = chip->reset;
    chip->reset = chip_reset;
    avr_load_firmware(chip, &firmware);
    chip->frequency = CLOCK;
    chip->sleep = nap;
    return chip;
}

/* The timers of the simulation, which a reset of the chip has cleared. */
static void begin(void) {
    static avr_irq_t *channels[2];
    avr_irq_t *line = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    for (int k = 0; k < 2; k++)
        channels[k] = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), 2 + k);
    avr_cycle_timer_register(avr, BYTE, listen, line);
    avr_cycle_timer_register(avr, STEP, turn, channels);
    avr_cycle_timer_register(avr, TICK, tick, NULL);
    pulsed = avr->cycle;
}

static void run(void) {
    uint32_t stuck_at = 0;
    uint16_t kept = 0;
    int state = cpu_Running;
    while (!stop && state != cpu_Done && state != cpu_Crashed) {
        if (reset) {
            reset = 0;
            avr_reset(avr);
        }
        if (hang) {
            hang = 0;
            stuck_at = avr->pc;
            memcpy(&kept, avr->flash + stuck_at, sizeof kept);
            memcpy(avr->flash + stuck_at, &(uint16_t){STUCK}, sizeof kept);
        }
        state = avr_run(avr);
        if (restarted) {
            restarted = false;
            if (kept)
                memcpy(avr->flash + stuck_at, &kept, sizeof kept);
            begin();
        }
    }
}

int main(int number, char **arguments) {
    if (number < 2) {
        fprintf(stderr, "simulate motor.elf [name=number ...] [log=FILE]\n");
        return 2;
    }
    for (int k = 2; k < number; k++)
        set(arguments[k]);
    for (const int *one = (const int[]){SIGTERM, SIGINT, SIGUSR1, SIGUSR2, 0}; *one; one++)
        signal(*one, signalled);
    avr = chip_with(arguments[1]);
    terminal = pseudo_terminal();
    uint32_t flags = 0; /* nothing of the line on the screen */
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('B'), 1), pulse, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), sent, NULL);
    begin();
    run();
    return 0;
}
