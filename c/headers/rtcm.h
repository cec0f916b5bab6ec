/* Frames of rtcm. Made by `framelock generate --frame rtcm --language c`, version 0.1.0; do not edit.
 * SPDX-License-Identifier: 0BSD
 * You may use, change and ship this file without conditions.
 *
 * This header needs only a C99 or C++17 compiler. It allocates no memory and does not recurse.
 *
 *   static rtcm_receiver receiver;
 *   rtcm_message message;
 *
 *   rtcm_init(&receiver);
 *   if (rtcm_push(&receiver, byte, &message)) { ... }     for each received byte
 *   rtcm_line_event(&receiver, RTCM_FRAMING_ERROR, received, NULL);     instead of a damaged byte
 *
 * The counters satisfy this equation at any time, modulo 2^32:
 * counters.bytes == counters.frame_bytes + the sum of counters.discarded + rtcm_pending(&receiver).
 *
 * Calls for one receiver must not interrupt each other. All functions are `static inline`. If several source files need
 * them, define RTCM_DEFINITIONS as 1 in one of these files, and as 0 in the others, before they include this header:
 * then there is one copy of the code. */
#ifndef RTCM_H
#define RTCM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifndef RTCM_DEFINITIONS
#define RTCM_FUNCTION static inline
#elif defined(__cplusplus)
#define RTCM_FUNCTION extern "C"
#else
#define RTCM_FUNCTION
#endif

/* The number of bytes in the longest frame. */
#define RTCM_LONGEST 1029U

/* The number of bytes in a receiver's buffer. With room for two longest frames, pending bytes are seldom moved. */
#ifndef RTCM_ROOM
#define RTCM_ROOM (2U * RTCM_LONGEST)
#endif
#if (RTCM_ROOM < RTCM_LONGEST) || (RTCM_ROOM > 64506U)
#error "RTCM_ROOM must be between RTCM_LONGEST and 64506"
#endif

/* The outcome of a classification: a frame, incomplete, or the reason why bytes are discarded. */
typedef enum {
    RTCM_NO_SYNC, /* no frame begins with them */
    RTCM_BAD_HEADER, /* the length is too small, or fixed bits are wrong */
    RTCM_CHECKSUM_MISMATCH, /* the checksum is wrong */
    RTCM_LINE_EVENT, /* pending at a line event */
    RTCM_REASONS, /* the number of reasons */
    RTCM_FRAME = RTCM_REASONS, /* a frame */
    RTCM_INCOMPLETE /* more bytes are needed */
} rtcm_outcome;

/* An event on the line, which the UART or a timer notices. */
typedef enum {
    RTCM_FRAMING_ERROR,
    RTCM_PARITY_ERROR,
    RTCM_OVERRUN,
    RTCM_BREAK,
    RTCM_IDLE_LINE,
    RTCM_EVENTS /* the number of events */
} rtcm_event;

/* Counters. They wrap at 2^32. */
typedef struct {
    uint32_t bytes; /* received bytes */
    uint32_t frames; /* frames */
    uint32_t frame_bytes; /* bytes in frames */
    uint32_t resynchronisations; /* frames that follow discarded bytes */
    uint32_t discarded[RTCM_REASONS]; /* discarded bytes, by reason */
    uint32_t events[RTCM_EVENTS]; /* line events */
} rtcm_counters;

/* The values of a frame. Pointers are valid until the next call for the receiver. */
typedef struct {
    /* At 3: bytes. */
    const uint8_t *payload;
    uint16_t payload_length;
} rtcm_message;

/* A receiver. Read `counters`; the other members are private. */
typedef struct {
    rtcm_counters counters;
    uint16_t from; /* the pending bytes are buffer[from] to buffer[to - 1] */
    uint16_t to;
    uint16_t ask_at; /* the next decision is possible when `to` reaches this index */
    bool is_lost; /* bytes were discarded since the last frame */
    uint8_t buffer[RTCM_ROOM];
} rtcm_receiver;

/* Starts a receiver. All counters are 0. */
RTCM_FUNCTION void rtcm_init(rtcm_receiver *receiver);

/* Returns the number of pending bytes, which may still become part of a frame. */
RTCM_FUNCTION uint32_t rtcm_pending(const rtcm_receiver *receiver);

