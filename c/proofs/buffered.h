/* Proofs about what a layout adds to a receiver with a buffer: its classification, decoding and encoding. The rest is the
 * engine, which engine.c proves once for all layouts. A file includes this after the header. It defines NAME and UPPER,
 * RUST_REASONS, MOST, the number of bytes that are classified, and TURNS, which no loop reaches for these bytes. If the
 * header's `encode` is proved too, it defines POINT, which makes the pointers of a message point to at most PAYLOAD bytes,
 * SPACE, the number of bytes for a frame, and ENCODE_TURNS.
 *
 * For any bytes up to MOST: a classification reads only these bytes, overflows nothing, and tells the truth that the
 * engine relies on. */
#include "proof.h"

#define PAYLOAD 2U

/* The type that counts bytes. The engine's functions have it. */
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
    /* The bytes end with the array. */
    const uint8_t *const at = bytes + (MOST - count);
    const X(outcome) outcome = X(classify)(at, count, seen, &number);

    ASSERT(outcome <= XX(INCOMPLETE) && outcome != XX(LINE_EVENT));
    /* A frame lies in the bytes, or more bytes may complete one. */
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
    /* The room ends with the array. */
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

/* Classifies the first bytes. Returns the outcome: a reason, in the order of the Rust receiver's counters, 8 for a frame, or
 * 9 for incomplete bytes. */
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
