/* Reads the steps from standard input, and writes the program's output to standard output. */
#include <stdio.h>

#include "steps.h"

static uint8_t steps[1 << 22];

void say(char character)
{
    putchar(character);
}

int main(void)
{
    return take(steps, fread(steps, 1, sizeof steps, stdin)) ? 0 : 1;
}
