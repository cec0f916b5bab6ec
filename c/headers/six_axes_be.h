/* Frames of six_axes_be. Made by `framelock generate --frame six-axes-be --language c`, version 0.1.0; do not edit.
 * SPDX-License-Identifier: 0BSD
 * You may use, change and ship this file without conditions.
 *
 * This header needs only a C99 or C++17 compiler. It allocates no memory and does not recurse.
 *
 *   static six_axes_be_receiver receiver;
 *   six_axes_be_message message;
 *
 *   six_axes_be_init(&receiver);
 *   if (six_axes_be_push(&receiver, byte, &message)) { ... }     for each received byte
 *   six_axes_be_line_event(&receiver, SIX_AXES_BE_FRAMING_ERROR);     instead of a damaged byte
 *
 * The counters satisfy this equation at any time, modulo 2^32:
 * counters.bytes == counters.frame_bytes + the sum of counters.discarded + six_axes_be_pending(&receiver).
 *
 * Calls for one receiver must not interrupt each other. All functions are `static inline`. If several source files need
 * them, define SIX_AXES_BE_DEFINITIONS as 1 in one of these files, and as 0 in the others, before they include this header:
 * then there is one copy of the code. */
#ifndef SIX_AXES_BE_H
#define SIX_AXES_BE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifndef SIX_AXES_BE_DEFINITIONS
#define SIX_AXES_BE_FUNCTION static inline
#elif defined(__cplusplus)
#define SIX_AXES_BE_FUNCTION extern "C"
#else
#define SIX_AXES_BE_FUNCTION
#endif

/* The number of bytes in the longest frame. */
#define SIX_AXES_BE_LONGEST 16U

/* The outcome of a classification: a frame, incomplete, or the reason why bytes are discarded. */
typedef enum {
    SIX_AXES_BE_NO_SYNC, /* no frame begins with them */
    SIX_AXES_BE_BROKEN_SYNC, /* a later byte of the sync is wrong */
    SIX_AXES_BE_WRONG_TERMINATOR, /* the terminator or fixed bits are wrong */
    SIX_AXES_BE_LINE_EVENT, /* pending at a line event */
    SIX_AXES_BE_REASONS, /* the number of reasons */
    SIX_AXES_BE_FRAME = SIX_AXES_BE_REASONS, /* a frame */
    SIX_AXES_BE_INCOMPLETE /* more bytes are needed */
} six_axes_be_outcome;

/* An event on the line, which the UART or a timer notices. */
typedef enum {
    SIX_AXES_BE_FRAMING_ERROR,
    SIX_AXES_BE_PARITY_ERROR,
    SIX_AXES_BE_OVERRUN,
    SIX_AXES_BE_BREAK,
    SIX_AXES_BE_IDLE_LINE,
    SIX_AXES_BE_EVENTS /* the number of events */
} six_axes_be_event;

/* Counters. They wrap at 2^32. */
typedef struct {
    uint32_t bytes; /* received bytes */
    uint32_t frames; /* frames */
    uint32_t frame_bytes; /* bytes in frames */
    uint32_t resynchronisations; /* frames that follow discarded bytes */
    uint32_t discarded[SIX_AXES_BE_REASONS]; /* discarded bytes, by reason */
    uint32_t events[SIX_AXES_BE_EVENTS]; /* line events */
} six_axes_be_counters;

/* The values of a frame. */
typedef struct {
    /* At 2: u16be. */
    uint16_t axis[6];
} six_axes_be_message;

/* A receiver. Read `counters`; the other members are private. */
typedef struct {
    six_axes_be_counters counters;
    uint8_t held[SIX_AXES_BE_LONGEST]; /* the pending bytes */
    uint8_t count; /* the number of pending bytes */
    bool is_lost; /* bytes were discarded since the last frame */
} six_axes_be_receiver;

/* Starts a receiver. All counters are 0. */
SIX_AXES_BE_FUNCTION void six_axes_be_init(six_axes_be_receiver *receiver);

