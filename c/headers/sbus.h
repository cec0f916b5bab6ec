/* Frames of sbus. Made by `framelock generate --frame sbus --language c`, version 0.1.0; do not edit.
 * SPDX-License-Identifier: 0BSD
 * You may use, change and ship this file without conditions.
 *
 * This header needs only a C99 or C++17 compiler. It allocates no memory and does not recurse.
 *
 *   static sbus_receiver receiver;
 *   sbus_message message;
 *
 *   sbus_init(&receiver);
 *   if (sbus_push(&receiver, byte, &message)) { ... }     for each received byte
 *   sbus_line_event(&receiver, SBUS_FRAMING_ERROR, received, NULL);     instead of a damaged byte
 *
 * The counters satisfy this equation at any time, modulo 2^32:
 * counters.bytes == counters.frame_bytes + the sum of counters.discarded + sbus_pending(&receiver).
 *
 * Calls for one receiver must not interrupt each other. All functions are `static inline`. If several source files need
 * them, define SBUS_DEFINITIONS as 1 in one of these files, and as 0 in the others, before they include this header:
 * then there is one copy of the code. */
#ifndef SBUS_H
#define SBUS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifndef SBUS_DEFINITIONS
#define SBUS_FUNCTION static inline
#elif defined(__cplusplus)
#define SBUS_FUNCTION extern "C"
#else
#define SBUS_FUNCTION
#endif

/* The number of bytes in the longest frame. */
#define SBUS_LONGEST 25U

/* The number of bytes in a receiver's buffer. With room for two longest frames, pending bytes are seldom moved. */
#ifndef SBUS_ROOM
#define SBUS_ROOM (2U * SBUS_LONGEST)
#endif
#if (SBUS_ROOM < SBUS_LONGEST) || (SBUS_ROOM > 230U)
#error "SBUS_ROOM must be between SBUS_LONGEST and 230"
#endif

/* The outcome of a classification: a frame, incomplete, or the reason why bytes are discarded. */
typedef enum {
    SBUS_NO_SYNC, /* no frame begins with them */
    SBUS_WRONG_TERMINATOR, /* the terminator or fixed bits are wrong */
    SBUS_LINE_EVENT, /* pending at a line event */
    SBUS_REASONS, /* the number of reasons */
    SBUS_FRAME = SBUS_REASONS, /* a frame */
    SBUS_INCOMPLETE /* more bytes are needed */
} sbus_outcome;

/* An event on the line, which the UART or a timer notices. */
typedef enum {
    SBUS_FRAMING_ERROR,
    SBUS_PARITY_ERROR,
    SBUS_OVERRUN,
    SBUS_BREAK,
    SBUS_IDLE_LINE,
    SBUS_EVENTS /* the number of events */
} sbus_event;

/* Counters. They wrap at 2^32. */
typedef struct {
    uint32_t bytes; /* received bytes */
    uint32_t frames; /* frames */
    uint32_t frame_bytes; /* bytes in frames */
    uint32_t resynchronisations; /* frames that follow discarded bytes */
    uint32_t discarded[SBUS_REASONS]; /* discarded bytes, by reason */
    uint32_t events[SBUS_EVENTS]; /* line events */
} sbus_counters;

/* The values of a frame. */
typedef struct {
    /* At 1, bit 0: 11 bits. */
    uint16_t channel[16];
    /* At 23, bit 0: 1 bits. */
    uint8_t channel17;
    /* At 23, bit 1: 1 bits. */
    uint8_t channel18;
    /* At 23, bit 2: 1 bits. */
    uint8_t frame_lost;
    /* At 23, bit 3: 1 bits. */
    uint8_t failsafe;
    /* At 24: u8. */
    uint8_t end;
} sbus_message;

/* A receiver. Read `counters`; the other members are private. */
typedef struct {
    sbus_counters counters;
    uint8_t from; /* the pending bytes are buffer[from] to buffer[to - 1] */
    uint8_t to;
    uint8_t ask_at; /* the next decision is possible when `to` reaches this index */
    bool is_lost; /* bytes were discarded since the last frame */
    uint8_t buffer[SBUS_ROOM];
} sbus_receiver;

