/* Frames of ibus_any. Made by `framelock generate --frame ibus-any --language c`, version 0.1.0; do not edit.
 * SPDX-License-Identifier: 0BSD
 * You may use, change and ship this file without conditions.
 *
 * This header needs only a C99 or C++17 compiler. It allocates no memory and does not recurse.
 *
 *   static ibus_any_receiver receiver;
 *   ibus_any_message message;
 *
 *   ibus_any_init(&receiver);
 *   if (ibus_any_push(&receiver, byte, &message)) { ... }     for each received byte
 *   ibus_any_line_event(&receiver, IBUS_ANY_FRAMING_ERROR, received, NULL);     instead of a damaged byte
 *
 * The counters satisfy this equation at any time, modulo 2^32:
 * counters.bytes == counters.frame_bytes + the sum of counters.discarded + ibus_any_pending(&receiver).
 *
 * Calls for one receiver must not interrupt each other. All functions are `static inline`. If several source files need
 * them, define IBUS_ANY_DEFINITIONS as 1 in one of these files, and as 0 in the others, before they include this header:
 * then there is one copy of the code. */
#ifndef IBUS_ANY_H
#define IBUS_ANY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifndef IBUS_ANY_DEFINITIONS
#define IBUS_ANY_FUNCTION static inline
#elif defined(__cplusplus)
#define IBUS_ANY_FUNCTION extern "C"
#else
#define IBUS_ANY_FUNCTION
#endif

/* The number of bytes in the longest frame. */
#define IBUS_ANY_LONGEST 32U

/* The number of bytes in a receiver's buffer. With room for two longest frames, pending bytes are seldom moved. */
#ifndef IBUS_ANY_ROOM
#define IBUS_ANY_ROOM (2U * IBUS_ANY_LONGEST)
#endif
#if (IBUS_ANY_ROOM < IBUS_ANY_LONGEST) || (IBUS_ANY_ROOM > 223U)
#error "IBUS_ANY_ROOM must be between IBUS_ANY_LONGEST and 223"
#endif

/* The outcome of a classification: a frame, incomplete, or the reason why bytes are discarded. */
typedef enum {
    IBUS_ANY_NO_SYNC, /* no frame begins with them */
    IBUS_ANY_CHECKSUM_MISMATCH, /* the checksum is wrong */
    IBUS_ANY_LINE_EVENT, /* pending at a line event */
    IBUS_ANY_REASONS, /* the number of reasons */
    IBUS_ANY_FRAME = IBUS_ANY_REASONS, /* a frame */
    IBUS_ANY_INCOMPLETE /* more bytes are needed */
} ibus_any_outcome;

/* An event on the line, which the UART or a timer notices. */
typedef enum {
    IBUS_ANY_FRAMING_ERROR,
    IBUS_ANY_PARITY_ERROR,
    IBUS_ANY_OVERRUN,
    IBUS_ANY_BREAK,
    IBUS_ANY_IDLE_LINE,
    IBUS_ANY_EVENTS /* the number of events */
} ibus_any_event;

/* Counters. They wrap at 2^32. */
typedef struct {
    uint32_t bytes; /* received bytes */
    uint32_t frames; /* frames */
    uint32_t frame_bytes; /* bytes in frames */
    uint32_t resynchronisations; /* frames that follow discarded bytes */
    uint32_t discarded[IBUS_ANY_REASONS]; /* discarded bytes, by reason */
    uint32_t events[IBUS_ANY_EVENTS]; /* line events */
} ibus_any_counters;

/* The values of a frame. */
typedef struct {
    /* At 1: u8. */
    uint8_t command;
    /* At 2: u16le, mask 0xFFF. */
    uint16_t channel[14];
    /* At 2: u16le, mask 0xF000. */
    uint8_t upper[14];
} ibus_any_message;

/* A receiver. Read `counters`; the other members are private. */
typedef struct {
    ibus_any_counters counters;
    uint8_t from; /* the pending bytes are buffer[from] to buffer[to - 1] */
    uint8_t to;
    uint8_t ask_at; /* the next decision is possible when `to` reaches this index */
    bool is_lost; /* bytes were discarded since the last frame */
    uint8_t buffer[IBUS_ANY_ROOM];
} ibus_any_receiver;

