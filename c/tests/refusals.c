/* Checks that a refused call changes nothing, and that a line event counts the same frames with and without a callback.
 * receiver.h, which the test writes, includes the header, and defines the names that difference.c explains. Standard
 * input has bytes with frames. */
#include "receiver.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The bytes after the longest frame show whether a call writes too far. */
#define SIZE (2U * M(LONGEST) + 16U)

static F(receiver) receiver;
static F(receiver) receiver_before;
static F(message) message;
static F(message) message_before;
static uint8_t frame[SIZE];
static uint8_t frame_before[SIZE];
static unsigned long refusals[3]; /* of push, poll and encode */
static unsigned long ended; /* frames that a line event delivers */

static void demand(bool condition, const char *promise)
{
    if (!condition) {
        fprintf(stderr, "%s\n", promise);
        exit(1);
    }
}

static void remember(void)
{
    memcpy(&receiver_before, &receiver, sizeof receiver);
    memcpy(&message_before, &message, sizeof message);
    memcpy(frame_before, frame, sizeof frame);
}

static bool is_receiver_same(void)
{
    return memcmp(&receiver_before, &receiver, sizeof receiver) == 0;
}

static bool is_message_same(void)
{
    return memcmp(&message_before, &message, sizeof message) == 0;
}

/* Encodes the received message into too little room. */
static void encode_with_too_little_room(void)
{
    size_t length;
    size_t room;
#ifdef HAS_SIGNATURE
    /* Encode a signature, too. It follows a payload whose last zeros may be left out. */
    message.has_signature = true;
#endif
    length = F(encode)(&message, frame, sizeof frame);

    demand(length > 0U, "the values of a received frame can be encoded");
    /* For long frames, checking every room would take too long. */
    for (room = 0U; room < length; room += (length < 300U) ? 1U : 97U) {
        memset(frame, (int)(0xA5U ^ (room & 0xFFU)), sizeof frame);
        remember();
        demand(F(encode)(&message, frame, room) == 0U, "encode refuses a room that is too small");
#if !IS_PACKETS
        demand(memcmp(frame_before, frame, sizeof frame) == 0, "a refused encode writes nothing to the frame");
#endif
        demand(memcmp(&frame_before[room], &frame[room], sizeof frame - room) == 0, "encode writes only into the room");
        demand(is_message_same(), "a refused encode does not change the message");
        demand(is_receiver_same(), "a refused encode does not change the receiver");
        refusals[2]++;
    }
}

#if !IS_WINDOW
#if !IS_PACKETS
static void poll_until_it_finds_nothing(void)
{
    while (F(poll)(&receiver, &message)) {
    }
    remember();
    demand(!F(poll)(&receiver, &message), "poll finds nothing twice in a row");
    demand(is_receiver_same(), "a poll that can decide nothing does not change the receiver");
    demand(is_message_same(), "a poll that finds nothing does not change the message");
    refusals[1]++;
}
#endif

static void count(void *context, const F(message) *found)
{
    (void)context;
    (void)found;
    ended++;
}

/* Reports a line event to two copies of the receiver. Only the first call passes a callback for the frames. */
static void end_without_a_function(void)
{
    static F(receiver) with;
    static F(receiver) without;

    memcpy(&with, &receiver, sizeof receiver);
    memcpy(&without, &receiver, sizeof receiver);
    F(line_event)(&with, M(IDLE_LINE), count, NULL);
    F(line_event)(&without, M(IDLE_LINE), NULL, NULL);
    demand(memcmp(&with, &without, sizeof with) == 0, "without a function, a line event counts the same frames");
}
#endif

int main(void)
{
    int byte;

    F(init)(&receiver);
    memset(&message, 0x5A, sizeof message);
    for (byte = getchar(); byte != EOF; byte = getchar()) {
        remember();
        if (F(push)(&receiver, (uint8_t)byte, &message)) {
            if (receiver.counters.frames < 40U) {
                encode_with_too_little_room();
            }
        } else {
            demand(is_message_same(), "a push that finds no frame does not change the message");
            refusals[0]++;
        }
#if !IS_WINDOW
        if (receiver.counters.bytes % 7U == 0U) {
            end_without_a_function();
#if !IS_PACKETS
            poll_until_it_finds_nothing();
#endif
        }
#endif
    }
    printf("%lu %lu %lu %lu\n", refusals[0], refusals[1], refusals[2], ended);
    return 0;
}
