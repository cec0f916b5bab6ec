/* Frames of nmea. Made by `framelock generate --frame nmea --language c`, version 0.1.0; do not edit.
 * SPDX-License-Identifier: 0BSD
 * You may use, change and ship this file without conditions.
 *
 * This header needs only a C99 or C++17 compiler. It allocates no memory and does not recurse.
 *
 *   static nmea_receiver receiver;
 *   nmea_message message;
 *
 *   nmea_init(&receiver);
 *   if (nmea_push(&receiver, byte, &message)) { ... }     for each received byte
 *   nmea_line_event(&receiver, NMEA_FRAMING_ERROR, received, NULL);     instead of a damaged byte
 *
 * The counters satisfy this equation at any time, modulo 2^32:
 * counters.bytes == counters.frame_bytes + the sum of counters.discarded + nmea_pending(&receiver).
 *
 * Calls for one receiver must not interrupt each other. All functions are `static inline`. If several source files need
 * them, define NMEA_DEFINITIONS as 1 in one of these files, and as 0 in the others, before they include this header:
 * then there is one copy of the code. */
#ifndef NMEA_H
#define NMEA_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifndef NMEA_DEFINITIONS
#define NMEA_FUNCTION static inline
#elif defined(__cplusplus)
#define NMEA_FUNCTION extern "C"
#else
#define NMEA_FUNCTION
#endif

/* The number of bytes in the longest frame. */
#define NMEA_LONGEST 515U

/* The number of bytes in a receiver's buffer. With room for two longest frames, pending bytes are seldom moved. */
#ifndef NMEA_ROOM
#define NMEA_ROOM (2U * NMEA_LONGEST)
#endif
#if (NMEA_ROOM < NMEA_LONGEST) || (NMEA_ROOM > 65020U)
#error "NMEA_ROOM must be between NMEA_LONGEST and 65020"
#endif

/* The outcome of a classification: a frame, incomplete, or the reason why bytes are discarded. */
typedef enum {
    NMEA_NO_SYNC, /* no frame begins with them */
    NMEA_BAD_HEADER, /* the length is too small, or fixed bits are wrong */
    NMEA_CHECKSUM_MISMATCH, /* the checksum is wrong */
    NMEA_WRONG_TERMINATOR, /* the terminator or fixed bits are wrong */
    NMEA_LINE_EVENT, /* pending at a line event */
    NMEA_REASONS, /* the number of reasons */
    NMEA_FRAME = NMEA_REASONS, /* a frame */
    NMEA_INCOMPLETE /* more bytes are needed */
} nmea_outcome;

/* An event on the line, which the UART or a timer notices. */
typedef enum {
    NMEA_FRAMING_ERROR,
    NMEA_PARITY_ERROR,
    NMEA_OVERRUN,
    NMEA_BREAK,
    NMEA_IDLE_LINE,
    NMEA_EVENTS /* the number of events */
} nmea_event;

/* Counters. They wrap at 2^32. */
typedef struct {
    uint32_t bytes; /* received bytes */
    uint32_t frames; /* frames */
    uint32_t frame_bytes; /* bytes in frames */
    uint32_t resynchronisations; /* frames that follow discarded bytes */
    uint32_t discarded[NMEA_REASONS]; /* discarded bytes, by reason */
    uint32_t events[NMEA_EVENTS]; /* line events */
} nmea_counters;

/* The values of a frame. Pointers are valid until the next call for the receiver. */
typedef struct {
    /* At 0: text. */
    uint8_t start[1];
    /* At 1: text. */
    const uint8_t *sentence;
    uint16_t sentence_length;
} nmea_message;

/* A receiver. Read `counters`; the other members are private. */
typedef struct {
    nmea_counters counters;
    uint16_t from; /* the pending bytes are buffer[from] to buffer[to - 1] */
    uint16_t to;
    uint16_t ask_at; /* the next decision is possible when `to` reaches this index */
    bool is_lost; /* bytes were discarded since the last frame */
    uint8_t buffer[NMEA_ROOM];
} nmea_receiver;

