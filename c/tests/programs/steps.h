/* A program that is run here or on the emulated chip: bytes in, text out. It is linked with say.c, and steps_here.c or
 * steps_on_chip.c. */
#include "framelock.h"

/* The program's: takes steps, which it may change. Returns whether it could start. */
bool take(uint8_t *steps, size_t length);

/* Where what is said goes. */
void say(char character);
void say_number(size_t number);
void say_bytes(const uint8_t *bytes, size_t length);
