/* The serial line: a ring of bytes each way, and the cutting of bytes into lines. */
#ifndef LINE_H
#define LINE_H

#include <stdint.h>

#define LINE_LIMIT 32 /* bytes of the longest line, without its CR */

enum refusal {
    REFUSED_UNKNOWN_COMMAND = 1,
    REFUSED_BAD_NUMBER,
    REFUSED_OUT_OF_RANGE,
    REFUSED_LINE_TOO_LONG,
    REFUSED_BAD_BYTE,
};

void line_init(void);

/* Let the main loop see what has come until now. Called by the tick's interrupt, so that a line takes effect at a tick,
   however its bytes were spread before it. */
void line_release(void);

/* Read what the tick has released, as long as there is room for a reply. */
void line_poll(void);

/* Queue bytes for the line; there is room for the longest reply. */
void line_write(const char *bytes, uint8_t length);

#endif