/* Takes the next byte. If a frame is complete, returns true and writes its values to `*message`. Classifies bytes at most
 * once. So after a false start a complete frame may stay pending, until the following calls catch up. */
RTCM_FUNCTION bool rtcm_push(rtcm_receiver *receiver, uint8_t byte, rtcm_message *message);

/* Decides about pending bytes up to the next frame. If a frame is found, returns true and writes its values to
 * `*message`. If no byte follows soon, call this function until it returns false. */
RTCM_FUNCTION bool rtcm_poll(rtcm_receiver *receiver, rtcm_message *message);

/* Reports a line event: no more bytes follow the pending bytes. Calls `received` with each frame among them, and
 * discards the other bytes. `received` may be NULL. */
RTCM_FUNCTION void rtcm_line_event(rtcm_receiver *receiver, rtcm_event event,
    void (*received)(void *context, const rtcm_message *message), void *context);

/* Reads the values of a frame. */
RTCM_FUNCTION void rtcm_decode(const uint8_t *frame, uint16_t length, rtcm_message *message);

/* Writes a frame with these values. Returns its length, or 0 if `room` is too small or no frame has these values. */
RTCM_FUNCTION size_t rtcm_encode(const rtcm_message *message, uint8_t *frame, size_t room);

#if !defined(RTCM_DEFINITIONS) || RTCM_DEFINITIONS

/* On AVR, tables stay in flash. */
#ifdef __AVR__
#include <avr/pgmspace.h>
#define RTCM_IN_FLASH PROGMEM
#define RTCM_READ_8(entry) pgm_read_byte(entry)
#define RTCM_READ_16(entry) pgm_read_word(entry)
#define RTCM_READ_32(entry) pgm_read_dword(entry)
#else
#define RTCM_IN_FLASH
#define RTCM_READ_8(entry) (*(entry))
#define RTCM_READ_16(entry) (*(entry))
#define RTCM_READ_32(entry) (*(entry))
#endif

/* Sets bytes to 0. */
static inline void rtcm_clear(void *object, size_t size)
{
    uint8_t *byte = (uint8_t *)object;

    while (size > 0U) {
        *byte = 0U;
        byte++;
        size--;
    }
}

/* Returns whether bytes are equal. */
static inline bool rtcm_same(const void *one, const void *other, size_t size)
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
static inline uint16_t rtcm_be16(const uint8_t *bytes)
{
    return (uint16_t)(((unsigned)bytes[0] << 8U) | bytes[1]);
}

/* Reads a number of three bytes, big-endian. */
static inline uint32_t rtcm_be24(const uint8_t *bytes)
{
    return ((uint32_t)bytes[0] << 16U) | ((uint32_t)bytes[1] << 8U) | bytes[2];
}

/* Writes bytes by setting those bits that are 1. */
static inline void rtcm_put(uint8_t *to, const uint8_t *bytes, size_t count)
{
    size_t i;

    for (i = 0U; i < count; i++) {
        to[i] = (uint8_t)(to[i] | bytes[i]);
    }
}

/* Returns whether a frame can begin with this byte. */
static inline bool rtcm_starts(uint8_t byte)
{
    return byte == 0xD3U;
}

/* Returns the CRC of bytes. */
static inline uint32_t rtcm_checksum(const uint8_t *bytes, uint16_t count)
{
    /* The remainder of each value of four bits. */
    static const uint32_t table[16] RTCM_IN_FLASH = {
        0x00000000U, 0x864CFB00U, 0x8AD50D00U, 0x0C99F600U, 0x93E6E100U, 0x15AA1A00U, 0x1933EC00U, 0x9F7F1700U,
        0xA1813900U, 0x27CDC200U, 0x2B543400U, 0xAD18CF00U, 0x3267D800U, 0xB42B2300U, 0xB8B2D500U, 0x3EFE2E00U
    };
    uint32_t sum = 0x0U;
    uint16_t i;

    for (i = 0U; i < count; i++) {
        const uint8_t byte = bytes[i];

        sum = (uint32_t)(sum ^ ((uint32_t)byte << 24U));
        sum = (uint32_t)(((uint32_t)sum << 4U) ^ RTCM_READ_32(&table[sum >> 28U]));
        sum = (uint32_t)(((uint32_t)sum << 4U) ^ RTCM_READ_32(&table[sum >> 28U]));
    }
    sum = (uint32_t)(sum >> 8U);
    return sum;
}

