#include "line.h"

#include <stdlib.h>
#include <string.h>
#include <util/crc16.h>

#include "serial.h"
#include "settings.h"

#define LONGEST 40    /* line of a question */
#define DIGITS 4      /* of a checksum, hexadecimal; of a number after its point */
#define LONGEST_WORD 16

static const char HEXADECIMAL[] = "0123456789ABCDEF";

static uint16_t checksum; /* CRC-16/XMODEM of the answer so far */

static bool whole(char *text) { /* whether its checksum is right; cuts it off */
    char *star = strrchr(text, '*');
    if (!star || strlen(star + 1) != DIGITS)
        return false;
    uint16_t sum = 0, told = 0;
    for (const char *c = text; c < star; c++)
        sum = _crc_xmodem_update(sum, *c);
    for (const char *c = star + 1; *c; c++) {
        const char *digit = strchr(HEXADECIMAL, *c);
        if (!digit)
            return false;
        told = told << 4 | (digit - HEXADECIMAL);
    }
    *star = 0;
    return sum == told;
}

static void read(const char *text, struct question *question) {
    char *end;
    question->version = strtol(text, &end, 10);
    question->number = strtol(end, &end, 10);
    while (*end == ' ')
        end++;
    question->letter = *end ? *end++ : 0;
    char *value = end;
    question->value = strtod(value, &end);
    question->valued = end != value && *end == 0;
}

enum heard line_take(char byte, struct question *question) {
    static char text[LONGEST + 1];
    static uint8_t length;
    if (byte != '\n') {
        if (length <= LONGEST)
            text[length++] = byte;
        return NOTHING;
    }
    uint8_t had = length;
    length = 0;
    if (!had)
        return NOTHING;
    if (had > LONGEST || memchr(text, 0, had))
        return DAMAGED;
    text[had] = 0;
    if (!whole(text))
        return DAMAGED;
    read(text, question);
    return QUESTION;
}

static void say(char byte) {
    checksum = _crc_xmodem_update(checksum, byte);
    serial_put(byte);
}

void line_word(const char *word) {
    say(' ');
    while (*word)
        say(*word++);
}

void line_whole(uint32_t value) {
    char word[LONGEST_WORD];
    line_word(ultoa(value, word, 10));
}

void line_float(float value) {
    char word[LONGEST_WORD];
    line_word(dtostrf(value, 0, DIGITS, word));
}

void line_begin(uint8_t number, char letter) {
    const char word[] = {letter, 0};
    checksum = 0;
    say('0' + PROTOCOL_VERSION);
    line_whole(number);
    line_word(word);
}

void line_end(void) {
    serial_put('*');
    for (int8_t shift = 12; shift >= 0; shift -= 4)
        serial_put(HEXADECIMAL[checksum >> shift & 15]);
    serial_put('\n');
}
