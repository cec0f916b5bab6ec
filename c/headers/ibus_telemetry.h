/* Frames of ibus_telemetry. Made by `framelock generate --frame ibus-telemetry --language c`, version 0.1.0; do not edit.
 * SPDX-License-Identifier: 0BSD
 * You may use, change and ship this file without conditions.
 *
 * This header needs only a C99 or C++17 compiler. It allocates no memory and does not recurse.
 *
 *   static ibus_telemetry_receiver receiver;
 *   ibus_telemetry_message message;
 *
 *   ibus_telemetry_init(&receiver);
 *   if (ibus_telemetry_push(&receiver, byte, &message)) { ... }     for each received byte
 *   ibus_telemetry_line_event(&receiver, IBUS_TELEMETRY_FRAMING_ERROR, received, NULL);     instead of a damaged byte
 *
 * The counters satisfy this equation at any time, modulo 2^32:
 * counters.bytes == counters.frame_bytes + the sum of counters.discarded + ibus_telemetry_pending(&receiver).
 *
 * Calls for one receiver must not interrupt each other. All functions are `static inline`. If several source files need
 * them, define IBUS_TELEMETRY_DEFINITIONS as 1 in one of these files, and as 0 in the others, before they include this header:
 * then there is one copy of the code. */
#ifndef IBUS_TELEMETRY_H
#define IBUS_TELEMETRY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifndef IBUS_TELEMETRY_DEFINITIONS
#define IBUS_TELEMETRY_FUNCTION static inline
#elif defined(__cplusplus)
#define IBUS_TELEMETRY_FUNCTION extern "C"
#else
#define IBUS_TELEMETRY_FUNCTION
#endif

/* The number of bytes in the longest frame. */
#define IBUS_TELEMETRY_LONGEST 8U

/* The number of bytes in a receiver's buffer. With room for two longest frames, pending bytes are seldom moved. */
#ifndef IBUS_TELEMETRY_ROOM
#define IBUS_TELEMETRY_ROOM (2U * IBUS_TELEMETRY_LONGEST)
#endif
#if (IBUS_TELEMETRY_ROOM < IBUS_TELEMETRY_LONGEST) || (IBUS_TELEMETRY_ROOM > 247U)
#error "IBUS_TELEMETRY_ROOM must be between IBUS_TELEMETRY_LONGEST and 247"
#endif

/* The outcome of a classification: a frame, incomplete, or the reason why bytes are discarded. */
typedef enum {
    IBUS_TELEMETRY_NO_SYNC, /* no frame begins with them */
    IBUS_TELEMETRY_CHECKSUM_MISMATCH, /* the checksum is wrong */
    IBUS_TELEMETRY_LINE_EVENT, /* pending at a line event */
    IBUS_TELEMETRY_REASONS, /* the number of reasons */
    IBUS_TELEMETRY_FRAME = IBUS_TELEMETRY_REASONS, /* a frame */
    IBUS_TELEMETRY_INCOMPLETE /* more bytes are needed */
} ibus_telemetry_outcome;

/* An event on the line, which the UART or a timer notices. */
typedef enum {
    IBUS_TELEMETRY_FRAMING_ERROR,
    IBUS_TELEMETRY_PARITY_ERROR,
    IBUS_TELEMETRY_OVERRUN,
    IBUS_TELEMETRY_BREAK,
    IBUS_TELEMETRY_IDLE_LINE,
    IBUS_TELEMETRY_EVENTS /* the number of events */
} ibus_telemetry_event;

/* Counters. They wrap at 2^32. */
typedef struct {
    uint32_t bytes; /* received bytes */
    uint32_t frames; /* frames */
    uint32_t frame_bytes; /* bytes in frames */
    uint32_t resynchronisations; /* frames that follow discarded bytes */
    uint32_t discarded[IBUS_TELEMETRY_REASONS]; /* discarded bytes, by reason */
    uint32_t events[IBUS_TELEMETRY_EVENTS]; /* line events */
} ibus_telemetry_counters;

/* The values of a frame. Pointers are valid until the next call for the receiver. */
typedef struct {
    /* At 1: u8, mask 0xF. */
    bool has_address;
    uint8_t address;
    /* At 1: u8, mask 0xF0. */
    bool has_command;
    uint8_t command;
    /* At 2: bytes. */
    bool has_payload;
    const uint8_t *payload;
    uint8_t payload_length;
} ibus_telemetry_message;