/* Starts a receiver. All counters are 0. */
NMEA_FUNCTION void nmea_init(nmea_receiver *receiver);

/* Returns the number of pending bytes, which may still become part of a frame. */
NMEA_FUNCTION uint32_t nmea_pending(const nmea_receiver *receiver);

/* Takes the next byte. If a frame is complete, returns true and writes its values to `*message`. Classifies bytes at most
 * once. So after a false start a complete frame may stay pending, until the following calls catch up. */
NMEA_FUNCTION bool nmea_push(nmea_receiver *receiver, uint8_t byte, nmea_message *message);

/* Decides about pending bytes up to the next frame. If a frame is found, returns true and writes its values to
 * `*message`. If no byte follows soon, call this function until it returns false. */
NMEA_FUNCTION bool nmea_poll(nmea_receiver *receiver, nmea_message *message);

/* Reports a line event: no more bytes follow the pending bytes. Calls `received` with each frame among them, and
 * discards the other bytes. `received` may be NULL. */
NMEA_FUNCTION void nmea_line_event(nmea_receiver *receiver, nmea_event event,
    void (*received)(void *context, const nmea_message *message), void *context);

/* Reads the values of a frame. */
NMEA_FUNCTION void nmea_decode(const uint8_t *frame, uint16_t length, nmea_message *message);

/* Writes a frame with these values. Returns its length, or 0 if `room` is too small or no frame has these values. */
NMEA_FUNCTION size_t nmea_encode(const nmea_message *message, uint8_t *frame, size_t room);

#if !defined(NMEA_DEFINITIONS) || NMEA_DEFINITIONS

/* Sets bytes to 0. */
static inline void nmea_clear(void *object, size_t size)
{
    uint8_t *byte = (uint8_t *)object;

    while (size > 0U) {
        *byte = 0U;
        byte++;
        size--;
    }
}

/* Copies bytes. */
static inline void nmea_copy(void *to, const void *from, size_t size)
{
    uint8_t *byte = (uint8_t *)to;
    const uint8_t *source = (const uint8_t *)from;

    while (size > 0U) {
        *byte = *source;
        byte++;
        source++;
        size--;
    }
}

/* Returns whether bytes are equal. */
static inline bool nmea_same(const void *one, const void *other, size_t size)
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

/* Writes bytes by setting those bits that are 1. */
static inline void nmea_put(uint8_t *to, const uint8_t *bytes, size_t count)
{
    size_t i;

    for (i = 0U; i < count; i++) {
        to[i] = (uint8_t)(to[i] | bytes[i]);
    }
}

/* Returns the value of a hexadecimal digit, or 16 for any other character. */
static inline uint8_t nmea_digit(uint8_t digit)
{
    if ((digit >= 0x30U) && (digit <= 0x39U)) {
        return (uint8_t)(digit - 0x30U);
    }
    digit = (uint8_t)(digit | 0x20U); /* lower case */
    if ((digit >= 0x61U) && (digit <= 0x66U)) {
        return (uint8_t)(digit - 0x57U);
    }
    return 16U;
}

/* Writes a number in hexadecimal digits. */
static inline void nmea_put_hex(uint8_t *to, uint32_t number, uint8_t bits)
{
    while (bits > 0U) {
        uint8_t digit;

        bits = (uint8_t)(bits - 4U);
        digit = (uint8_t)((number >> bits) & 0x0FU);
        *to = (uint8_t)((digit < 10U) ? (0x30U + digit) : (0x37U + digit));
        to++;
    }
}

/* Returns whether a frame can begin with this byte. */
static inline bool nmea_starts(uint8_t byte)
{
    return (byte == 0x24U) || (byte == 0x21U);
}

/* Returns the exclusive or of bytes. */
static inline uint8_t nmea_checksum(const uint8_t *bytes, uint16_t count)
{
    uint8_t sum = 0U;
    uint16_t i;

    for (i = 0U; i < count; i++) {
        const uint8_t byte = bytes[i];

        sum = (uint8_t)(sum ^ byte);
    }
    return sum;
}

