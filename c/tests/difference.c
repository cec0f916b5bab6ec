/* Runs steps against a generated receiver. After each step, adds the frames, the counters and the number of pending
 * bytes to a digest. receiver.h, which the test writes, includes the header and defines:
 *
 *   F(name)            a function or type of the header
 *   M(name)            a constant of the header
 *   IS_WINDOW          whether the receiver has a window instead of a buffer
 *   IS_PACKETS         whether the receiver takes packets between delimiters
 *   HAS_KINDS          whether a message has a kind
 *   REASONS            for each reason of the Rust receiver: its index in the header, or -1
 *
 * The steps, as bytes:
 *
 *   0 byte             push the byte
 *   1 event            report a line event
 *   2                  poll until no frame is found */
#include "receiver.h"

static F(receiver) receiver;
static F(message) message;
static uint32_t frame_bytes; /* counters.frame_bytes before the next frame */
static uint32_t digest = 2166136261UL;

static void mix(uint32_t value)
{
    digest = (digest ^ value) * 16777619UL;
    digest ^= digest >> 15;
}

/* Mixes the frame that was just received into the digest. */
static void mix_frame(const F(message) *received)
{
#if IS_PACKETS
    const uint32_t length = receiver.length;
    const uint8_t *frame = receiver.buffer;
#elif IS_WINDOW
    const uint32_t length = receiver.counters.frame_bytes - frame_bytes;
    const uint8_t *frame = receiver.held;
#else
    const uint32_t length = receiver.counters.frame_bytes - frame_bytes;
    const uint8_t *frame = &receiver.buffer[receiver.from - length];
#endif
    uint32_t i;

    frame_bytes = receiver.counters.frame_bytes;
    mix(length);
    for (i = 0U; i < length; i++) {
        mix(frame[i]);
    }
#if HAS_KINDS
    mix((uint32_t)received->kind);
#else
    (void)received;
#endif
}

#if !IS_WINDOW
static void receive(void *context, const F(message) *received)
{
    (void)context;
    mix_frame(received);
}
#endif

/* Returns the counter with index `i`, in the order of `numbers` in difference.rs. */
static uint32_t counter(uint8_t i)
{
    const F(counters) *counters = &receiver.counters;

    switch (i) {
    case 0U:
        return counters->bytes;
    case 1U:
        return counters->frames;
    case 2U:
        return counters->frame_bytes;
    case 3U:
        return counters->resynchronisations;
    default:
        break;
    }
    if (i < 13U) {
        const int8_t reason = REASONS[i - 4U];

        return (reason < 0) ? 0U : counters->discarded[reason];
    }
    if (i < 18U) {
        return counters->events[i - 13U];
    }
    return F(pending)(&receiver);
}

/* Performs one step. `next` returns the next byte of the steps. */
static void step(uint8_t (*next)(void))
{
    uint8_t i;

    switch (next()) {
    case 0U:
        if (F(push)(&receiver, next(), &message)) {
            mix_frame(&message);
        }
        break;
#if IS_WINDOW
    case 1U:
        F(line_event)(&receiver, (F(event))next());
        break;
    default:
        break;
#else
    case 1U:
        F(line_event)(&receiver, (F(event))next(), receive, NULL);
        break;
    default:
#if !IS_PACKETS
        while (F(poll)(&receiver, &message)) {
            mix_frame(&message);
        }
#endif
        break;
#endif
    }
    for (i = 0U; i < 19U; i++) {
        mix(counter(i));
    }
}

#if defined(ON_CHIP)
#include "chip.h"

void run(void)
{
    uint8_t i;

    F(init)(&receiver);
    while (has_more()) {
        step(next_byte);
    }
    for (i = 0U; i < 19U; i++) {
        say(counter(i));
    }
    say(digest);
}
#else
/* On a PC, standard input has the steps. The program prints the digest after each step. */
#include <stdio.h>
#include <stdlib.h>

static uint8_t next_byte(void)
{
    const int byte = getchar();

    if (byte == EOF) {
        abort();
    }
    return (uint8_t)byte;
}

int main(void)
{
    int byte;

    F(init)(&receiver);
    for (byte = getchar(); byte != EOF; byte = getchar()) {
        (void)ungetc(byte, stdin);
        step(next_byte);
        printf("%08lx\n", (unsigned long)digest);
    }
    return 0;
}
#endif
