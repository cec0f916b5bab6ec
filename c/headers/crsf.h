/* Frames of crsf. Made by `framelock generate --frame crsf --language c`, version 0.1.0; do not edit.
 * SPDX-License-Identifier: 0BSD
 * You may use, change and ship this file without conditions.
 *
 * This header needs only a C99 or C++17 compiler. It allocates no memory and does not recurse.
 *
 *   static crsf_receiver receiver;
 *   crsf_message message;
 *
 *   crsf_init(&receiver);
 *   if (crsf_push(&receiver, byte, &message)) { ... }     for each received byte
 *   crsf_line_event(&receiver, CRSF_FRAMING_ERROR, received, NULL);     instead of a damaged byte
 *
 * The counters satisfy this equation at any time, modulo 2^32:
 * counters.bytes == counters.frame_bytes + the sum of counters.discarded + crsf_pending(&receiver).
 *
 * Calls for one receiver must not interrupt each other. All functions are `static inline`. If several source files need
 * them, define CRSF_DEFINITIONS as 1 in one of these files, and as 0 in the others, before they include this header:
 * then there is one copy of the code. */
#ifndef CRSF_H
#define CRSF_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifndef CRSF_DEFINITIONS
#define CRSF_FUNCTION static inline
#elif defined(__cplusplus)
#define CRSF_FUNCTION extern "C"
#else
#define CRSF_FUNCTION
#endif

/* The number of bytes in the longest frame. */
#define CRSF_LONGEST 64U

/* The number of bytes in a receiver's buffer. With room for two longest frames, pending bytes are seldom moved. */
#ifndef CRSF_ROOM
#define CRSF_ROOM (2U * CRSF_LONGEST)
#endif
#if (CRSF_ROOM < CRSF_LONGEST) || (CRSF_ROOM > 191U)
#error "CRSF_ROOM must be between CRSF_LONGEST and 191"
#endif

/* The outcome of a classification: a frame, incomplete, or the reason why bytes are discarded. */
typedef enum {
    CRSF_NO_SYNC, /* no frame begins with them */
    CRSF_BAD_HEADER, /* the length is too small, or fixed bits are wrong */
    CRSF_TOO_LONG, /* the length is too great */
    CRSF_CHECKSUM_MISMATCH, /* the checksum is wrong */
    CRSF_LINE_EVENT, /* pending at a line event */
    CRSF_REASONS, /* the number of reasons */
    CRSF_FRAME = CRSF_REASONS, /* a frame */
    CRSF_INCOMPLETE /* more bytes are needed */
} crsf_outcome;

/* An event on the line, which the UART or a timer notices. */
typedef enum {
    CRSF_FRAMING_ERROR,
    CRSF_PARITY_ERROR,
    CRSF_OVERRUN,
    CRSF_BREAK,
    CRSF_IDLE_LINE,
    CRSF_EVENTS /* the number of events */
} crsf_event;

/* Counters. They wrap at 2^32. */
typedef struct {
    uint32_t bytes; /* received bytes */
    uint32_t frames; /* frames */
    uint32_t frame_bytes; /* bytes in frames */
    uint32_t resynchronisations; /* frames that follow discarded bytes */
    uint32_t discarded[CRSF_REASONS]; /* discarded bytes, by reason */
    uint32_t events[CRSF_EVENTS]; /* line events */
} crsf_counters;

/* The values of a frame. Pointers are valid until the next call for the receiver. */
typedef struct {
    /* At 0: u8. */
    uint8_t address;
    /* At 2: u8. */
    uint8_t type;
    /* At 3: bytes. */
    const uint8_t *payload;
    uint8_t payload_length;
} crsf_message;

/* A receiver. Read `counters`; the other members are private. */
typedef struct {
    crsf_counters counters;
    uint8_t from; /* the pending bytes are buffer[from] to buffer[to - 1] */
    uint8_t to;
    uint8_t ask_at; /* the next decision is possible when `to` reaches this index */
    bool is_lost; /* bytes were discarded since the last frame */
    uint8_t buffer[CRSF_ROOM];
} crsf_receiver;

