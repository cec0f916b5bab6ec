/* Frames of ubx. Made by `framelock generate --frame ubx --language c`, version 0.1.0; do not edit.
 * SPDX-License-Identifier: 0BSD
 * You may use, change and ship this file without conditions.
 *
 * This header needs only a C99 or C++17 compiler. It allocates no memory and does not recurse.
 *
 *   static ubx_receiver receiver;
 *   ubx_message message;
 *
 *   ubx_init(&receiver);
 *   if (ubx_push(&receiver, byte, &message)) { ... }     for each received byte
 *   ubx_line_event(&receiver, UBX_FRAMING_ERROR, received, NULL);     instead of a damaged byte
 *
 * The counters satisfy this equation at any time, modulo 2^32:
 * counters.bytes == counters.frame_bytes + the sum of counters.discarded + ubx_pending(&receiver).
 *
 * Calls for one receiver must not interrupt each other. All functions are `static inline`. If several source files need
 * them, define UBX_DEFINITIONS as 1 in one of these files, and as 0 in the others, before they include this header:
 * then there is one copy of the code. */
#ifndef UBX_H
#define UBX_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifndef UBX_DEFINITIONS
#define UBX_FUNCTION static inline
#elif defined(__cplusplus)
#define UBX_FUNCTION extern "C"
#else
#define UBX_FUNCTION
#endif

/* The number of bytes in the longest frame. */
#define UBX_LONGEST 4096U

/* The number of bytes in a receiver's buffer. With room for two longest frames, pending bytes are seldom moved. */
#ifndef UBX_ROOM
#define UBX_ROOM (2U * UBX_LONGEST)
#endif
#if (UBX_ROOM < UBX_LONGEST) || (UBX_ROOM > 61439U)
#error "UBX_ROOM must be between UBX_LONGEST and 61439"
#endif

/* The outcome of a classification: a frame, incomplete, or the reason why bytes are discarded. */
typedef enum {
    UBX_NO_SYNC, /* no frame begins with them */
    UBX_BROKEN_SYNC, /* a later byte of the sync is wrong */
    UBX_TOO_LONG, /* the length is too great */
    UBX_CHECKSUM_MISMATCH, /* the checksum is wrong */
    UBX_LINE_EVENT, /* pending at a line event */
    UBX_REASONS, /* the number of reasons */
    UBX_FRAME = UBX_REASONS, /* a frame */
    UBX_INCOMPLETE /* more bytes are needed */
} ubx_outcome;

/* An event on the line, which the UART or a timer notices. */
typedef enum {
    UBX_FRAMING_ERROR,
    UBX_PARITY_ERROR,
    UBX_OVERRUN,
    UBX_BREAK,
    UBX_IDLE_LINE,
    UBX_EVENTS /* the number of events */
} ubx_event;

/* Counters. They wrap at 2^32. */
typedef struct {
    uint32_t bytes; /* received bytes */
    uint32_t frames; /* frames */
    uint32_t frame_bytes; /* bytes in frames */
    uint32_t resynchronisations; /* frames that follow discarded bytes */
    uint32_t discarded[UBX_REASONS]; /* discarded bytes, by reason */
    uint32_t events[UBX_EVENTS]; /* line events */
} ubx_counters;

/* The values of a frame. Pointers are valid until the next call for the receiver. */
typedef struct {
    /* At 2: u8. */
    uint8_t class_;
    /* At 3: u8. */
    uint8_t id;
    /* At 6: bytes. */
    const uint8_t *payload;
    uint16_t payload_length;
} ubx_message;

/* A receiver. Read `counters`; the other members are private. */
typedef struct {
    ubx_counters counters;
    uint16_t from; /* the pending bytes are buffer[from] to buffer[to - 1] */
    uint16_t to;
    uint16_t ask_at; /* the next decision is possible when `to` reaches this index */
    bool is_lost; /* bytes were discarded since the last frame */
    uint8_t buffer[UBX_ROOM];
} ubx_receiver;