/* Starts a receiver. All counters are 0. */
IBUS_ANY_FUNCTION void ibus_any_init(ibus_any_receiver *receiver);

/* Returns the number of pending bytes, which may still become part of a frame. */
IBUS_ANY_FUNCTION uint32_t ibus_any_pending(const ibus_any_receiver *receiver);

/* Takes the next byte. If a frame is complete, returns true and writes its values to `*message`. Classifies bytes at most
 * once. So after a false start a complete frame may stay pending, until the following calls catch up. */
IBUS_ANY_FUNCTION bool ibus_any_push(ibus_any_receiver *receiver, uint8_t byte, ibus_any_message *message);

/* Decides about pending bytes up to the next frame. If a frame is found, returns true and writes its values to
 * `*message`. If no byte follows soon, call this function until it returns false. */
IBUS_ANY_FUNCTION bool ibus_any_poll(ibus_any_receiver *receiver, ibus_any_message *message);

/* Reports a line event: no more bytes follow the pending bytes. Calls `received` with each frame among them, and
 * discards the other bytes. `received` may be NULL. */
IBUS_ANY_FUNCTION void ibus_any_line_event(ibus_any_receiver *receiver, ibus_any_event event,
    void (*received)(void *context, const ibus_any_message *message), void *context);

/* Reads the values of a frame. */
IBUS_ANY_FUNCTION void ibus_any_decode(const uint8_t *frame, uint8_t length, ibus_any_message *message);

/* Writes a frame with these values. Returns its length, or 0 if `room` is too small or no frame has these values. */
IBUS_ANY_FUNCTION size_t ibus_any_encode(const ibus_any_message *message, uint8_t *frame, size_t room);

#if !defined(IBUS_ANY_DEFINITIONS) || IBUS_ANY_DEFINITIONS

/* Sets bytes to 0. */
static inline void ibus_any_clear(void *object, size_t size)
{
    uint8_t *byte = (uint8_t *)object;

    while (size > 0U) {
        *byte = 0U;
        byte++;
        size--;
    }
}

/* Returns whether bytes are equal. */
static inline bool ibus_any_same(const void *one, const void *other, size_t size)
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

/* Reads a number of two bytes, little-endian. */
static inline uint16_t ibus_any_le16(const uint8_t *bytes)
{
    return (uint16_t)(((unsigned)bytes[1] << 8U) | bytes[0]);
}

/* Writes a number of `count` bytes, little-endian, by setting those bits that are 1. */
static inline void ibus_any_put_le(uint8_t *bytes, uint8_t count, uint32_t number)
{
    uint8_t i;

    for (i = 0U; i < count; i++) {
        bytes[i] = (uint8_t)(bytes[i] | (number & 0xFFU));
        number >>= 8U;
    }
}

/* Returns whether a frame can begin with this byte. */
static inline bool ibus_any_starts(uint8_t byte)
{
    return byte == 0x20U;
}

/* Returns the inverted sum of bytes. */
static inline uint16_t ibus_any_checksum(const uint8_t *bytes, uint8_t count)
{
    uint16_t sum = 0U;
    uint8_t i;

    for (i = 0U; i < count; i++) {
        const uint8_t byte = bytes[i];

        sum = (uint16_t)(sum + byte);
    }
    return (uint16_t)(~sum);
}

/* Classifies one byte or more. The first `seen` bytes must be incomplete; `seen` may be 0. If the bytes begin with a
 * frame, sets `*number` to its length. If they are incomplete, sets `*number` to the number of bytes needed to decide
 * more. */
static inline ibus_any_outcome ibus_any_classify(const uint8_t *bytes, uint8_t count, uint8_t seen, uint8_t *number)
{
    uint8_t length;

    (void)seen;
    /* The sync. */
    if (!ibus_any_starts(bytes[0])) {
        return IBUS_ANY_NO_SYNC;
    }
    length = 32U;
    if (count < length) {
        *number = length;
        return IBUS_ANY_INCOMPLETE;
    }
    /* The checksum. */
    if (ibus_any_checksum(&bytes[0U], (uint8_t)(length - 2U)) != ibus_any_le16(&bytes[length - 2U])) {
        return IBUS_ANY_CHECKSUM_MISMATCH;
    }
    *number = length;
    return IBUS_ANY_FRAME;
}

