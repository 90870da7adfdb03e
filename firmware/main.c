/* Motor controller of a flagellum: a speed loop with variable gain, told over a serial line what to do. */

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "encoder.h"
#include "law.h"
#include "line.h"
#include "pulse.h"
#include "serial.h"
#include "settings.h"

#define HANG WDTO_120MS /* without a sample for so long the chip resets itself */

static const char ON[] = "on", OFF[] = "off", SILENT[] = "watchdog", RESET[] = "reset";

static struct law law = {.proportional = PROPORTIONAL, .integral = INTEGRAL, .boost = BOOST, .low = LOW_SPEED,
                         .most = MOST};
static const char *state = RESET; /* one of the four */
static float speed;               /* [rad/s] */
static float watchdog = WATCHDOG; /* [s] */
static uint32_t heard;            /* sample of the last question */
static uint16_t damaged;          /* lines since the reset */

static volatile bool due; /* a sample has been read that the law has not had */
static volatile uint32_t sample;
static struct encoder reading;

ISR(TIMER1_COMPB_vect) {
    reading = encoder_read();
    sample++;
    due = true;
}

static uint32_t samples(void) {
    cli();
    uint32_t now = sample;
    sei();
    return now;
}

static void vent(const char *why) {
    state = why;
    law_refer(&law, 0.0f);
    law.command = 0.0f;
    pulse_set(0.0f);
}

static void step(void) {
    cli();
    due = false;
    struct encoder now = reading;
    sei();
    speed = encoder_speed(&now);
    if (state != ON)
        return;
    if ((samples() - heard) * SAMPLE_TIME >= watchdog)
        vent(SILENT);
    else
        pulse_set(law_step(&law, speed, SAMPLE_TIME));
}

static void refuse(uint8_t number, const char *why) {
    line_begin(number, 'E');
    line_word(why);
    line_end();
}

static void tell(uint8_t number) {
    line_begin(number, 'V');
    line_whole(heard);
    line_float(speed);
    line_float(law.reference - speed);
    line_float(law.command);
    line_word(state);
    line_whole(damaged);
    line_end();
}

static void set(const struct question *q) {
    if (state == SILENT || state == RESET)
        refuse(q->number, state);
    else if (!q->valued || !(fabsf(q->value) <= MOST_SPEED))
        refuse(q->number, "value");
    else {
        law_refer(&law, q->value);
        if (state == OFF)
            law_start(&law, 0.0f, speed);
        state = ON;
        tell(q->number);
    }
}

static bool late(const struct question *q) { /* a radio link may deliver one after the next ones */
    static uint8_t last;
    static bool any;
    bool old = any && (uint8_t)(last - q->number - 1) < 127 && q->letter != 'H' && q->letter != '0';
    if (!old) {
        any = true;
        last = q->number;
    }
    return old;
}

static void answer(const struct question *q) {
    if (q->version != PROTOCOL_VERSION) {
        refuse(q->number, "version");
        return;
    }
    if (late(q)) {
        refuse(q->number, "old");
        return;
    }
    heard = samples();
    switch (q->letter) {
    case 'H':
        line_begin(q->number, 'H');
        line_float(SAMPLE_TIME);
        line_end();
        break;
    case '0':
        vent(OFF);
        line_begin(q->number, '0');
        line_end();
        break;
    case 'W':
        if (!q->valued || !(q->value >= LEAST_WATCHDOG && q->value <= MOST_WATCHDOG)) {
            refuse(q->number, "value");
            break;
        }
        watchdog = q->value;
        line_begin(q->number, 'W');
        line_float(watchdog);
        line_end();
        break;
    case 'S':
        set(q);
        break;
    case 'R':
        tell(q->number);
        break;
    default:
        refuse(q->number, "unknown");
    }
}

static void listen(void) {
    struct question question;
    switch (line_take(serial_get(), &question)) {
    case QUESTION:
        answer(&question);
        break;
    case DAMAGED:
        damaged++;
        refuse(0, "damaged");
        break;
    case NOTHING:
        break;
    }
}

/* After a reset of its own the chip's watchdog still runs, with its shortest time. */
__attribute__((naked, used, section(".init3"))) static void calm(void) {
    MCUSR = 0;
    wdt_disable();
}

int main(void) {
    pulse_begin();
    encoder_begin();
    serial_begin();
    vent(RESET);
    wdt_enable(HANG);
    set_sleep_mode(SLEEP_MODE_IDLE);
    sei();
    for (;;) {
        if (due) {
            wdt_reset();
            step();
        }
        if (serial_waiting())
            listen();
        cli();
        if (due || serial_waiting())
            sei();
        else { /* an interrupt between sei and sleep waits for sleep */
            sleep_enable();
            sei();
            sleep_cpu();
            sleep_disable();
        }
    }
}
