/* The commands of the protocol: H, L, P, R, S and A. */
#ifndef COMMAND_H
#define COMMAND_H

#include <stdint.h>

void command_init(void);

/* Carry out a line that is not blank, and answer it. */
void command_execute(const char *line, uint8_t length);

/* Answer a line that is not carried out; a table of strict Table 1 stays silent. */
void command_refuse(uint8_t reason);

#endif