IBUS_ANY_FUNCTION void ibus_any_decode(const uint8_t *frame, uint8_t length, ibus_any_message *message)
{
    uint8_t i;

    (void)length;
    message->command = frame[1U];
    for (i = 0U; i < 14U; i++) {
        message->channel[i] = (uint16_t)((ibus_any_le16(&frame[2U + 2U * i]) & 0xFFFU));
    }
    for (i = 0U; i < 14U; i++) {
        message->upper[i] = (uint8_t)(((ibus_any_le16(&frame[2U + 2U * i]) & 0xF000U) >> 12U));
    }
}

IBUS_ANY_FUNCTION size_t ibus_any_encode(const ibus_any_message *message, uint8_t *frame, size_t room)
{
    uint8_t i;
    const size_t size = 32U;
    uint8_t length;
    uint8_t number = 0U;
    uint16_t sum;
    ibus_any_message again;

    length = (uint8_t)size;
    if (room < size) {
        return 0U;
    }
    ibus_any_clear(frame, size);
    frame[1U] = (uint8_t)(frame[1U] | message->command);
    for (i = 0U; i < 14U; i++) {
        ibus_any_put_le(&frame[2U + 2U * i], 2U, (message->channel[i] & 0xFFFU));
    }
    for (i = 0U; i < 14U; i++) {
        ibus_any_put_le(&frame[2U + 2U * i], 2U, (((uint32_t)message->upper[i] << 12U) & 0xF000U));
    }
    frame[0] = 0x20U;
    sum = ibus_any_checksum(&frame[0U], (uint8_t)(length - 2U));
    frame[length - 2U] = (uint8_t)sum;
    frame[length - 1U] = (uint8_t)(sum >> 8U);
    /* Fail if a value is outside its field's range, or contradicts another part of the frame. */
    length = (uint8_t)size;
    if ((ibus_any_classify(frame, length, 0U, &number) != IBUS_ANY_FRAME) || (number != length)) {
        return 0U;
    }
    ibus_any_decode(frame, length, &again);
    if (again.command != message->command) {
        return 0U;
    }
    if (!ibus_any_same(&again.channel, &message->channel, sizeof again.channel)) {
        return 0U;
    }
    if (!ibus_any_same(&again.upper, &message->upper, sizeof again.upper)) {
        return 0U;
    }
    return size;
}

IBUS_ANY_FUNCTION void ibus_any_init(ibus_any_receiver *receiver)
{
    ibus_any_clear(receiver, sizeof *receiver);
}

IBUS_ANY_FUNCTION uint32_t ibus_any_pending(const ibus_any_receiver *receiver)
{
    return (uint32_t)receiver->to - receiver->from;
}

static inline void ibus_any_count_discarded(ibus_any_receiver *receiver, ibus_any_outcome reason, uint8_t count)
{
    receiver->counters.discarded[reason] += count;
    receiver->is_lost = true;
}

static inline void ibus_any_count_frame(ibus_any_receiver *receiver, uint8_t length)
{
    receiver->counters.frames++;
    receiver->counters.frame_bytes += length;
    if (receiver->is_lost) {
        receiver->is_lost = false;
        receiver->counters.resynchronisations++;
    }
}

/* Forgets the pending bytes. */
static inline void ibus_any_forget(ibus_any_receiver *receiver)
{
    receiver->from = 0U;
    receiver->to = 0U;
    receiver->ask_at = 0U;
}

/* Decides about the first pending bytes. Classifies bytes at most once. If they are a frame, moves `from` past it and
 * returns its length, otherwise returns 0. Sets `*again` to false if the next decision needs more bytes. */
