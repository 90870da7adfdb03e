#define _GNU_SOURCE
#include "board.h"

#include <errno.h>
#include <fcntl.h>
#include <pty.h>
#include <signal.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_elf.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#define TICK (CLOCK / 1000)  /* cycles between rows of the log */
#define BYTE (CLOCK / 11520) /* cycles of a byte on the line, at 115200 baud */
#define LATE 10000000L       /* of the pace, after which the clock goes on from where it is [ns] */
#define STUCK 0xCFFF         /* instruction: a jump to itself */

avr_t *avr;
static double pace = 1.0;
static int terminal;
static FILE *log_file;
static void (*own_reset)(avr_t *);
static void (*write_row)(FILE *);
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

static avr_cycle_count_t tick(avr_t *chip, avr_cycle_count_t when, void *unused) {
    static long milliseconds; /* a reset begins the chip's cycles anew, not these */
    static struct timespec next;
    struct timespec now;
    (void)chip, (void)unused;
    milliseconds++;
    if (log_file) {
        fprintf(log_file, "%.3f,", milliseconds / 1e3);
        write_row(log_file);
    }
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

static void set(const char *argument, const struct setting *settings, size_t count) {
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
    if (length == 4 && !strncmp(argument, "pace", 4)) {
        pace = atof(equals + 1);
        return;
    }
    for (size_t k = 0; k < count; k++)
        if (length == strlen(settings[k].name) && !strncmp(argument, settings[k].name, length)) {
            *settings[k].value = atof(equals + 1);
            return;
        }
    fprintf(stderr, "%s is no setting of the simulation.\n", argument);
    exit(2);
}

void board_set(int number, char **arguments, const struct setting *settings, size_t count) {
    for (int k = 0; k < number; k++)
        set(arguments[k], settings, count);
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

void board_load(const char *firmware) {
    for (const int *one = (const int[]){SIGTERM, SIGINT, SIGUSR1, SIGUSR2, 0}; *one; one++)
        signal(*one, signalled);
    avr = chip_with(firmware);
    terminal = pseudo_terminal();
    uint32_t flags = 0; /* nothing of the line on the screen */
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), sent, NULL);
}

/* The timers of the simulation, which a reset of the chip has cleared. */
static void start(void (*begin)(void)) {
    avr_cycle_timer_register(avr, BYTE, listen, avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT));
    begin();
    avr_cycle_timer_register(avr, TICK, tick, NULL);
}

void board_run(void (*begin)(void), void (*row)(FILE *log)) {
    uint32_t stuck_at = 0;
    uint16_t kept = 0;
    int state = cpu_Running;
    write_row = row;
    start(begin);
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
            start(begin);
        }
    }
}