/* Returns the number of pending bytes, which may still become part of a frame. */
SIX_AXES_BE_FUNCTION uint32_t six_axes_be_pending(const six_axes_be_receiver *receiver);

/* Takes the next byte. If it completes a frame, returns true and writes the frame's values to `*message`. */
SIX_AXES_BE_FUNCTION bool six_axes_be_push(six_axes_be_receiver *receiver, uint8_t byte, six_axes_be_message *message);

/* Reports a line event. Discards the pending bytes, because the rest of their frame is lost. */
SIX_AXES_BE_FUNCTION void six_axes_be_line_event(six_axes_be_receiver *receiver, six_axes_be_event event);

/* Reads the values of a frame. */
SIX_AXES_BE_FUNCTION void six_axes_be_decode(const uint8_t *frame, uint8_t length, six_axes_be_message *message);

/* Writes a frame with these values. Returns its length, or 0 if `room` is too small or no frame has these values. */
SIX_AXES_BE_FUNCTION size_t six_axes_be_encode(const six_axes_be_message *message, uint8_t *frame, size_t room);

#if !defined(SIX_AXES_BE_DEFINITIONS) || SIX_AXES_BE_DEFINITIONS

/* Sets bytes to 0. */
static inline void six_axes_be_clear(void *object, size_t size)
{
    uint8_t *byte = (uint8_t *)object;

    while (size > 0U) {
        *byte = 0U;
        byte++;
        size--;
    }
}

/* Returns whether bytes are equal. */
static inline bool six_axes_be_same(const void *one, const void *other, size_t size)
{
    const uint8_t *byte = (const uint8_t *)one;
    const uint8_t *expected = (const uint8_t *)other;

    while (size > 0U) {
        if (*byte != *expected) {
            return false;
        }
        byte++;
        expected++;
        size--;
    }
    return true;
}

/* Reads a number of two bytes, big-endian. */
static inline uint16_t six_axes_be_be16(const uint8_t *bytes)
{
    return (uint16_t)(((unsigned)bytes[0] << 8U) | bytes[1]);
}

/* Writes a number of `count` bytes, big-endian, by setting those bits that are 1. */
static inline void six_axes_be_put_be(uint8_t *bytes, uint8_t count, uint32_t number)
{
    uint8_t i;

    for (i = count; i > 0U; i--) {
        bytes[i - 1U] = (uint8_t)(bytes[i - 1U] | (number & 0xFFU));
        number >>= 8U;
    }
}

/* Returns whether a frame can begin with this byte. */
static inline bool six_axes_be_starts(uint8_t byte)
{
    return byte == 0xFFU;
}

/* Classifies one byte or more. The first `seen` bytes must be incomplete; `seen` may be 0. If the bytes begin with a
 * frame, sets `*number` to its length. If they are incomplete, sets `*number` to the number of bytes needed to decide
 * more. */
static inline six_axes_be_outcome six_axes_be_classify(const uint8_t *bytes, uint8_t count, uint8_t seen, uint8_t *number)
{
    uint8_t length;

    (void)seen;
    /* The sync. */
    if (!six_axes_be_starts(bytes[0])) {
        return SIX_AXES_BE_NO_SYNC;
    }
    if ((count > 1U) && (bytes[1] != 0xFFU)) {
        return SIX_AXES_BE_BROKEN_SYNC;
    }
    if (count < 2U) {
        *number = (uint8_t)(count + 1U);
        return SIX_AXES_BE_INCOMPLETE;
    }
    length = 16U;
    if (count < length) {
        *number = length;
        return SIX_AXES_BE_INCOMPLETE;
    }
    /* The terminator. */
    if (!((bytes[length - 2U] == 0x0AU) && (bytes[length - 1U] == 0x0DU))) {
        return SIX_AXES_BE_WRONG_TERMINATOR;
    }
    *number = length;
    return SIX_AXES_BE_FRAME;
}

SIX_AXES_BE_FUNCTION void six_axes_be_decode(const uint8_t *frame, uint8_t length, six_axes_be_message *message)
{
    uint8_t i;

    (void)length;
    for (i = 0U; i < 6U; i++) {
        message->axis[i] = six_axes_be_be16(&frame[2U + 2U * i]);
    }
}

