/* A load cell and a servo: each reading of an HX711 is a line "milliseconds,counts", and "A120.0" is an angle [deg]. */

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>
#include <stdbool.h>
#include <stdlib.h>
#include <util/atomic.h>

#include "../serial.h"
#include "hx711.h"
#include "servo.h"
#include "settings.h"

#define HANG WDTO_120MS  /* without a round of the loop for so long the chip resets itself */
#define LONGEST 12       /* line of a command */
#define LONGEST_WORD 12  /* number with its sign and its end */

static volatile uint32_t milliseconds; /* since the reset */
static uint32_t heard;                 /* time of the last command [ms] */
static bool moved;                     /* whether the servo may be elsewhere than at rest */

ISR(TIMER0_COMPA_vect) { milliseconds++; }

static void clock_begin(void) {
    OCR0A = F_CPU / 64 / 1000 - 1;
    TCCR0A = 1 << WGM01; /* from 0 to OCR0A */
    TCCR0B = 1 << CS01 | 1 << CS00; /* a tick each 64 cycles */
    TIMSK0 = 1 << OCIE0A;
}

static uint32_t now(void) {
    uint32_t time;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { time = milliseconds; }
    return time;
}

static void say(const char *text) {
    while (*text)
        serial_put(*text++);
}

static void tell(uint32_t time, int32_t counts) {
    char word[LONGEST_WORD];
    say(ultoa(time, word, 10));
    say(",");
    say(ltoa(counts, word, 10));
    say("\r\n");
}

static void obey(const char *text) { /* what is no angle is not obeyed */
    char *end;
    if (text[0] != 'A')
        return;
    float angle = strtod(text + 1, &end);
    if (end == text + 1 || *end || !(angle >= 0.0f && angle <= MOST_ANGLE))
        return;
    servo_set(angle);
    heard = now();
    moved = true;
}

static void listen(char byte) {
    static char text[LONGEST + 1];
    static uint8_t length;
    if (byte == '\r')
        return;
    if (byte != '\n') {
        if (length <= LONGEST)
            text[length++] = byte;
        return;
    }
    if (length <= LONGEST) { /* else it is too long for a command */
        text[length] = 0;
        obey(text);
    }
    length = 0;
}

/* After a reset of its own the chip's watchdog still runs, with its shortest time. */
__attribute__((naked, used, section(".init3"))) static void calm(void) {
    MCUSR = 0;
    wdt_disable();
}

int main(void) {
    hx711_begin();
    servo_begin();
    serial_begin();
    clock_begin();
    wdt_enable(HANG);
    sei();
    say("milliseconds,counts of an HX711; A0 to A180 for the servo\r\n");
    for (;;) {
        wdt_reset();
        if (hx711_ready()) {
            uint32_t time = now();
            tell(time, hx711_read());
        }
        if (serial_waiting())
            listen(serial_get());
        if (moved && now() - heard >= (uint32_t)(WATCHDOG * 1000.0f)) {
            servo_set(REST);
            moved = false;
        }
    }
}
