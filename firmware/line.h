/* Lines of the protocol: "version number letter values*XXXX" and a line feed (docs/reference/serial-protocol.md). */
#ifndef LINE_H
#define LINE_H

#include <stdbool.h>
#include <stdint.h>

struct question {
    long version;
    uint8_t number; /* which its answer repeats */
    char letter;
    bool valued; /* whether there is a value */
    float value;
};

enum heard { NOTHING, DAMAGED, QUESTION };

/* Take one byte; at the end of a line the question in it, or that it is damaged. */
enum heard line_take(char byte, struct question *question);

/* Send an answer: its words, then the checksum. */
void line_begin(uint8_t number, char letter);
void line_word(const char *word);
void line_whole(uint32_t value);
void line_float(float value);
void line_end(void);

#endif
