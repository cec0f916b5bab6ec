/* Prints numbers, and bytes in hexadecimal. */
#include "steps.h"

void say_number(size_t number)
{
    if (number >= 10) {
        say_number(number / 10);
    }
    say((char)('0' + number % 10));
}

void say_bytes(const uint8_t *bytes, size_t length)
{
    for (size_t at = 0; at < length; at++) {
        say("0123456789ABCDEF"[bytes[at] >> 4]);
        say("0123456789ABCDEF"[bytes[at] & 15]);
    }
}
