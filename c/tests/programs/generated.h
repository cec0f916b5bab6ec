/* What generated headers make of streams: the values of each frame, and the frame of these values.
 * Behind it a test writes a function that says the fields of each, and main. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "framelock.h"

static uint8_t stream[1 << 20], made[1 << 17], buffer[1 << 18];
static size_t frames;

/* The next of the streams in the input, each behind its length. */
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

static inline void receive(const char *name, const framelock_layout *layouts, size_t count, size_t longest,
                           void (*found)(void *, const framelock_frame *))
{
    static framelock_layout_receiver receiver;
    static framelock_made_layout made_layouts[20];
    framelock_frame frame;
    framelock_counters counters;
    size_t length = next_stream();
    frames = 0;
    if (!framelock_layout_receiver_init(&receiver, layouts, made_layouts, count, buffer, 2 * longest)) {
        abort();
    }
    for (size_t i = 0; i < length; i++) {
        if (framelock_layout_receiver_push(&receiver, stream[i], &frame)) {
            found(NULL, &frame);
        }
    }
    framelock_layout_receiver_line_event(&receiver, FRAMELOCK_IDLE_LINE, found, NULL);
    if (!framelock_layout_receiver_counters(&receiver, &counters)) {
        abort();
    }
    printf("%s: %lu frames, %lu bytes discarded\n", name, (unsigned long)frames,
           (unsigned long)(counters.bytes - counters.frame_bytes));
}