/* A receiver. Read `counters`; the other members are private. */
typedef struct {
    ibus_telemetry_counters counters;
    uint8_t from; /* the pending bytes are buffer[from] to buffer[to - 1] */
    uint8_t to;
    uint8_t ask_at; /* the next decision is possible when `to` reaches this index */
    bool is_lost; /* bytes were discarded since the last frame */
    uint8_t buffer[IBUS_TELEMETRY_ROOM];
} ibus_telemetry_receiver;

/* Starts a receiver. All counters are 0. */
IBUS_TELEMETRY_FUNCTION void ibus_telemetry_init(ibus_telemetry_receiver *receiver);

/* Returns the number of pending bytes, which may still become part of a frame. */
IBUS_TELEMETRY_FUNCTION uint32_t ibus_telemetry_pending(const ibus_telemetry_receiver *receiver);

/* Takes the next byte. If a frame is complete, returns true and writes its values to `*message`. Classifies bytes at most
 * once. So after a false start a complete frame may stay pending, until the following calls catch up. */
IBUS_TELEMETRY_FUNCTION bool ibus_telemetry_push(ibus_telemetry_receiver *receiver, uint8_t byte, ibus_telemetry_message *message);

/* Decides about pending bytes up to the next frame. If a frame is found, returns true and writes its values to
 * `*message`. If no byte follows soon, call this function until it returns false. */
IBUS_TELEMETRY_FUNCTION bool ibus_telemetry_poll(ibus_telemetry_receiver *receiver, ibus_telemetry_message *message);

/* Reports a line event: no more bytes follow the pending bytes. Calls `received` with each frame among them, and
 * discards the other bytes. `received` may be NULL. */
IBUS_TELEMETRY_FUNCTION void ibus_telemetry_line_event(ibus_telemetry_receiver *receiver, ibus_telemetry_event event,
    void (*received)(void *context, const ibus_telemetry_message *message), void *context);

/* Reads the values of a frame. */
IBUS_TELEMETRY_FUNCTION void ibus_telemetry_decode(const uint8_t *frame, uint8_t length, ibus_telemetry_message *message);

/* Writes a frame with these values. Returns its length, or 0 if `room` is too small or no frame has these values. */
IBUS_TELEMETRY_FUNCTION size_t ibus_telemetry_encode(const ibus_telemetry_message *message, uint8_t *frame, size_t room);

#if !defined(IBUS_TELEMETRY_DEFINITIONS) || IBUS_TELEMETRY_DEFINITIONS

/* Sets bytes to 0. */
static inline void ibus_telemetry_clear(void *object, size_t size)
{
    uint8_t *byte = (uint8_t *)object;

    while (size > 0U) {
        *byte = 0U;
        byte++;
        size--;
    }
}

/* Returns whether bytes are equal. */
static inline bool ibus_telemetry_same(const void *one, const void *other, size_t size)
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
static inline uint16_t ibus_telemetry_le16(const uint8_t *bytes)
{
    return (uint16_t)(((unsigned)bytes[1] << 8U) | bytes[0]);
}

/* Writes bytes by setting those bits that are 1. */
static inline void ibus_telemetry_put(uint8_t *to, const uint8_t *bytes, size_t count)
{
    size_t i;

    for (i = 0U; i < count; i++) {
        to[i] = (uint8_t)(to[i] | bytes[i]);
    }
}

/* Returns whether a frame can begin with this byte. */
static inline bool ibus_telemetry_starts(uint8_t byte)
{
    return (byte == 0x04U) || (byte == 0x06U) || (byte == 0x08U);
}

/* Returns the inverted sum of bytes. */
static inline uint16_t ibus_telemetry_checksum(const uint8_t *bytes, uint8_t count)
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
static inline ibus_telemetry_outcome ibus_telemetry_classify(const uint8_t *bytes, uint8_t count, uint8_t seen, uint8_t *number)
{
    uint8_t field;
    uint8_t length;

    (void)seen;
    /* The sync. */
    if (!ibus_telemetry_starts(bytes[0])) {
        return IBUS_TELEMETRY_NO_SYNC;
    }
    /* The header. */
    field = bytes[0U];
    length = (uint8_t)(field);
    if (count < length) {
        *number = length;
        return IBUS_TELEMETRY_INCOMPLETE;
    }
    /* The checksum. */
    if (ibus_telemetry_checksum(&bytes[0U], (uint8_t)(length - 2U)) != ibus_telemetry_le16(&bytes[length - 2U])) {
        return IBUS_TELEMETRY_CHECKSUM_MISMATCH;
    }
    *number = length;
    return IBUS_TELEMETRY_FRAME;
}

