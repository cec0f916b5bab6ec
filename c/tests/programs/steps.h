/* The interface of a program that turns bytes into text, on a PC or on the emulated chip. The program is linked with
 * say.c, and with steps_here.c or steps_on_chip.c. */
#include "framelock.h"

/* Defined by the program: takes steps, which it may change. Returns whether it could start. */
bool take(uint8_t *steps, size_t length);

/* Write to the program's output. */
void say(char character);
void say_number(size_t number);
void say_bytes(const uint8_t *bytes, size_t length);