/* Starts a receiver. All counters are 0. */
SBUS_FUNCTION void sbus_init(sbus_receiver *receiver);

/* Returns the number of pending bytes, which may still become part of a frame. */
SBUS_FUNCTION uint32_t sbus_pending(const sbus_receiver *receiver);

/* Takes the next byte. If a frame is complete, returns true and writes its values to `*message`. Classifies bytes at most
 * once. So after a false start a complete frame may stay pending, until the following calls catch up. */
SBUS_FUNCTION bool sbus_push(sbus_receiver *receiver, uint8_t byte, sbus_message *message);

/* Decides about pending bytes up to the next frame. If a frame is found, returns true and writes its values to
 * `*message`. If no byte follows soon, call this function until it returns false. */
SBUS_FUNCTION bool sbus_poll(sbus_receiver *receiver, sbus_message *message);

/* Reports a line event: no more bytes follow the pending bytes. Calls `received` with each frame among them, and
 * discards the other bytes. `received` may be NULL. */
SBUS_FUNCTION void sbus_line_event(sbus_receiver *receiver, sbus_event event,
    void (*received)(void *context, const sbus_message *message), void *context);

/* Reads the values of a frame. */
SBUS_FUNCTION void sbus_decode(const uint8_t *frame, uint8_t length, sbus_message *message);

/* Writes a frame with these values. Returns its length, or 0 if `room` is too small or no frame has these values. */
SBUS_FUNCTION size_t sbus_encode(const sbus_message *message, uint8_t *frame, size_t room);

#if !defined(SBUS_DEFINITIONS) || SBUS_DEFINITIONS

/* Sets bytes to 0. */
static inline void sbus_clear(void *object, size_t size)
{
    uint8_t *byte = (uint8_t *)object;

    while (size > 0U) {
        *byte = 0U;
        byte++;
        size--;
    }
}

/* Returns whether bytes are equal. */
static inline bool sbus_same(const void *one, const void *other, size_t size)
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

/* Reads `width` bits, from bit `first` on: bit 0 is the lowest bit of the first byte. */
static inline uint32_t sbus_bits(const uint8_t *bytes, uint16_t first, uint8_t width)
{
    const uint8_t *byte = &bytes[first / 8U];
    uint32_t bits = (uint32_t)*byte >> (first % 8U);
    uint8_t shift;

    for (shift = (uint8_t)(8U - first % 8U); shift < width; shift = (uint8_t)(shift + 8U)) {
        byte++;
        bits |= (uint32_t)*byte << shift;
    }
    return bits & (UINT32_MAX >> (32U - width));
}

/* Writes `width` bits by setting those that are 1, from bit `first` on: bit 0 is the lowest bit of the first byte. */
static inline void sbus_put_bits(uint8_t *bytes, uint16_t first, uint8_t width, uint32_t number)
{
    uint8_t i;

    for (i = 0U; i < width; i++) {
        const uint16_t place = (uint16_t)(first + i);

        if (((number >> i) & 1U) != 0U) {
            bytes[place / 8U] = (uint8_t)(bytes[place / 8U] | (1U << (place % 8U)));
        }
    }
}

/* Returns whether a frame can begin with this byte. */
static inline bool sbus_starts(uint8_t byte)
{
    return byte == 0x0FU;
}

/* Classifies one byte or more. The first `seen` bytes must be incomplete; `seen` may be 0. If the bytes begin with a
 * frame, sets `*number` to its length. If they are incomplete, sets `*number` to the number of bytes needed to decide
 * more. */
static inline sbus_outcome sbus_classify(const uint8_t *bytes, uint8_t count, uint8_t seen, uint8_t *number)
{
    uint8_t length;

    (void)seen;
    /* The sync. */
    if (!sbus_starts(bytes[0])) {
        return SBUS_NO_SYNC;
    }
    length = 25U;
    if (count < length) {
        *number = length;
        return SBUS_INCOMPLETE;
    }
    /* The terminator. */
    if (!((bytes[length - 1U] == 0x00U) || (bytes[length - 1U] == 0x04U) || (bytes[length - 1U] == 0x14U) || (bytes[length - 1U] == 0x24U) || (bytes[length - 1U] == 0x34U))) {
        return SBUS_WRONG_TERMINATOR;
    }
    /* The bits that are the same in each frame. */
    if ((bytes[23U] & 0xF0U) != 0x00U) {
        return SBUS_WRONG_TERMINATOR;
    }
    *number = length;
    return SBUS_FRAME;
}

