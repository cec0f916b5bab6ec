/* Proofs about the parts of a receiver with a buffer that depend on the layout: classifying, decoding and encoding. The
 * other part is the engine, which engine.c proves once for all layouts. The file of a layout includes the header,
 * defines the following macros, and includes this file. NAME and UPPER are the prefixes of the header's names.
 * RUST_REASONS is explained in window.h. MOST is the number of bytes to classify, and TURNS more than the iterations
 * that any loop makes for these bytes. To prove the header's `encode` too, the file defines POINT, which makes the
 * pointers of a message point to at most PAYLOAD bytes; SPACE, the number of bytes for a frame; and ENCODE_TURNS, the
 * bound on the loops.
 *
 * The proofs show for up to MOST arbitrary bytes: a classification reads only these bytes, does not overflow, and
 * returns only answers that the engine allows. */
#include "proof.h"

#define PAYLOAD 2U

/* The type of indexes and lengths in the engine's functions. */
#ifndef INDEX
#define INDEX uint16_t
#endif

PROOF(classify, TURNS)
{
    uint8_t bytes[MOST];
    const INDEX count = (INDEX)nondet_uint16();
    const INDEX seen = (INDEX)nondet_uint16();
    INDEX number = 0U;

    ASSUME((count >= 1U) && (count <= MOST) && (seen < count));
    /* Place the bytes at the end of the array, so that reading past them is an error. */
    const uint8_t *const at = bytes + (MOST - count);
    const X(outcome) outcome = X(classify)(at, count, seen, &number);

    ASSERT(outcome <= XX(INCOMPLETE) && outcome != XX(LINE_EVENT));
    /* A frame lies in the bytes, or more bytes are needed to complete one. */
    ASSERT(outcome != XX(FRAME) || (number >= 1U && number <= count));
    ASSERT(outcome != XX(INCOMPLETE) || (number > count && number <= XX(LONGEST)));
    ASSERT(X(starts)(at[0]) == (outcome != XX(NO_SYNC)));
    COVER(outcome == XX(INCOMPLETE) && number == count + 1U);
    COVER(outcome == XX(FRAME));
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
        ASSERT(X(classify)(frame, (INDEX)length, 0U, &number) == XX(FRAME) && number == length);
        X(decode)(frame, number, &message);
    }
    COVER(length > 0U);
}
#endif

/* The functions that harnesses in Rust call. */

#define NONE XX(REASONS)

static uint8_t bytes[MOST];
static INDEX number;

void c_set(uint8_t place, uint8_t byte)
{
    bytes[place] = byte;
}

/* Classifies the first `count` bytes. Returns 8 for a frame, 9 for incomplete bytes, and otherwise the number of the
 * reason, in the order of the Rust receiver's counters. */
uint8_t c_classify(uint8_t count, uint8_t seen)
{
    static const X(outcome) reasons[] = RUST_REASONS;
    const X(outcome) outcome = X(classify)(bytes, count, seen, &number);
    uint8_t i = 0U;

    if (outcome >= XX(FRAME)) {
        return (outcome == XX(FRAME)) ? 8U : 9U;
    }
    while (reasons[i] != outcome) {
        i++;
    }
    return i;
}

uint16_t c_number(void)
{
    return number;
}

uint8_t c_begins(uint8_t byte)
{
    return X(starts)(byte);
}