/* Classifies one byte or more. The first `seen` bytes must be incomplete; `seen` may be 0. If the bytes begin with a
 * frame, sets `*number` to its length. If they are incomplete, sets `*number` to the number of bytes needed to decide
 * more. */
static inline rtcm_outcome rtcm_classify(const uint8_t *bytes, uint16_t count, uint16_t seen, uint16_t *number)
{
    uint16_t field;
    uint16_t length;

    (void)seen;
    /* The sync. */
    if (!rtcm_starts(bytes[0])) {
        return RTCM_NO_SYNC;
    }
    if (count < 3U) {
        *number = 3U;
        return RTCM_INCOMPLETE;
    }
    /* The header. */
    if ((bytes[1U] & 0xFCU) != 0x00U) {
        return RTCM_BAD_HEADER;
    }
    field = (uint16_t)(rtcm_be16(&bytes[1U]) & 0x3FFU);
    length = (uint16_t)(field + 6U);
    if (count < length) {
        *number = length;
        return RTCM_INCOMPLETE;
    }
    /* The checksum. */
    if (rtcm_checksum(&bytes[0U], (uint16_t)(length - 3U)) != rtcm_be24(&bytes[length - 3U])) {
        return RTCM_CHECKSUM_MISMATCH;
    }
    *number = length;
    return RTCM_FRAME;
}

RTCM_FUNCTION void rtcm_decode(const uint8_t *frame, uint16_t length, rtcm_message *message)
{
    message->payload = &frame[3U];
    message->payload_length = (uint16_t)(length - 6U);
}

RTCM_FUNCTION size_t rtcm_encode(const rtcm_message *message, uint8_t *frame, size_t room)
{

    size_t size = 6U;
    uint16_t length;
    uint16_t number = 0U;
    uint32_t field;
    uint32_t sum;
    rtcm_message again;

    if (message->payload_length > 1029U) {
        return 0U;
    }
    size += message->payload_length;
    length = (uint16_t)size;
    if ((size > 1029U) || (room < size)) {
        return 0U;
    }
    rtcm_clear(frame, size);
    rtcm_put(&frame[3U], message->payload, message->payload_length);
    frame[0] = 0xD3U;
    field = (uint32_t)length - 6U;
    frame[1U] = (uint8_t)((frame[1U] & 0xFCU) | ((field >> 8U) & 0x03U));
    frame[2U] = (uint8_t)field;
    frame[1U] = (uint8_t)((frame[1U] & 0x03U) | 0x00U);
    sum = rtcm_checksum(&frame[0U], (uint16_t)(length - 3U));
    frame[length - 3U] = (uint8_t)(sum >> 16U);
    frame[length - 2U] = (uint8_t)(sum >> 8U);
    frame[length - 1U] = (uint8_t)sum;
    /* Fail if a value is outside its field's range, or contradicts another part of the frame. */
    length = (uint16_t)size;
    if ((rtcm_classify(frame, length, 0U, &number) != RTCM_FRAME) || (number != length)) {
        return 0U;
    }
    rtcm_decode(frame, length, &again);
    if ((again.payload_length != message->payload_length) || !rtcm_same(again.payload, message->payload, again.payload_length)) {
        return 0U;
    }
    return size;
}

RTCM_FUNCTION void rtcm_init(rtcm_receiver *receiver)
{
    rtcm_clear(receiver, sizeof *receiver);
}

RTCM_FUNCTION uint32_t rtcm_pending(const rtcm_receiver *receiver)
{
    return (uint32_t)receiver->to - receiver->from;
}

static inline void rtcm_count_discarded(rtcm_receiver *receiver, rtcm_outcome reason, uint16_t count)
{
    receiver->counters.discarded[reason] += count;
    receiver->is_lost = true;
}

static inline void rtcm_count_frame(rtcm_receiver *receiver, uint16_t length)
{
    receiver->counters.frames++;
    receiver->counters.frame_bytes += length;
    if (receiver->is_lost) {
        receiver->is_lost = false;
        receiver->counters.resynchronisations++;
    }
}

/* Forgets the pending bytes. */
static inline void rtcm_forget(rtcm_receiver *receiver)
{
    receiver->from = 0U;
    receiver->to = 0U;
    receiver->ask_at = 0U;
}