SIX_AXES_BE_FUNCTION size_t six_axes_be_encode(const six_axes_be_message *message, uint8_t *frame, size_t room)
{
    uint8_t i;
    const size_t size = 16U;
    uint8_t length;
    uint8_t number = 0U;
    six_axes_be_message again;

    length = (uint8_t)size;
    if (room < size) {
        return 0U;
    }
    six_axes_be_clear(frame, size);
    for (i = 0U; i < 6U; i++) {
        six_axes_be_put_be(&frame[2U + 2U * i], 2U, message->axis[i]);
    }
    frame[0] = 0xFFU;
    frame[1] = 0xFFU;
    frame[length - 2U] = 0x0AU;
    frame[length - 1U] = 0x0DU;
    /* Fail if a value is outside its field's range, or contradicts another part of the frame. */
    length = (uint8_t)size;
    if ((six_axes_be_classify(frame, length, 0U, &number) != SIX_AXES_BE_FRAME) || (number != length)) {
        return 0U;
    }
    six_axes_be_decode(frame, length, &again);
    if (!six_axes_be_same(&again.axis, &message->axis, sizeof again.axis)) {
        return 0U;
    }
    return size;
}

SIX_AXES_BE_FUNCTION void six_axes_be_init(six_axes_be_receiver *receiver)
{
    six_axes_be_clear(receiver, sizeof *receiver);
}

SIX_AXES_BE_FUNCTION uint32_t six_axes_be_pending(const six_axes_be_receiver *receiver)
{
    return receiver->count;
}

static inline void six_axes_be_count_discarded(six_axes_be_receiver *receiver, six_axes_be_outcome reason, uint8_t count)
{
    receiver->counters.discarded[reason] += count;
    receiver->is_lost = true;
}

static inline void six_axes_be_count_frame(six_axes_be_receiver *receiver, uint8_t length)
{
    receiver->counters.frames++;
    receiver->counters.frame_bytes += length;
    if (receiver->is_lost) {
        receiver->is_lost = false;
        receiver->counters.resynchronisations++;
    }
}

SIX_AXES_BE_FUNCTION bool six_axes_be_push(six_axes_be_receiver *receiver, uint8_t byte, six_axes_be_message *message)
{
    six_axes_be_outcome outcome = SIX_AXES_BE_INCOMPLETE;
    uint8_t number = 0U;
    uint8_t start = 0U;
    uint8_t i;

    receiver->counters.bytes++;
    receiver->held[receiver->count] = byte;
    receiver->count++;
    /* Discard bytes up to the first one that can begin a frame. */
    while (start < receiver->count) {
        outcome = six_axes_be_classify(&receiver->held[start], (uint8_t)(receiver->count - start), 0U, &number);
        if (outcome >= SIX_AXES_BE_FRAME) {
            break;
        }
        six_axes_be_count_discarded(receiver, outcome, 1U);
        start++;
    }
    if (outcome == SIX_AXES_BE_FRAME) {
        /* All frames have the same length, so this one is all of the pending bytes. */
        six_axes_be_decode(receiver->held, SIX_AXES_BE_LONGEST, message);
        six_axes_be_count_frame(receiver, SIX_AXES_BE_LONGEST);
        receiver->count = 0U;
        return true;
    }
    if (start > 0U) {
        /* Move the other bytes to the front. */
        receiver->count = (uint8_t)(receiver->count - start);
        for (i = 0U; i < receiver->count; i++) {
            receiver->held[i] = receiver->held[start + i];
        }
    }
    return false;
}

SIX_AXES_BE_FUNCTION void six_axes_be_line_event(six_axes_be_receiver *receiver, six_axes_be_event event)
{
    receiver->counters.events[event]++;
    if (receiver->count > 0U) {
        six_axes_be_count_discarded(receiver, SIX_AXES_BE_LINE_EVENT, receiver->count);
        receiver->count = 0U;
    }
}
#endif

#endif