/* Returns whether this byte can be between the sync and the terminator. */
static inline bool nmea_is_content(uint8_t byte)
{
    return ((byte >= 0x25U) && (byte <= 0x7EU)) || ((byte >= 0x22U) && (byte <= 0x23U)) || (byte == 0x20U);
}

/* Returns the length of the terminator at the beginning of the bytes. Returns 0 if more bytes are needed to know it, and
 * 4 if the bytes begin with no terminator. */
static inline uint16_t nmea_terminator(const uint8_t *bytes, uint16_t count)
{
    if ((count >= 2U) && (bytes[0U] == 0x0DU) && (bytes[1U] == 0x0AU)) {
        return 2U;
    }
    if (bytes[0U] == 0x0AU) {
        return 1U;
    }
    if ((count >= 3U) && (bytes[0U] == 0x0DU) && (bytes[1U] == 0x0DU) && (bytes[2U] == 0x0AU)) {
        return 3U;
    }
    if ((count < 2U) && (bytes[0U] == 0x0DU) && ((count <= 1U) || (bytes[1U] == 0x0AU))) {
        return 0U;
    }
    if ((count < 3U) && (bytes[0U] == 0x0DU) && ((count <= 1U) || (bytes[1U] == 0x0DU)) && ((count <= 2U) || (bytes[2U] == 0x0AU))) {
        return 0U;
    }
    return 4U;
}

/* Returns the length that the frame would have with the first terminator. Positions count from there. */
static inline uint16_t nmea_counted(const uint8_t *bytes, uint16_t length)
{
    if ((length >= 3U) && (bytes[length - 3U] == 0x0DU) && (bytes[length - 2U] == 0x0DU) && (bytes[length - 1U] == 0x0AU)) {
        return (uint16_t)(length - 1U);
    }
    if ((length >= 2U) && (bytes[length - 2U] == 0x0DU) && (bytes[length - 1U] == 0x0AU)) {
        return length;
    }
    if ((length >= 1U) && (bytes[length - 1U] == 0x0AU)) {
        return (uint16_t)(length + 1U);
    }
    return length;
}

/* Returns whether these hexadecimal digits have this value. */
static inline bool nmea_has_value(const uint8_t *digits, uint8_t value)
{
    uint8_t shift = 8U;
    uint8_t i = 0U;

    while (shift > 0U) {
        shift = (uint8_t)(shift - 4U);
        if (nmea_digit(digits[i]) != ((uint8_t)(value >> shift) & 0x0FU)) {
            return false;
        }
        i++;
    }
    return true;
}

/* Classifies one byte or more. The first `seen` bytes must be incomplete; `seen` may be 0. If the bytes begin with a
 * frame, sets `*number` to its length. If they are incomplete, sets `*number` to the number of bytes needed to decide
 * more. */
static inline nmea_outcome nmea_classify(const uint8_t *bytes, uint16_t count, uint16_t seen, uint16_t *number)
{
    uint16_t length;
    uint16_t whole;
    uint16_t at;
    uint16_t width;
    uint8_t sum;

    /* The sync. */
    if (!nmea_starts(bytes[0])) {
        return NMEA_NO_SYNC;
    }
    /* The first terminator ends the frame. The first `seen` bytes have already been searched for it. */
    at = (seen > 3U) ? (uint16_t)(seen - 2U) : 1U;
    while ((at < count) && nmea_is_content(bytes[at])) {
        at++;
    }
    width = (at < count) ? nmea_terminator(&bytes[at], (uint16_t)(count - at)) : (uint16_t)0U;
    if (width > 3U) {
        return NMEA_WRONG_TERMINATOR;
    }
    if (width == 0U) {
        if (count >= 515U) {
            return NMEA_WRONG_TERMINATOR;
        }
        *number = (uint16_t)(count + 1U);
        return NMEA_INCOMPLETE;
    }
    length = (uint16_t)(at + 2U);
    if (length < 7U) {
        return NMEA_BAD_HEADER;
    }
    whole = (uint16_t)(at + width);
    /* The bits that are the same in each frame. */
    if (bytes[length - 5U] != 0x2AU) {
        return NMEA_WRONG_TERMINATOR;
    }
    /* The checksum. */
    sum = nmea_checksum(&bytes[1U], (uint16_t)(length - 6U));
    if (!nmea_has_value(&bytes[length - 4U], sum)) {
        return NMEA_CHECKSUM_MISMATCH;
    }
    *number = whole;
    return NMEA_FRAME;
}