SBUS_FUNCTION void sbus_decode(const uint8_t *frame, uint8_t length, sbus_message *message)
{
    uint8_t i;

    (void)length;
    for (i = 0U; i < 16U; i++) {
        message->channel[i] = (uint16_t)(sbus_bits(&frame[1U], (uint16_t)(0U + 11U * i), 11U));
    }
    message->channel17 = (uint8_t)(frame[23U] & 0x01U);
    message->channel18 = (uint8_t)((uint8_t)(frame[23U] >> 1U) & 0x01U);
    message->frame_lost = (uint8_t)((uint8_t)(frame[23U] >> 2U) & 0x01U);
    message->failsafe = (uint8_t)((uint8_t)(frame[23U] >> 3U) & 0x01U);
    message->end = frame[24U];
}

SBUS_FUNCTION size_t sbus_encode(const sbus_message *message, uint8_t *frame, size_t room)
{
    uint8_t i;
    const size_t size = 25U;
    uint8_t length;
    uint8_t number = 0U;
    sbus_message again;

    length = (uint8_t)size;
    if (room < size) {
        return 0U;
    }
    sbus_clear(frame, size);
    for (i = 0U; i < 16U; i++) {
        sbus_put_bits(&frame[1U], (uint16_t)(0U + 11U * i), 11U, message->channel[i]);
    }
    sbus_put_bits(&frame[23U], 0U, 1U, message->channel17);
    sbus_put_bits(&frame[23U], 1U, 1U, message->channel18);
    sbus_put_bits(&frame[23U], 2U, 1U, message->frame_lost);
    sbus_put_bits(&frame[23U], 3U, 1U, message->failsafe);
    frame[24U] = (uint8_t)(frame[24U] | message->end);
    frame[0] = 0x0FU;
    frame[23U] = (uint8_t)((frame[23U] & 0x0FU) | 0x00U);
    if (!((frame[length - 1U] == 0x00U) || (frame[length - 1U] == 0x04U) || (frame[length - 1U] == 0x14U) || (frame[length - 1U] == 0x24U) || (frame[length - 1U] == 0x34U))) {
        frame[length - 1U] = 0x00U;
    }
    /* Fail if a value is outside its field's range, or contradicts another part of the frame. */
    length = (uint8_t)size;
    if ((sbus_classify(frame, length, 0U, &number) != SBUS_FRAME) || (number != length)) {
        return 0U;
    }
    sbus_decode(frame, length, &again);
    if (!sbus_same(&again.channel, &message->channel, sizeof again.channel)) {
        return 0U;
    }
    if (again.channel17 != message->channel17) {
        return 0U;
    }
    if (again.channel18 != message->channel18) {
        return 0U;
    }
    if (again.frame_lost != message->frame_lost) {
        return 0U;
    }
    if (again.failsafe != message->failsafe) {
        return 0U;
    }
    if (again.end != message->end) {
        return 0U;
    }
    return size;
}

SBUS_FUNCTION void sbus_init(sbus_receiver *receiver)
{
    sbus_clear(receiver, sizeof *receiver);
}

SBUS_FUNCTION uint32_t sbus_pending(const sbus_receiver *receiver)
{
    return (uint32_t)receiver->to - receiver->from;
}

static inline void sbus_count_discarded(sbus_receiver *receiver, sbus_outcome reason, uint8_t count)
{
    receiver->counters.discarded[reason] += count;
    receiver->is_lost = true;
}

static inline void sbus_count_frame(sbus_receiver *receiver, uint8_t length)
{
    receiver->counters.frames++;
    receiver->counters.frame_bytes += length;
    if (receiver->is_lost) {
        receiver->is_lost = false;
        receiver->counters.resynchronisations++;
    }
}

/* Forgets the pending bytes. */
static inline void sbus_forget(sbus_receiver *receiver)
{
    receiver->from = 0U;
    receiver->to = 0U;
    receiver->ask_at = 0U;
}