/* Starts a receiver. All counters are 0. */
CRSF_FUNCTION void crsf_init(crsf_receiver *receiver);

/* Returns the number of pending bytes, which may still become part of a frame. */
CRSF_FUNCTION uint32_t crsf_pending(const crsf_receiver *receiver);

/* Takes the next byte. If a frame is complete, returns true and writes its values to `*message`. Classifies bytes at most
 * once. So after a false start a complete frame may stay pending, until the following calls catch up. */
CRSF_FUNCTION bool crsf_push(crsf_receiver *receiver, uint8_t byte, crsf_message *message);

/* Decides about pending bytes up to the next frame. If a frame is found, returns true and writes its values to
 * `*message`. If no byte follows soon, call this function until it returns false. */
CRSF_FUNCTION bool crsf_poll(crsf_receiver *receiver, crsf_message *message);

/* Reports a line event: no more bytes follow the pending bytes. Calls `received` with each frame among them, and
 * discards the other bytes. `received` may be NULL. */
CRSF_FUNCTION void crsf_line_event(crsf_receiver *receiver, crsf_event event,
    void (*received)(void *context, const crsf_message *message), void *context);

/* Reads the values of a frame. */
CRSF_FUNCTION void crsf_decode(const uint8_t *frame, uint8_t length, crsf_message *message);

/* Writes a frame with these values. Returns its length, or 0 if `room` is too small or no frame has these values. */
CRSF_FUNCTION size_t crsf_encode(const crsf_message *message, uint8_t *frame, size_t room);

#if !defined(CRSF_DEFINITIONS) || CRSF_DEFINITIONS

/* On AVR, tables stay in flash. */
#ifdef __AVR__
#include <avr/pgmspace.h>
#define CRSF_IN_FLASH PROGMEM
#define CRSF_READ_8(entry) pgm_read_byte(entry)
#define CRSF_READ_16(entry) pgm_read_word(entry)
#define CRSF_READ_32(entry) pgm_read_dword(entry)
#else
#define CRSF_IN_FLASH
#define CRSF_READ_8(entry) (*(entry))
#define CRSF_READ_16(entry) (*(entry))
#define CRSF_READ_32(entry) (*(entry))
#endif

/* Sets bytes to 0. */
static inline void crsf_clear(void *object, size_t size)
{
    uint8_t *byte = (uint8_t *)object;

    while (size > 0U) {
        *byte = 0U;
        byte++;
        size--;
    }
}

/* Returns whether bytes are equal. */
static inline bool crsf_same(const void *one, const void *other, size_t size)
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
static inline void crsf_put(uint8_t *to, const uint8_t *bytes, size_t count)
{
    size_t i;

    for (i = 0U; i < count; i++) {
        to[i] = (uint8_t)(to[i] | bytes[i]);
    }
}

/* Returns whether a frame can begin with this byte. */
static inline bool crsf_starts(uint8_t byte)
{
    return (byte == 0xC8U) || (byte == 0x00U) || (byte == 0xEAU) || (byte == 0xECU) || (byte == 0xEEU);
}

/* Returns the CRC of bytes. */
static inline uint8_t crsf_checksum(const uint8_t *bytes, uint8_t count)
{
    /* The remainder of each value of four bits. */
    static const uint8_t table[16] CRSF_IN_FLASH = {
        0x00U, 0xD5U, 0x7FU, 0xAAU, 0xFEU, 0x2BU, 0x81U, 0x54U, 0x29U, 0xFCU, 0x56U, 0x83U,
        0xD7U, 0x02U, 0xA8U, 0x7DU
    };
    uint8_t sum = 0x0U;
    uint8_t i;

    for (i = 0U; i < count; i++) {
        const uint8_t byte = bytes[i];

        sum = (uint8_t)(sum ^ byte);
        sum = (uint8_t)(((unsigned)sum << 4U) ^ CRSF_READ_8(&table[sum >> 4U]));
        sum = (uint8_t)(((unsigned)sum << 4U) ^ CRSF_READ_8(&table[sum >> 4U]));
    }
    return sum;
}