/* Starts a receiver. All counters are 0. */
UBX_FUNCTION void ubx_init(ubx_receiver *receiver);

/* Returns the number of pending bytes, which may still become part of a frame. */
UBX_FUNCTION uint32_t ubx_pending(const ubx_receiver *receiver);

/* Takes the next byte. If a frame is complete, returns true and writes its values to `*message`. Classifies bytes at most
 * once. So after a false start a complete frame may stay pending, until the following calls catch up. */
UBX_FUNCTION bool ubx_push(ubx_receiver *receiver, uint8_t byte, ubx_message *message);

/* Decides about pending bytes up to the next frame. If a frame is found, returns true and writes its values to
 * `*message`. If no byte follows soon, call this function until it returns false. */
UBX_FUNCTION bool ubx_poll(ubx_receiver *receiver, ubx_message *message);

/* Reports a line event: no more bytes follow the pending bytes. Calls `received` with each frame among them, and
 * discards the other bytes. `received` may be NULL. */
UBX_FUNCTION void ubx_line_event(ubx_receiver *receiver, ubx_event event,
    void (*received)(void *context, const ubx_message *message), void *context);

/* Reads the values of a frame. */
UBX_FUNCTION void ubx_decode(const uint8_t *frame, uint16_t length, ubx_message *message);

/* Writes a frame with these values. Returns its length, or 0 if `room` is too small or no frame has these values. */
UBX_FUNCTION size_t ubx_encode(const ubx_message *message, uint8_t *frame, size_t room);

#if !defined(UBX_DEFINITIONS) || UBX_DEFINITIONS

/* Sets bytes to 0. */
static inline void ubx_clear(void *object, size_t size)
{
    uint8_t *byte = (uint8_t *)object;

    while (size > 0U) {
        *byte = 0U;
        byte++;
        size--;
    }
}

/* Returns whether bytes are equal. */
static inline bool ubx_same(const void *one, const void *other, size_t size)
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
static inline uint16_t ubx_le16(const uint8_t *bytes)
{
    return (uint16_t)(((unsigned)bytes[1] << 8U) | bytes[0]);
}

/* Writes bytes by setting those bits that are 1. */
static inline void ubx_put(uint8_t *to, const uint8_t *bytes, size_t count)
{
    size_t i;

    for (i = 0U; i < count; i++) {
        to[i] = (uint8_t)(to[i] | bytes[i]);
    }
}

/* Returns whether a frame can begin with this byte. */
static inline bool ubx_starts(uint8_t byte)
{
    return byte == 0xB5U;
}

/* Returns the Fletcher checksum of bytes. */
static inline uint16_t ubx_checksum(const uint8_t *bytes, uint16_t count)
{
    uint8_t low = 0U; /* the sum of the bytes */
    uint8_t high = 0U; /* the sum of all values that `low` takes */
    uint16_t i;

    for (i = 0U; i < count; i++) {
        const uint8_t byte = bytes[i];

        low = (uint8_t)(low + byte);
        high = (uint8_t)(high + low);
    }
    return (uint16_t)(((unsigned)high << 8U) | low);
}

/* Classifies one byte or more. The first `seen` bytes must be incomplete; `seen` may be 0. If the bytes begin with a
 * frame, sets `*number` to its length. If they are incomplete, sets `*number` to the number of bytes needed to decide
 * more. */
static inline ubx_outcome ubx_classify(const uint8_t *bytes, uint16_t count, uint16_t seen, uint16_t *number)
{
    uint16_t field;
    uint16_t length;

    (void)seen;
    /* The sync. */
    if (!ubx_starts(bytes[0])) {
        return UBX_NO_SYNC;
    }
    if ((count > 1U) && (bytes[1] != 0x62U)) {
        return UBX_BROKEN_SYNC;
    }
    if (count < 6U) {
        *number = (count < 2U) ? (uint16_t)(count + 1U) : 6U;
        return UBX_INCOMPLETE;
    }
    /* The header. */
    field = ubx_le16(&bytes[4U]);
    if (field > 4088U) {
        return UBX_TOO_LONG;
    }
    length = (uint16_t)(field + 8U);
    if (count < length) {
        *number = length;
        return UBX_INCOMPLETE;
    }
    /* The checksum. */
    if (ubx_checksum(&bytes[2U], (uint16_t)(length - 4U)) != ubx_le16(&bytes[length - 2U])) {
        return UBX_CHECKSUM_MISMATCH;
    }
    *number = length;
    return UBX_FRAME;
}