/* Decides about the first pending bytes. Classifies bytes at most once. If they are a frame, moves `from` past it and
 * returns its length, otherwise returns 0. Sets `*again` to false if the next decision needs more bytes. */
static inline uint8_t sbus_next(sbus_receiver *receiver, bool *again)
{
    sbus_outcome outcome;
    uint8_t number = 0U;
    uint8_t seen;
    const uint8_t start = receiver->from;

    *again = false;
    if (receiver->to < receiver->ask_at) {
        return 0U;
    }
    /* If the first byte has not been classified yet, skip bytes that cannot begin a frame. */
    if (receiver->ask_at <= (receiver->from + 1U)) {
        while ((receiver->from < receiver->to) && !sbus_starts(receiver->buffer[receiver->from])) {
            receiver->from++;
        }
        if (receiver->from > start) {
            sbus_count_discarded(receiver, SBUS_NO_SYNC, (uint8_t)(receiver->from - start));
            receiver->ask_at = 0U;
        }
    }
    if (receiver->from == receiver->to) {
        sbus_forget(receiver);
        return 0U;
    }
    seen = (receiver->ask_at > receiver->from) ? (uint8_t)(receiver->ask_at - (receiver->from + 1U)) : (uint8_t)0U;
    receiver->ask_at = 0U;
    outcome = sbus_classify(&receiver->buffer[receiver->from], (uint8_t)(receiver->to - receiver->from), seen, &number);
    if (outcome == SBUS_INCOMPLETE) {
        receiver->ask_at = (uint8_t)(receiver->from + number);
        return 0U;
    }
    *again = true;
    if (outcome == SBUS_FRAME) {
        receiver->from = (uint8_t)(receiver->from + number);
        sbus_count_frame(receiver, number);
        return number;
    }
    receiver->from++;
    sbus_count_discarded(receiver, outcome, 1U);
    return 0U;
}

/* Moves the pending bytes to the front of the buffer. */
static inline void sbus_move_to_front(sbus_receiver *receiver)
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

SBUS_FUNCTION bool sbus_push(sbus_receiver *receiver, uint8_t byte, sbus_message *message)
{
    uint8_t length;
    bool again;

    receiver->counters.bytes++;
    if (((receiver->to + 1U) < receiver->ask_at) && (receiver->to < SBUS_ROOM)) {
        /* No decision is possible yet: only store the byte. */
        receiver->buffer[receiver->to] = byte;
        receiver->to++;
        return false;
    }
    if (receiver->from == receiver->to) {
        sbus_forget(receiver);
        if (!sbus_starts(byte)) {
            sbus_count_discarded(receiver, SBUS_NO_SYNC, 1U);
            return false;
        }
    }
    if (receiver->to == SBUS_ROOM) {
        sbus_move_to_front(receiver);
    }
    receiver->buffer[receiver->to] = byte;
    receiver->to++;
    length = sbus_next(receiver, &again);
    if (length == 0U) {
        return false;
    }
    sbus_decode(&receiver->buffer[receiver->from - length], length, message);
    return true;
}

SBUS_FUNCTION bool sbus_poll(sbus_receiver *receiver, sbus_message *message)
{
    uint8_t length;
    bool again;

    /* Each iteration except the last decides about at least one pending byte. */
    do {
        length = sbus_next(receiver, &again);
        if (length > 0U) {
            sbus_decode(&receiver->buffer[receiver->from - length], length, message);
            return true;
        }
    } while (again);
    return false;
}

SBUS_FUNCTION void sbus_line_event(sbus_receiver *receiver, sbus_event event,
    void (*received)(void *context, const sbus_message *message), void *context)
{
    sbus_message message;

    receiver->counters.events[event]++;
    while (receiver->from < receiver->to) {
        if (sbus_poll(receiver, &message)) {
            if (received != NULL) {
                received(context, &message);
            }
        } else if (receiver->from < receiver->to) {
            /* No more bytes follow, so the first pending byte starts no frame.
             * Reset `ask_at`, which described the discarded byte. */
            receiver->from++;
            receiver->ask_at = 0U;
            sbus_count_discarded(receiver, SBUS_LINE_EVENT, 1U);
        }
    }
    sbus_forget(receiver);
}
#endif

#endif