/* Decides about the first pending bytes. Classifies bytes at most once. If they are a frame, moves `from` past it and
 * returns its length, otherwise returns 0. Sets `*again` to false if the next decision needs more bytes. */
static inline uint16_t rtcm_next(rtcm_receiver *receiver, bool *again)
{
    rtcm_outcome outcome;
    uint16_t number = 0U;
    uint16_t seen;
    const uint16_t start = receiver->from;

    *again = false;
    if (receiver->to < receiver->ask_at) {
        return 0U;
    }
    /* If the first byte has not been classified yet, skip bytes that cannot begin a frame. */
    if (receiver->ask_at <= (receiver->from + 1U)) {
        while ((receiver->from < receiver->to) && !rtcm_starts(receiver->buffer[receiver->from])) {
            receiver->from++;
        }
        if (receiver->from > start) {
            rtcm_count_discarded(receiver, RTCM_NO_SYNC, (uint16_t)(receiver->from - start));
            receiver->ask_at = 0U;
        }
    }
    if (receiver->from == receiver->to) {
        rtcm_forget(receiver);
        return 0U;
    }
    seen = (receiver->ask_at > receiver->from) ? (uint16_t)(receiver->ask_at - (receiver->from + 1U)) : (uint16_t)0U;
    receiver->ask_at = 0U;
    outcome = rtcm_classify(&receiver->buffer[receiver->from], (uint16_t)(receiver->to - receiver->from), seen, &number);
    if (outcome == RTCM_INCOMPLETE) {
        receiver->ask_at = (uint16_t)(receiver->from + number);
        return 0U;
    }
    *again = true;
    if (outcome == RTCM_FRAME) {
        receiver->from = (uint16_t)(receiver->from + number);
        rtcm_count_frame(receiver, number);
        return number;
    }
    receiver->from++;
    rtcm_count_discarded(receiver, outcome, 1U);
    return 0U;
}

/* Moves the pending bytes to the front of the buffer. */
static inline void rtcm_move_to_front(rtcm_receiver *receiver)
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

RTCM_FUNCTION bool rtcm_push(rtcm_receiver *receiver, uint8_t byte, rtcm_message *message)
{
    uint16_t length;
    bool again;

    receiver->counters.bytes++;
    if (((receiver->to + 1U) < receiver->ask_at) && (receiver->to < RTCM_ROOM)) {
        /* No decision is possible yet: only store the byte. */
        receiver->buffer[receiver->to] = byte;
        receiver->to++;
        return false;
    }
    if (receiver->from == receiver->to) {
        rtcm_forget(receiver);
        if (!rtcm_starts(byte)) {
            rtcm_count_discarded(receiver, RTCM_NO_SYNC, 1U);
            return false;
        }
    }
    if (receiver->to == RTCM_ROOM) {
        rtcm_move_to_front(receiver);
    }
    receiver->buffer[receiver->to] = byte;
    receiver->to++;
    length = rtcm_next(receiver, &again);
    if (length == 0U) {
        return false;
    }
    rtcm_decode(&receiver->buffer[receiver->from - length], length, message);
    return true;
}

RTCM_FUNCTION bool rtcm_poll(rtcm_receiver *receiver, rtcm_message *message)
{
    uint16_t length;
    bool again;

    /* Each iteration except the last decides about at least one pending byte. */
    do {
        length = rtcm_next(receiver, &again);
        if (length > 0U) {
            rtcm_decode(&receiver->buffer[receiver->from - length], length, message);
            return true;
        }
    } while (again);
    return false;
}

RTCM_FUNCTION void rtcm_line_event(rtcm_receiver *receiver, rtcm_event event,
    void (*received)(void *context, const rtcm_message *message), void *context)
{
    rtcm_message message;

    receiver->counters.events[event]++;
    while (receiver->from < receiver->to) {
        if (rtcm_poll(receiver, &message)) {
            if (received != NULL) {
                received(context, &message);
            }
        } else if (receiver->from < receiver->to) {
            /* No more bytes follow, so the first pending byte starts no frame.
             * Reset `ask_at`, which described the discarded byte. */
            receiver->from++;
            receiver->ask_at = 0U;
            rtcm_count_discarded(receiver, RTCM_LINE_EVENT, 1U);
        }
    }
    rtcm_forget(receiver);
}
#endif

#endif
