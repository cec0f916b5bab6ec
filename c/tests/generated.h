/* Runs generated headers on streams. Prints the values of each frame, and the frame that encodes these values.
 * A test appends main and, for each header, a function that prints its fields. */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint8_t stream[1 << 20], made[1 << 17];
static size_t frames;

/* Reads the next stream from the input. Each stream begins with its length. */
static inline size_t next_stream(void)
{
    uint8_t head[4];
    size_t length;
    if (fread(head, 1, 4, stdin) != 4) {
        abort();
    }
    length = (size_t)head[0] | (size_t)head[1] << 8 | (size_t)head[2] << 16;
    if (length > sizeof stream || fread(stream, 1, length, stdin) != length) {
        abort();
    }
    return length;
}

static inline void say_float(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    printf(" %lu", (unsigned long)bits);
}

static inline void say_made(size_t length)
{
    if (length == 0) {
        printf("= none\n");
        return;
    }
    printf("= ");
    for (size_t i = 0; i < length; i++) {
        printf("%02X", made[i]);
    }
    printf("\n");
}
