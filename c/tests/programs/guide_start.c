/* Checks that a program of docs/c-library.md starts. */
#include "steps.h"

bool start(void);

bool take(uint8_t *steps, size_t length)
{
    const char *text = "it starts\n";
    (void)steps;
    (void)length;
    while (*text != 0) {
        say(*text++);
    }
    return start();
}