NMEA_FUNCTION void nmea_decode(const uint8_t *frame, uint16_t length, nmea_message *message)
{
    length = nmea_counted(frame, length);
    nmea_copy(message->start, &frame[0U], 1U);
    message->sentence = &frame[1U];
    message->sentence_length = (uint16_t)(length - 6U);
}

NMEA_FUNCTION size_t nmea_encode(const nmea_message *message, uint8_t *frame, size_t room)
{

    size_t size = 7U;
    uint16_t length;
    uint16_t number = 0U;
    uint8_t sum;
    nmea_message again;

    if (message->sentence_length > 515U) {
        return 0U;
    }
    if ((size < ((size_t)6U + message->sentence_length))) {
        size = (size_t)6U + message->sentence_length;
    }
    length = (uint16_t)size;
    if ((size > 515U) || (room < size)) {
        return 0U;
    }
    nmea_clear(frame, size);
    nmea_put(&frame[0U], message->start, 1U);
    nmea_put(&frame[1U], message->sentence, message->sentence_length);
    if (!nmea_starts(frame[0])) {
        frame[0] = 0x24U;
    }
    frame[length - 5U] = 0x2AU;
    frame[length - 2U] = 0x0DU;
    frame[length - 1U] = 0x0AU;
    sum = nmea_checksum(&frame[1U], (uint16_t)(length - 6U));
    nmea_put_hex(&frame[length - 4U], sum, 8U);
    /* Fail if a value is outside its field's range, or contradicts another part of the frame. */
    length = (uint16_t)size;
    if ((nmea_classify(frame, length, 0U, &number) != NMEA_FRAME) || (number != length)) {
        return 0U;
    }
    nmea_decode(frame, length, &again);
    if (!nmea_same(&again.start, &message->start, sizeof again.start)) {
        return 0U;
    }
    if ((again.sentence_length != message->sentence_length) || !nmea_same(again.sentence, message->sentence, again.sentence_length)) {
        return 0U;
    }
    return size;
}

NMEA_FUNCTION void nmea_init(nmea_receiver *receiver)
{
    nmea_clear(receiver, sizeof *receiver);
}

NMEA_FUNCTION uint32_t nmea_pending(const nmea_receiver *receiver)
{
    return (uint32_t)receiver->to - receiver->from;
}

static inline void nmea_count_discarded(nmea_receiver *receiver, nmea_outcome reason, uint16_t count)
{
    receiver->counters.discarded[reason] += count;
    receiver->is_lost = true;
}

static inline void nmea_count_frame(nmea_receiver *receiver, uint16_t length)
{
    receiver->counters.frames++;
    receiver->counters.frame_bytes += length;
    if (receiver->is_lost) {
        receiver->is_lost = false;
        receiver->counters.resynchronisations++;
    }
}

/* Forgets the pending bytes. */
static inline void nmea_forget(nmea_receiver *receiver)
{
    receiver->from = 0U;
    receiver->to = 0U;
    receiver->ask_at = 0U;
}

/* Decides about the first pending bytes. Classifies bytes at most once. If they are a frame, moves `from` past it and
 * returns its length, otherwise returns 0. Sets `*again` to false if the next decision needs more bytes. */