static inline uint8_t ibus_any_next(ibus_any_receiver *receiver, bool *again)
{
    ibus_any_outcome outcome;
    uint8_t number = 0U;
    uint8_t seen;
    const uint8_t start = receiver->from;

    *again = false;
    if (receiver->to < receiver->ask_at) {
        return 0U;
    }
    /* If the first byte has not been classified yet, skip bytes that cannot begin a frame. */
    if (receiver->ask_at <= (receiver->from + 1U)) {
        while ((receiver->from < receiver->to) && !ibus_any_starts(receiver->buffer[receiver->from])) {
            receiver->from++;
        }
        if (receiver->from > start) {
            ibus_any_count_discarded(receiver, IBUS_ANY_NO_SYNC, (uint8_t)(receiver->from - start));
            receiver->ask_at = 0U;
        }
    }
    if (receiver->from == receiver->to) {
        ibus_any_forget(receiver);
        return 0U;
    }
    seen = (receiver->ask_at > receiver->from) ? (uint8_t)(receiver->ask_at - (receiver->from + 1U)) : (uint8_t)0U;
    receiver->ask_at = 0U;
    outcome = ibus_any_classify(&receiver->buffer[receiver->from], (uint8_t)(receiver->to - receiver->from), seen, &number);
    if (outcome == IBUS_ANY_INCOMPLETE) {
        receiver->ask_at = (uint8_t)(receiver->from + number);
        return 0U;
    }
    *again = true;
    if (outcome == IBUS_ANY_FRAME) {
        receiver->from = (uint8_t)(receiver->from + number);
        ibus_any_count_frame(receiver, number);
        return number;
    }
    receiver->from++;
    ibus_any_count_discarded(receiver, outcome, 1U);
    return 0U;
}

/* Moves the pending bytes to the front of the buffer. */
static inline void ibus_any_move_to_front(ibus_any_receiver *receiver)
{
    const uint8_t from = receiver->from;
    uint8_t i;

    receiver->from = 0U;
    receiver->to = (uint8_t)(receiver->to - from);
    receiver->ask_at = (receiver->ask_at > from) ? (uint8_t)(receiver->ask_at - from) : (uint8_t)0U;
    for (i = 0U; i < receiver->to; i++) {
        receiver->buffer[i] = receiver->buffer[from + i];
    }
}

IBUS_ANY_FUNCTION bool ibus_any_push(ibus_any_receiver *receiver, uint8_t byte, ibus_any_message *message)
{
    uint8_t length;
    bool again;

    receiver->counters.bytes++;
    if (((receiver->to + 1U) < receiver->ask_at) && (receiver->to < IBUS_ANY_ROOM)) {
        /* No decision is possible yet: only store the byte. */
        receiver->buffer[receiver->to] = byte;
        receiver->to++;
        return false;
    }
    if (receiver->from == receiver->to) {
        ibus_any_forget(receiver);
        if (!ibus_any_starts(byte)) {
            ibus_any_count_discarded(receiver, IBUS_ANY_NO_SYNC, 1U);
            return false;
        }
    }
    if (receiver->to == IBUS_ANY_ROOM) {
        ibus_any_move_to_front(receiver);
    }
    receiver->buffer[receiver->to] = byte;
    receiver->to++;
    length = ibus_any_next(receiver, &again);
    if (length == 0U) {
        return false;
    }
    ibus_any_decode(&receiver->buffer[receiver->from - length], length, message);
    return true;
}

IBUS_ANY_FUNCTION bool ibus_any_poll(ibus_any_receiver *receiver, ibus_any_message *message)
{
    uint8_t length;
    bool again;

    /* Each iteration except the last decides about at least one pending byte. */
    do {
        length = ibus_any_next(receiver, &again);
        if (length > 0U) {
            ibus_any_decode(&receiver->buffer[receiver->from - length], length, message);
            return true;
        }
    } while (again);
    return false;
}

IBUS_ANY_FUNCTION void ibus_any_line_event(ibus_any_receiver *receiver, ibus_any_event event,
    void (*received)(void *context, const ibus_any_message *message), void *context)
{
    ibus_any_message message;

    receiver->counters.events[event]++;
    while (receiver->from < receiver->to) {
        if (ibus_any_poll(receiver, &message)) {
            if (received != NULL) {
                received(context, &message);
            }
        } else if (receiver->from < receiver->to) {
            /* No more bytes follow, so the first pending byte starts no frame.
             * Reset `ask_at`, which described the discarded byte. */
            receiver->from++;
            receiver->ask_at = 0U;
            ibus_any_count_discarded(receiver, IBUS_ANY_LINE_EVENT, 1U);
        }
    }
    ibus_any_forget(receiver);
}
#endif

#endif