/* Classifies one byte or more. The first `seen` bytes must be incomplete; `seen` may be 0. If the bytes begin with a
 * frame, sets `*number` to its length. If they are incomplete, sets `*number` to the number of bytes needed to decide
 * more. */
static inline crsf_outcome crsf_classify(const uint8_t *bytes, uint8_t count, uint8_t seen, uint8_t *number)
{
    uint8_t field;
    uint8_t length;

    (void)seen;
    /* The sync. */
    if (!crsf_starts(bytes[0])) {
        return CRSF_NO_SYNC;
    }
    if (count < 2U) {
        *number = 2U;
        return CRSF_INCOMPLETE;
    }
    /* The header. */
    field = bytes[1U];
    if (field < 2U) {
        return CRSF_BAD_HEADER;
    }
    if (field > 62U) {
        return CRSF_TOO_LONG;
    }
    length = (uint8_t)(field + 2U);
    if (count < length) {
        *number = length;
        return CRSF_INCOMPLETE;
    }
    /* The checksum. */
    if (crsf_checksum(&bytes[2U], (uint8_t)(length - 3U)) != bytes[length - 1U]) {
        return CRSF_CHECKSUM_MISMATCH;
    }
    *number = length;
    return CRSF_FRAME;
}

CRSF_FUNCTION void crsf_decode(const uint8_t *frame, uint8_t length, crsf_message *message)
{
    message->address = frame[0U];
    message->type = frame[2U];
    message->payload = &frame[3U];
    message->payload_length = (uint8_t)(length - 4U);
}

CRSF_FUNCTION size_t crsf_encode(const crsf_message *message, uint8_t *frame, size_t room)
{

    size_t size = 4U;
    uint8_t length;
    uint8_t number = 0U;
    uint32_t field;
    uint8_t sum;
    crsf_message again;

    if (message->payload_length > 64U) {
        return 0U;
    }
    size += message->payload_length;
    length = (uint8_t)size;
    if ((size > 64U) || (room < size)) {
        return 0U;
    }
    crsf_clear(frame, size);
    frame[0U] = (uint8_t)(frame[0U] | message->address);
    frame[2U] = (uint8_t)(frame[2U] | message->type);
    crsf_put(&frame[3U], message->payload, message->payload_length);
    if (!crsf_starts(frame[0])) {
        frame[0] = 0xC8U;
    }
    field = (uint32_t)length - 2U;
    frame[1U] = (uint8_t)field;
    sum = crsf_checksum(&frame[2U], (uint8_t)(length - 3U));
    frame[length - 1U] = (uint8_t)sum;
    /* Fail if a value is outside its field's range, or contradicts another part of the frame. */
    length = (uint8_t)size;
    if ((crsf_classify(frame, length, 0U, &number) != CRSF_FRAME) || (number != length)) {
        return 0U;
    }
    crsf_decode(frame, length, &again);
    if (again.address != message->address) {
        return 0U;
    }
    if (again.type != message->type) {
        return 0U;
    }
    if ((again.payload_length != message->payload_length) || !crsf_same(again.payload, message->payload, again.payload_length)) {
        return 0U;
    }
    return size;
}

CRSF_FUNCTION void crsf_init(crsf_receiver *receiver)
{
    crsf_clear(receiver, sizeof *receiver);
}

CRSF_FUNCTION uint32_t crsf_pending(const crsf_receiver *receiver)
{
    return (uint32_t)receiver->to - receiver->from;
}

static inline void crsf_count_discarded(crsf_receiver *receiver, crsf_outcome reason, uint8_t count)
{
    receiver->counters.discarded[reason] += count;
    receiver->is_lost = true;
}

static inline void crsf_count_frame(crsf_receiver *receiver, uint8_t length)
{
    receiver->counters.frames++;
    receiver->counters.frame_bytes += length;
    if (receiver->is_lost) {
        receiver->is_lost = false;
        receiver->counters.resynchronisations++;
    }
}

/* Forgets the pending bytes. */
static inline void crsf_forget(crsf_receiver *receiver)
{
    receiver->from = 0U;
    receiver->to = 0U;
    receiver->ask_at = 0U;
}

/* Decides about the first pending bytes. Classifies bytes at most once. If they are a frame, moves `from` past it and
 * returns its length, otherwise returns 0. Sets `*again` to false if the next decision needs more bytes. */