static inline uint16_t nmea_next(nmea_receiver *receiver, bool *again)
{
    nmea_outcome outcome;
    uint16_t number = 0U;
    uint16_t seen;
    const uint16_t start = receiver->from;

    *again = false;
    if (receiver->to < receiver->ask_at) {
        return 0U;
    }
    /* If the first byte has not been classified yet, skip bytes that cannot begin a frame. */
    if (receiver->ask_at <= (receiver->from + 1U)) {
        while ((receiver->from < receiver->to) && !nmea_starts(receiver->buffer[receiver->from])) {
            receiver->from++;
        }
        if (receiver->from > start) {
            nmea_count_discarded(receiver, NMEA_NO_SYNC, (uint16_t)(receiver->from - start));
            receiver->ask_at = 0U;
        }
    }
    if (receiver->from == receiver->to) {
        nmea_forget(receiver);
        return 0U;
    }
    seen = (receiver->ask_at > receiver->from) ? (uint16_t)(receiver->ask_at - (receiver->from + 1U)) : (uint16_t)0U;
    receiver->ask_at = 0U;
    outcome = nmea_classify(&receiver->buffer[receiver->from], (uint16_t)(receiver->to - receiver->from), seen, &number);
    if (outcome == NMEA_INCOMPLETE) {
        receiver->ask_at = (uint16_t)(receiver->from + number);
        return 0U;
    }
    *again = true;
    if (outcome == NMEA_FRAME) {
        receiver->from = (uint16_t)(receiver->from + number);
        nmea_count_frame(receiver, number);
        return number;
    }
    receiver->from++;
    nmea_count_discarded(receiver, outcome, 1U);
    return 0U;
}

/* Moves the pending bytes to the front of the buffer. */
static inline void nmea_move_to_front(nmea_receiver *receiver)
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

NMEA_FUNCTION bool nmea_push(nmea_receiver *receiver, uint8_t byte, nmea_message *message)
{
    uint16_t length;
    bool again;

    receiver->counters.bytes++;
    if (((receiver->to + 1U) < receiver->ask_at) && (receiver->to < NMEA_ROOM)) {
        /* No decision is possible yet: only store the byte. */
        receiver->buffer[receiver->to] = byte;
        receiver->to++;
        return false;
    }
    if (receiver->from == receiver->to) {
        nmea_forget(receiver);
        if (!nmea_starts(byte)) {
            nmea_count_discarded(receiver, NMEA_NO_SYNC, 1U);
            return false;
        }
    }
    if (receiver->to == NMEA_ROOM) {
        nmea_move_to_front(receiver);
    }
    receiver->buffer[receiver->to] = byte;
    receiver->to++;
    length = nmea_next(receiver, &again);
    if (length == 0U) {
        return false;
    }
    nmea_decode(&receiver->buffer[receiver->from - length], length, message);
    return true;
}

NMEA_FUNCTION bool nmea_poll(nmea_receiver *receiver, nmea_message *message)
{
    uint16_t length;
    bool again;

    /* Each iteration except the last decides about at least one pending byte. */
    do {
        length = nmea_next(receiver, &again);
        if (length > 0U) {
            nmea_decode(&receiver->buffer[receiver->from - length], length, message);
            return true;
        }
    } while (again);
    return false;
}

NMEA_FUNCTION void nmea_line_event(nmea_receiver *receiver, nmea_event event,
    void (*received)(void *context, const nmea_message *message), void *context)
{
    nmea_message message;

    receiver->counters.events[event]++;
    while (receiver->from < receiver->to) {
        if (nmea_poll(receiver, &message)) {
            if (received != NULL) {
                received(context, &message);
            }
        } else if (receiver->from < receiver->to) {
            /* No more bytes follow, so the first pending byte starts no frame.
             * Reset `ask_at`, which described the discarded byte. */
            receiver->from++;
            receiver->ask_at = 0U;
            nmea_count_discarded(receiver, NMEA_LINE_EVENT, 1U);
        }
    }
    nmea_forget(receiver);
}
#endif

#endif