IBUS_TELEMETRY_FUNCTION void ibus_telemetry_decode(const uint8_t *frame, uint8_t length, ibus_telemetry_message *message)
{
    ibus_telemetry_clear(message, sizeof *message);
    message->has_address = length >= 4U;
    if (message->has_address) {
        message->address = (uint8_t)((frame[1U] & 0xFU));
    }
    message->has_command = length >= 4U;
    if (message->has_command) {
        message->command = (uint8_t)(((frame[1U] & 0xF0U) >> 4U));
    }
    message->has_payload = length >= 4U;
    if (message->has_payload) {
        message->payload = &frame[2U];
        message->payload_length = (uint8_t)(length - 4U);
    }
}

IBUS_TELEMETRY_FUNCTION size_t ibus_telemetry_encode(const ibus_telemetry_message *message, uint8_t *frame, size_t room)
{

    size_t size = 3U;
    uint8_t length;
    uint8_t number = 0U;
    uint32_t field;
    uint16_t sum;
    ibus_telemetry_message again;

    if (message->has_address && (size < 4U)) {
        size = 4U;
    }
    if (message->has_command && (size < 4U)) {
        size = 4U;
    }
    if (message->has_payload && (message->payload_length > 8U)) {
        return 0U;
    }
    if (message->has_payload && (size < ((size_t)4U + message->payload_length))) {
        size = (size_t)4U + message->payload_length;
    }
    length = (uint8_t)size;
    if ((size > 8U) || (room < size)) {
        return 0U;
    }
    ibus_telemetry_clear(frame, size);
    if (message->has_address) {
        frame[1U] = (uint8_t)(frame[1U] | (message->address & 0xFU));
    }
    if (message->has_command) {
        frame[1U] = (uint8_t)(frame[1U] | (((uint32_t)message->command << 4U) & 0xF0U));
    }
    if (message->has_payload) {
        ibus_telemetry_put(&frame[2U], message->payload, message->payload_length);
    }
    if (!ibus_telemetry_starts(frame[0])) {
        frame[0] = 0x04U;
    }
    field = (uint32_t)length;
    frame[0U] = (uint8_t)field;
    sum = ibus_telemetry_checksum(&frame[0U], (uint8_t)(length - 2U));
    frame[length - 2U] = (uint8_t)sum;
    frame[length - 1U] = (uint8_t)(sum >> 8U);
    /* Fail if a value is outside its field's range, or contradicts another part of the frame. */
    length = (uint8_t)size;
    if ((ibus_telemetry_classify(frame, length, 0U, &number) != IBUS_TELEMETRY_FRAME) || (number != length)) {
        return 0U;
    }
    ibus_telemetry_decode(frame, length, &again);
    if ((again.has_address != message->has_address) || (again.has_address && (again.address != message->address))) {
        return 0U;
    }
    if ((again.has_command != message->has_command) || (again.has_command && (again.command != message->command))) {
        return 0U;
    }
    if ((again.has_payload != message->has_payload) || (again.has_payload && ((again.payload_length != message->payload_length) || !ibus_telemetry_same(again.payload, message->payload, again.payload_length)))) {
        return 0U;
    }
    return size;
}

IBUS_TELEMETRY_FUNCTION void ibus_telemetry_init(ibus_telemetry_receiver *receiver)
{
    ibus_telemetry_clear(receiver, sizeof *receiver);
}

IBUS_TELEMETRY_FUNCTION uint32_t ibus_telemetry_pending(const ibus_telemetry_receiver *receiver)
{
    return (uint32_t)receiver->to - receiver->from;
}

static inline void ibus_telemetry_count_discarded(ibus_telemetry_receiver *receiver, ibus_telemetry_outcome reason, uint8_t count)
{
    receiver->counters.discarded[reason] += count;
    receiver->is_lost = true;
}

static inline void ibus_telemetry_count_frame(ibus_telemetry_receiver *receiver, uint8_t length)
{
    receiver->counters.frames++;
    receiver->counters.frame_bytes += length;
    if (receiver->is_lost) {
        receiver->is_lost = false;
        receiver->counters.resynchronisations++;
    }
}

/* Forgets the pending bytes. */
static inline void ibus_telemetry_forget(ibus_telemetry_receiver *receiver)
{
    receiver->from = 0U;
    receiver->to = 0U;
    receiver->ask_at = 0U;
}

/* Decides about the first pending bytes. Classifies bytes at most once. If they are a frame, moves `from` past it and
 * returns its length, otherwise returns 0. Sets `*again` to false if the next decision needs more bytes. */