static inline uint8_t crsf_next(crsf_receiver *receiver, bool *again)
{
    crsf_outcome outcome;
    uint8_t number = 0U;
    uint8_t seen;
    const uint8_t start = receiver->from;

    *again = false;
    if (receiver->to < receiver->ask_at) {
        return 0U;
    }
    /* If the first byte has not been classified yet, skip bytes that cannot begin a frame. */
    if (receiver->ask_at <= (receiver->from + 1U)) {
        while ((receiver->from < receiver->to) && !crsf_starts(receiver->buffer[receiver->from])) {
            receiver->from++;
        }
        if (receiver->from > start) {
            crsf_count_discarded(receiver, CRSF_NO_SYNC, (uint8_t)(receiver->from - start));
            receiver->ask_at = 0U;
        }
    }
    if (receiver->from == receiver->to) {
        crsf_forget(receiver);
        return 0U;
    }
    seen = (receiver->ask_at > receiver->from) ? (uint8_t)(receiver->ask_at - (receiver->from + 1U)) : (uint8_t)0U;
    receiver->ask_at = 0U;
    outcome = crsf_classify(&receiver->buffer[receiver->from], (uint8_t)(receiver->to - receiver->from), seen, &number);
    if (outcome == CRSF_INCOMPLETE) {
        receiver->ask_at = (uint8_t)(receiver->from + number);
        return 0U;
    }
    *again = true;
    if (outcome == CRSF_FRAME) {
        receiver->from = (uint8_t)(receiver->from + number);
        crsf_count_frame(receiver, number);
        return number;
    }
    receiver->from++;
    crsf_count_discarded(receiver, outcome, 1U);
    return 0U;
}

/* Moves the pending bytes to the front of the buffer. */
static inline void crsf_move_to_front(crsf_receiver *receiver)
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

CRSF_FUNCTION bool crsf_push(crsf_receiver *receiver, uint8_t byte, crsf_message *message)
{
    uint8_t length;
    bool again;

    receiver->counters.bytes++;
    if (((receiver->to + 1U) < receiver->ask_at) && (receiver->to < CRSF_ROOM)) {
        /* No decision is possible yet: only store the byte. */
        receiver->buffer[receiver->to] = byte;
        receiver->to++;
        return false;
    }
    if (receiver->from == receiver->to) {
        crsf_forget(receiver);
        if (!crsf_starts(byte)) {
            crsf_count_discarded(receiver, CRSF_NO_SYNC, 1U);
            return false;
        }
    }
    if (receiver->to == CRSF_ROOM) {
        crsf_move_to_front(receiver);
    }
    receiver->buffer[receiver->to] = byte;
    receiver->to++;
    length = crsf_next(receiver, &again);
    if (length == 0U) {
        return false;
    }
    crsf_decode(&receiver->buffer[receiver->from - length], length, message);
    return true;
}

CRSF_FUNCTION bool crsf_poll(crsf_receiver *receiver, crsf_message *message)
{
    uint8_t length;
    bool again;

    /* Each iteration except the last decides about at least one pending byte. */
    do {
        length = crsf_next(receiver, &again);
        if (length > 0U) {
            crsf_decode(&receiver->buffer[receiver->from - length], length, message);
            return true;
        }
    } while (again);
    return false;
}

CRSF_FUNCTION void crsf_line_event(crsf_receiver *receiver, crsf_event event,
    void (*received)(void *context, const crsf_message *message), void *context)
{
    crsf_message message;

    receiver->counters.events[event]++;
    while (receiver->from < receiver->to) {
        if (crsf_poll(receiver, &message)) {
            if (received != NULL) {
                received(context, &message);
            }
        } else if (receiver->from < receiver->to) {
            /* No more bytes follow, so the first pending byte starts no frame.
             * Reset `ask_at`, which described the discarded byte. */
            receiver->from++;
            receiver->ask_at = 0U;
            crsf_count_discarded(receiver, CRSF_LINE_EVENT, 1U);
        }
    }
    crsf_forget(receiver);
}
#endif

#endif