UBX_FUNCTION void ubx_decode(const uint8_t *frame, uint16_t length, ubx_message *message)
{
    message->class_ = frame[2U];
    message->id = frame[3U];
    message->payload = &frame[6U];
    message->payload_length = (uint16_t)(length - 8U);
}

UBX_FUNCTION size_t ubx_encode(const ubx_message *message, uint8_t *frame, size_t room)
{

    size_t size = 8U;
    uint16_t length;
    uint16_t number = 0U;
    uint32_t field;
    uint16_t sum;
    ubx_message again;

    if (message->payload_length > 4096U) {
        return 0U;
    }
    size += message->payload_length;
    length = (uint16_t)size;
    if ((size > 4096U) || (room < size)) {
        return 0U;
    }
    ubx_clear(frame, size);
    frame[2U] = (uint8_t)(frame[2U] | message->class_);
    frame[3U] = (uint8_t)(frame[3U] | message->id);
    ubx_put(&frame[6U], message->payload, message->payload_length);
    frame[0] = 0xB5U;
    frame[1] = 0x62U;
    field = (uint32_t)length - 8U;
    frame[4U] = (uint8_t)field;
    frame[5U] = (uint8_t)(field >> 8U);
    sum = ubx_checksum(&frame[2U], (uint16_t)(length - 4U));
    frame[length - 2U] = (uint8_t)sum;
    frame[length - 1U] = (uint8_t)(sum >> 8U);
    /* Fail if a value is outside its field's range, or contradicts another part of the frame. */
    length = (uint16_t)size;
    if ((ubx_classify(frame, length, 0U, &number) != UBX_FRAME) || (number != length)) {
        return 0U;
    }
    ubx_decode(frame, length, &again);
    if (again.class_ != message->class_) {
        return 0U;
    }
    if (again.id != message->id) {
        return 0U;
    }
    if ((again.payload_length != message->payload_length) || !ubx_same(again.payload, message->payload, again.payload_length)) {
        return 0U;
    }
    return size;
}

UBX_FUNCTION void ubx_init(ubx_receiver *receiver)
{
    ubx_clear(receiver, sizeof *receiver);
}

UBX_FUNCTION uint32_t ubx_pending(const ubx_receiver *receiver)
{
    return (uint32_t)receiver->to - receiver->from;
}

static inline void ubx_count_discarded(ubx_receiver *receiver, ubx_outcome reason, uint16_t count)
{
    receiver->counters.discarded[reason] += count;
    receiver->is_lost = true;
}

static inline void ubx_count_frame(ubx_receiver *receiver, uint16_t length)
{
    receiver->counters.frames++;
    receiver->counters.frame_bytes += length;
    if (receiver->is_lost) {
        receiver->is_lost = false;
        receiver->counters.resynchronisations++;
    }
}

/* Forgets the pending bytes. */
static inline void ubx_forget(ubx_receiver *receiver)
{
    receiver->from = 0U;
    receiver->to = 0U;
    receiver->ask_at = 0U;
}

/* Decides about the first pending bytes. Classifies bytes at most once. If they are a frame, moves `from` past it and
 * returns its length, otherwise returns 0. Sets `*again` to false if the next decision needs more bytes. */