static inline uint8_t ibus_telemetry_next(ibus_telemetry_receiver *receiver, bool *again)
{
    ibus_telemetry_outcome outcome;
    uint8_t number = 0U;
    uint8_t seen;
    const uint8_t start = receiver->from;

    *again = false;
    if (receiver->to < receiver->ask_at) {
        return 0U;
    }
    /* If the first byte has not been classified yet, skip bytes that cannot begin a frame. */
    if (receiver->ask_at <= (receiver->from + 1U)) {
        while ((receiver->from < receiver->to) && !ibus_telemetry_starts(receiver->buffer[receiver->from])) {
            receiver->from++;
        }
        if (receiver->from > start) {
            ibus_telemetry_count_discarded(receiver, IBUS_TELEMETRY_NO_SYNC, (uint8_t)(receiver->from - start));
            receiver->ask_at = 0U;
        }
    }
    if (receiver->from == receiver->to) {
        ibus_telemetry_forget(receiver);
        return 0U;
    }
    seen = (receiver->ask_at > receiver->from) ? (uint8_t)(receiver->ask_at - (receiver->from + 1U)) : (uint8_t)0U;
    receiver->ask_at = 0U;
    outcome = ibus_telemetry_classify(&receiver->buffer[receiver->from], (uint8_t)(receiver->to - receiver->from), seen, &number);
    if (outcome == IBUS_TELEMETRY_INCOMPLETE) {
        receiver->ask_at = (uint8_t)(receiver->from + number);
        return 0U;
    }
    *again = true;
    if (outcome == IBUS_TELEMETRY_FRAME) {
        receiver->from = (uint8_t)(receiver->from + number);
        ibus_telemetry_count_frame(receiver, number);
        return number;
    }
    receiver->from++;
    ibus_telemetry_count_discarded(receiver, outcome, 1U);
    return 0U;
}

/* Moves the pending bytes to the front of the buffer. */
static inline void ibus_telemetry_move_to_front(ibus_telemetry_receiver *receiver)
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

IBUS_TELEMETRY_FUNCTION bool ibus_telemetry_push(ibus_telemetry_receiver *receiver, uint8_t byte, ibus_telemetry_message *message)
{
    uint8_t length;
    bool again;

    receiver->counters.bytes++;
    if (((receiver->to + 1U) < receiver->ask_at) && (receiver->to < IBUS_TELEMETRY_ROOM)) {
        /* No decision is possible yet: only store the byte. */
        receiver->buffer[receiver->to] = byte;
        receiver->to++;
        return false;
    }
    if (receiver->from == receiver->to) {
        ibus_telemetry_forget(receiver);
        if (!ibus_telemetry_starts(byte)) {
            ibus_telemetry_count_discarded(receiver, IBUS_TELEMETRY_NO_SYNC, 1U);
            return false;
        }
    }
    if (receiver->to == IBUS_TELEMETRY_ROOM) {
        ibus_telemetry_move_to_front(receiver);
    }
    receiver->buffer[receiver->to] = byte;
    receiver->to++;
    length = ibus_telemetry_next(receiver, &again);
    if (length == 0U) {
        return false;
    }
    ibus_telemetry_decode(&receiver->buffer[receiver->from - length], length, message);
    return true;
}

IBUS_TELEMETRY_FUNCTION bool ibus_telemetry_poll(ibus_telemetry_receiver *receiver, ibus_telemetry_message *message)
{
    uint8_t length;
    bool again;

    /* Each iteration except the last decides about at least one pending byte. */
    do {
        length = ibus_telemetry_next(receiver, &again);
        if (length > 0U) {
            ibus_telemetry_decode(&receiver->buffer[receiver->from - length], length, message);
            return true;
        }
    } while (again);
    return false;
}

IBUS_TELEMETRY_FUNCTION void ibus_telemetry_line_event(ibus_telemetry_receiver *receiver, ibus_telemetry_event event,
    void (*received)(void *context, const ibus_telemetry_message *message), void *context)
{
    ibus_telemetry_message message;

    receiver->counters.events[event]++;
    while (receiver->from < receiver->to) {
        if (ibus_telemetry_poll(receiver, &message)) {
            if (received != NULL) {
                received(context, &message);
            }
        } else if (receiver->from < receiver->to) {
            /* No more bytes follow, so the first pending byte starts no frame.
             * Reset `ask_at`, which described the discarded byte. */
            receiver->from++;
            receiver->ask_at = 0U;
            ibus_telemetry_count_discarded(receiver, IBUS_TELEMETRY_LINE_EVENT, 1U);
        }
    }
    ibus_telemetry_forget(receiver);
}
#endif

#endif
