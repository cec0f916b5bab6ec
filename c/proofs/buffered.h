/* Proofs about the parts of a receiver with a buffer that depend on the layout: classifying, decoding and encoding. The
 * proofs in engine.c cover the remaining part, the engine, for all layouts.
 *
 * The proofs show that a classification of up to MOST arbitrary bytes reads only these bytes, does not overflow, and
 * returns only answers that the engine allows.
 *
 * The file of a layout includes the header, defines the following macros, and includes this file:
 *
 *   NAME, UPPER    the prefixes of the header's names
 *   RUST_REASONS   see counters.h
 *   MOST           the greatest number of bytes to classify
 *   TURNS          more iterations than any loop performs for these bytes
 *
 *   IS_SILENT      defined if silence ends the frames
 *
 * If the file also defines the following macros, there is a proof about the header's `encode`:
 *
 *   POINT          statements that point the message's pointers to at most PAYLOAD bytes
 *   SPACE          the largest room for a frame, in bytes
 *   ENCODE_TURNS   more iterations than any loop in `encode` performs */
#include "proof.h"

#define PAYLOAD 2U

/* The type of indexes and lengths in the engine's functions. */
#define INDEX __typeof__(((X(receiver) *)NULL)->from)
/* For POINT: points a pointer of the message to at most PAYLOAD bytes. */
#define POINT_TO(bytes) message.bytes = payload; ASSUME(message.bytes##_length <= PAYLOAD);

PROOF(classify, TURNS)
{
    uint8_t bytes[MOST];
    const INDEX count = (INDEX)nondet_uint16();
    const INDEX seen = (INDEX)nondet_uint16();
    INDEX number = 0U;

    ASSUME((count >= 1U) && (count <= MOST) && (seen < count));
#ifdef KNOWN
    __CPROVER_havoc_object(known); /* see avr/pgmspace.h */
#endif
    /* Place the bytes at the end of the array, so that reading past them is an error. */
    const uint8_t *const at = bytes + (MOST - count);
    const X(outcome) outcome = X(classify)(at, count, seen, &number);

    ASSERT(outcome <= XX(INCOMPLETE) && outcome != XX(LINE_EVENT));
    /* A frame has at most `count` bytes. An incomplete frame needs more than `count` bytes, but at most as many bytes
     * as the longest frame has. */
    ASSERT(outcome != XX(FRAME) || (number >= 1U && number <= count));
    ASSERT(outcome != XX(INCOMPLETE) || (number > count && number <= XX(LONGEST)));
    ASSERT(X(starts)(at[0]) == (outcome != XX(NO_SYNC)));
#ifndef IS_SILENT
    COVER(outcome == XX(INCOMPLETE) && number == count + 1U);
    COVER(outcome == XX(FRAME));
#endif

    const uint8_t event = nondet_uint8();

    ASSUME(event < XX(EVENTS));
    const X(outcome) before = X(classify_before)(at, count, (X(event))event, &number);

#ifdef IS_SILENT
    /* Only a pause or a break ends a frame, and the frame consists of all bytes. */
    ASSERT(before < XX(REASONS) ||
        (before == XX(FRAME) && number == count && (event == XX(IDLE_LINE) || event == XX(BREAK))));
    COVER(before == XX(FRAME));
#else
    ASSERT(before == XX(LINE_EVENT) || (before == XX(FRAME) && number >= 1U && number <= count));
#endif
}

#ifdef POINT
PROOF(encode, ENCODE_TURNS)
{
    uint8_t bytes[SPACE];
    uint8_t payload[PAYLOAD];
    INDEX number;
    X(message) message;
    const uint16_t room = nondet_uint16();

    POINT
    ASSUME(room <= SPACE);
    /* Place the room at the end of the array, so that writing past it is an error. */
    uint8_t *const frame = bytes + (SPACE - room);
    const size_t length = X(encode)(&message, frame, room);

    if (length > 0U) {
        ASSERT(length <= room);
#ifdef IS_SILENT
        ASSERT(X(classify_before)(frame, (INDEX)length, XX(IDLE_LINE), &number) == XX(FRAME) && number == length);
#else
        ASSERT(X(classify)(frame, (INDEX)length, 0U, &number) == XX(FRAME) && number == length);
#endif
        X(decode)(frame, number, &message);
    }
    COVER(length > 0U);
}
#endif

/* Functions for the harnesses in Rust. */

static uint8_t bytes[MOST];
static INDEX number;

void c_set(uint8_t place, uint8_t byte)
{
    bytes[place] = byte;
}

/* Returns 8 for a frame and 9 for incomplete bytes. For rejected bytes, returns the index of the reason in
 * RUST_REASONS. */
static uint8_t in_rust(X(outcome) outcome)
{
    static const X(outcome) reasons[] = RUST_REASONS;
    uint8_t i = 0U;

    if (outcome >= XX(FRAME)) {
        return (outcome == XX(FRAME)) ? 8U : 9U;
    }
    while (reasons[i] != outcome) {
        i++;
    }
    return i;
}

/* Classifies the first `count` bytes. */
uint8_t c_classify(uint8_t count, uint8_t seen)
{
    return in_rust(X(classify)(bytes, count, seen, &number));
}

/* Classifies the first `count` bytes, which the line event `event` follows. */
uint8_t c_classify_before(uint8_t count, uint8_t event)
{
    return in_rust(X(classify_before)(bytes, count, (X(event))event, &number));
}

uint16_t c_number(void)
{
    return number;
}

uint8_t c_begins(uint8_t byte)
{
    return X(starts)(byte);
}