static inline uint16_t ubx_next(ubx_receiver *receiver, bool *again)
{
    ubx_outcome outcome;
    uint16_t number = 0U;
    uint16_t seen;
    const uint16_t start = receiver->from;

    *again = false;
    if (receiver->to < receiver->ask_at) {
        return 0U;
    }
    /* If the first byte has not been classified yet, skip bytes that cannot begin a frame. */
    if (receiver->ask_at <= (receiver->from + 1U)) {
        while ((receiver->from < receiver->to) && !ubx_starts(receiver->buffer[receiver->from])) {
            receiver->from++;
        }
        if (receiver->from > start) {
            ubx_count_discarded(receiver, UBX_NO_SYNC, (uint16_t)(receiver->from - start));
            receiver->ask_at = 0U;
        }
    }
    if (receiver->from == receiver->to) {
        ubx_forget(receiver);
        return 0U;
    }
    seen = (receiver->ask_at > receiver->from) ? (uint16_t)(receiver->ask_at - (receiver->from + 1U)) : (uint16_t)0U;
    receiver->ask_at = 0U;
    outcome = ubx_classify(&receiver->buffer[receiver->from], (uint16_t)(receiver->to - receiver->from), seen, &number);
    if (outcome == UBX_INCOMPLETE) {
        receiver->ask_at = (uint16_t)(receiver->from + number);
        return 0U;
    }
    *again = true;
    if (outcome == UBX_FRAME) {
        receiver->from = (uint16_t)(receiver->from + number);
        ubx_count_frame(receiver, number);
        return number;
    }
    receiver->from++;
    ubx_count_discarded(receiver, outcome, 1U);
    return 0U;
}

/* Moves the pending bytes to the front of the buffer. */
static inline void ubx_move_to_front(ubx_receiver *receiver)
{
    const uint16_t from = receiver->from;
    uint16_t i;

    receiver->from = 0U;
    receiver->to = (uint16_t)(receiver->to - from);
    receiver->ask_at = (receiver->ask_at > from) ? (uint16_t)(receiver->ask_at - from) : (uint16_t)0U;
    for (i = 0U; i < receiver->to; i++) {
        receiver->buffer[i] = receiver->buffer[from + i];
    }
}

UBX_FUNCTION bool ubx_push(ubx_receiver *receiver, uint8_t byte, ubx_message *message)
{
    uint16_t length;
    bool again;

    receiver->counters.bytes++;
    if (((receiver->to + 1U) < receiver->ask_at) && (receiver->to < UBX_ROOM)) {
        /* No decision is possible yet: only store the byte. */
        receiver->buffer[receiver->to] = byte;
        receiver->to++;
        return false;
    }
    if (receiver->from == receiver->to) {
        ubx_forget(receiver);
        if (!ubx_starts(byte)) {
            ubx_count_discarded(receiver, UBX_NO_SYNC, 1U);
            return false;
        }
    }
    if (receiver->to == UBX_ROOM) {
        ubx_move_to_front(receiver);
    }
    receiver->buffer[receiver->to] = byte;
    receiver->to++;
    length = ubx_next(receiver, &again);
    if (length == 0U) {
        return false;
    }
    ubx_decode(&receiver->buffer[receiver->from - length], length, message);
    return true;
}

UBX_FUNCTION bool ubx_poll(ubx_receiver *receiver, ubx_message *message)
{
    uint16_t length;
    bool again;

    /* Each iteration except the last decides about at least one pending byte. */
    do {
        length = ubx_next(receiver, &again);
        if (length > 0U) {
            ubx_decode(&receiver->buffer[receiver->from - length], length, message);
            return true;
        }
    } while (again);
    return false;
}

UBX_FUNCTION void ubx_line_event(ubx_receiver *receiver, ubx_event event,
    void (*received)(void *context, const ubx_message *message), void *context)
{
    ubx_message message;

    receiver->counters.events[event]++;
    while (receiver->from < receiver->to) {
        if (ubx_poll(receiver, &message)) {
            if (received != NULL) {
                received(context, &message);
            }
        } else if (receiver->from < receiver->to) {
            /* No more bytes follow, so the first pending byte starts no frame.
             * Reset `ask_at`, which described the discarded byte. */
            receiver->from++;
            receiver->ask_at = 0U;
            ubx_count_discarded(receiver, UBX_LINE_EVENT, 1U);
        }
    }
    ubx_forget(receiver);
}
#endif

#endif
