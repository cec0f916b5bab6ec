/* Frames of gnss. Made by `framelock generate --frame gnss --language c`, version 0.1.0; do not edit.
 * SPDX-License-Identifier: 0BSD
 * You may use, change and ship this file without conditions.
 *
 * This header needs only a C99 or C++17 compiler. It allocates no memory and does not recurse.
 *
 *   static gnss_receiver receiver;
 *   gnss_message message;
 *
 *   gnss_init(&receiver);
 *   if (gnss_push(&receiver, byte, &message)) { ... }     for each received byte
 *   gnss_line_event(&receiver, GNSS_FRAMING_ERROR, received, NULL);     instead of a damaged byte
 *
 * The counters satisfy this equation at any time, modulo 2^32:
 * counters.bytes == counters.frame_bytes + the sum of counters.discarded + gnss_pending(&receiver).
 *
 * Calls for one receiver must not interrupt each other. All functions are `static inline`. If several source files need
 * them, define GNSS_DEFINITIONS as 1 in one of these files, and as 0 in the others, before they include this header:
 * then there is one copy of the code. */
#ifndef GNSS_H
#define GNSS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifndef GNSS_DEFINITIONS
#define GNSS_FUNCTION static inline
#elif defined(__cplusplus)
#define GNSS_FUNCTION extern "C"
#else
#define GNSS_FUNCTION
#endif

/* The number of bytes in the longest frame. */
#define GNSS_LONGEST 4096U

/* The number of bytes in a receiver's buffer. With room for two longest frames, pending bytes are seldom moved. */
#ifndef GNSS_ROOM
#define GNSS_ROOM (2U * GNSS_LONGEST)
#endif
#if (GNSS_ROOM < GNSS_LONGEST) || (GNSS_ROOM > 61439U)
#error "GNSS_ROOM must be between GNSS_LONGEST and 61439"
#endif

/* The outcome of a classification: a frame, incomplete, or the reason why bytes are discarded. */
typedef enum {
    GNSS_NO_SYNC, /* no frame begins with them */
    GNSS_BROKEN_SYNC, /* a later byte of the sync is wrong */
    GNSS_BAD_HEADER, /* the length is too small, or fixed bits are wrong */
    GNSS_TOO_LONG, /* the length is too great */
    GNSS_CHECKSUM_MISMATCH, /* the checksum is wrong */
    GNSS_WRONG_TERMINATOR, /* the terminator or fixed bits are wrong */
    GNSS_LINE_EVENT, /* pending at a line event */
    GNSS_REASONS, /* the number of reasons */
    GNSS_FRAME = GNSS_REASONS, /* a frame */
    GNSS_INCOMPLETE /* more bytes are needed */
} gnss_outcome;

/* An event on the line, which the UART or a timer notices. */
typedef enum {
    GNSS_FRAMING_ERROR,
    GNSS_PARITY_ERROR,
    GNSS_OVERRUN,
    GNSS_BREAK,
    GNSS_IDLE_LINE,
    GNSS_EVENTS /* the number of events */
} gnss_event;

/* Counters. They wrap at 2^32. */
typedef struct {
    uint32_t bytes; /* received bytes */
    uint32_t frames; /* frames */
    uint32_t frame_bytes; /* bytes in frames */
    uint32_t resynchronisations; /* frames that follow discarded bytes */
    uint32_t discarded[GNSS_REASONS]; /* discarded bytes, by reason */
    uint32_t events[GNSS_EVENTS]; /* line events */
} gnss_counters;

/* The values of a frame of ubx. Pointers are valid until the next call for the receiver. */
typedef struct {
    /* At 2: u8. */
    uint8_t class_;
    /* At 3: u8. */
    uint8_t id;
    /* At 6: bytes. */
    const uint8_t *payload;
    uint16_t payload_length;
} gnss_ubx_message;

/* The values of a frame of nmea. Pointers are valid until the next call for the receiver. */
typedef struct {
    /* At 0: text. */
    uint8_t start[1];
    /* At 1: text. */
    const uint8_t *sentence;
    uint16_t sentence_length;
} gnss_nmea_message;

/* The values of a frame of rtcm. Pointers are valid until the next call for the receiver. */
typedef struct {
    /* At 3: bytes. */
    const uint8_t *payload;
    uint16_t payload_length;
} gnss_rtcm_message;

/* The kinds of frames, in the order in which they are tried. */
typedef enum {
    GNSS_KIND_UBX,
    GNSS_KIND_NMEA,
    GNSS_KIND_RTCM
} gnss_kind;

/* The values of a frame of any kind. */
typedef struct {
    gnss_kind kind;
    union {
        gnss_ubx_message ubx;
        gnss_nmea_message nmea;
        gnss_rtcm_message rtcm;
    } of;
} gnss_message;

/* A receiver. Read `counters`; the other members are private. */
typedef struct {
    gnss_counters counters;
    uint16_t from; /* the pending bytes are buffer[from] to buffer[to - 1] */
    uint16_t to;
    uint16_t ask_at; /* the next decision is possible when `to` reaches this index */
    bool is_lost; /* bytes were discarded since the last frame */
    uint8_t buffer[GNSS_ROOM];
} gnss_receiver;

/* Starts a receiver. All counters are 0. */
GNSS_FUNCTION void gnss_init(gnss_receiver *receiver);

/* Returns the number of pending bytes, which may still become part of a frame. */
GNSS_FUNCTION uint32_t gnss_pending(const gnss_receiver *receiver);

/* Takes the next byte. If a frame is complete, returns true and writes its values to `*message`. Classifies bytes at most
 * once. So after a false start a complete frame may stay pending, until the following calls catch up. */
GNSS_FUNCTION bool gnss_push(gnss_receiver *receiver, uint8_t byte, gnss_message *message);

/* Decides about pending bytes up to the next frame. If a frame is found, returns true and writes its values to
 * `*message`. If no byte follows soon, call this function until it returns false. */
GNSS_FUNCTION bool gnss_poll(gnss_receiver *receiver, gnss_message *message);

/* Reports a line event: no more bytes follow the pending bytes. Calls `received` with each frame among them, and
 * discards the other bytes. `received` may be NULL. */
GNSS_FUNCTION void gnss_line_event(gnss_receiver *receiver, gnss_event event,
    void (*received)(void *context, const gnss_message *message), void *context);

/* Reads the values of a frame. */
GNSS_FUNCTION void gnss_decode(const uint8_t *frame, uint16_t length, gnss_message *message);

/* Writes a frame with these values. Returns its length, or 0 if `room` is too small or no frame has these values. */
GNSS_FUNCTION size_t gnss_encode(const gnss_message *message, uint8_t *frame, size_t room);

#if !defined(GNSS_DEFINITIONS) || GNSS_DEFINITIONS

/* On AVR, tables stay in flash. */
#ifdef __AVR__
#include <avr/pgmspace.h>
#define GNSS_IN_FLASH PROGMEM
#define GNSS_READ_8(entry) pgm_read_byte(entry)
#define GNSS_READ_16(entry) pgm_read_word(entry)
#define GNSS_READ_32(entry) pgm_read_dword(entry)
#else
#define GNSS_IN_FLASH
#define GNSS_READ_8(entry) (*(entry))
#define GNSS_READ_16(entry) (*(entry))
#define GNSS_READ_32(entry) (*(entry))
#endif

/* Sets bytes to 0. */
static inline void gnss_clear(void *object, size_t size)
{
    uint8_t *byte = (uint8_t *)object;

    while (size > 0U) {
        *byte = 0U;
        byte++;
        size--;
    }
}

/* Copies bytes. */
static inline void gnss_copy(void *to, const void *from, size_t size)
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
static inline bool gnss_same(const void *one, const void *other, size_t size)
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
static inline uint16_t gnss_le16(const uint8_t *bytes)
{
    return (uint16_t)(((unsigned)bytes[1] << 8U) | bytes[0]);
}

/* Reads a number of two bytes, big-endian. */
static inline uint16_t gnss_be16(const uint8_t *bytes)
{
    return (uint16_t)(((unsigned)bytes[0] << 8U) | bytes[1]);
}

/* Reads a number of three bytes, big-endian. */
static inline uint32_t gnss_be24(const uint8_t *bytes)
{
    return ((uint32_t)bytes[0] << 16U) | ((uint32_t)bytes[1] << 8U) | bytes[2];
}

/* Writes bytes by setting those bits that are 1. */
static inline void gnss_put(uint8_t *to, const uint8_t *bytes, size_t count)
{
    size_t i;

    for (i = 0U; i < count; i++) {
        to[i] = (uint8_t)(to[i] | bytes[i]);
    }
}

/* Returns the value of a hexadecimal digit, or 16 for any other character. */
static inline uint8_t gnss_digit(uint8_t digit)
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
static inline void gnss_put_hex(uint8_t *to, uint32_t number, uint8_t bits)
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
static inline bool gnss_ubx_starts(uint8_t byte)
{
    return byte == 0xB5U;
}

/* Returns the Fletcher checksum of bytes. */
static inline uint16_t gnss_ubx_checksum(const uint8_t *bytes, uint16_t count)
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
static inline gnss_outcome gnss_ubx_classify(const uint8_t *bytes, uint16_t count, uint16_t seen, uint16_t *number)
{
    uint16_t field;
    uint16_t length;

    (void)seen;
    /* The sync. */
    if (!gnss_ubx_starts(bytes[0])) {
        return GNSS_NO_SYNC;
    }
    if ((count > 1U) && (bytes[1] != 0x62U)) {
        return GNSS_BROKEN_SYNC;
    }
    if (count < 6U) {
        *number = (count < 2U) ? (uint16_t)(count + 1U) : 6U;
        return GNSS_INCOMPLETE;
    }
    /* The header. */
    field = gnss_le16(&bytes[4U]);
    if (field > 4088U) {
        return GNSS_TOO_LONG;
    }
    length = (uint16_t)(field + 8U);
    if (count < length) {
        *number = length;
        return GNSS_INCOMPLETE;
    }
    /* The checksum. */
    if (gnss_ubx_checksum(&bytes[2U], (uint16_t)(length - 4U)) != gnss_le16(&bytes[length - 2U])) {
        return GNSS_CHECKSUM_MISMATCH;
    }
    *number = length;
    return GNSS_FRAME;
}

/* Returns whether a frame can begin with this byte. */
static inline bool gnss_nmea_starts(uint8_t byte)
{
    return (byte == 0x24U) || (byte == 0x21U);
}

/* Returns the exclusive or of bytes. */
static inline uint8_t gnss_nmea_checksum(const uint8_t *bytes, uint16_t count)
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
static inline bool gnss_nmea_is_content(uint8_t byte)
{
    return ((byte >= 0x25U) && (byte <= 0x7EU)) || ((byte >= 0x22U) && (byte <= 0x23U)) || (byte == 0x20U);
}

/* Returns the length of the terminator at the beginning of the bytes. Returns 0 if more bytes are needed to know it, and
 * 4 if the bytes begin with no terminator. */
static inline uint16_t gnss_nmea_terminator(const uint8_t *bytes, uint16_t count)
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
static inline uint16_t gnss_nmea_counted(const uint8_t *bytes, uint16_t length)
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
static inline bool gnss_nmea_has_value(const uint8_t *digits, uint8_t value)
{
    uint8_t shift = 8U;
    uint8_t i = 0U;

    while (shift > 0U) {
        shift = (uint8_t)(shift - 4U);
        if (gnss_digit(digits[i]) != ((uint8_t)(value >> shift) & 0x0FU)) {
            return false;
        }
        i++;
    }
    return true;
}

/* Classifies one byte or more. The first `seen` bytes must be incomplete; `seen` may be 0. If the bytes begin with a
 * frame, sets `*number` to its length. If they are incomplete, sets `*number` to the number of bytes needed to decide
 * more. */
static inline gnss_outcome gnss_nmea_classify(const uint8_t *bytes, uint16_t count, uint16_t seen, uint16_t *number)
{
    uint16_t length;
    uint16_t whole;
    uint16_t at;
    uint16_t width;
    uint8_t sum;

    /* The sync. */
    if (!gnss_nmea_starts(bytes[0])) {
        return GNSS_NO_SYNC;
    }
    if (count > 515U) {
        count = 515U;
    }
    /* The first terminator ends the frame. The first `seen` bytes have already been searched for it. */
    at = (seen > 3U) ? (uint16_t)(seen - 2U) : 1U;
    while ((at < count) && gnss_nmea_is_content(bytes[at])) {
        at++;
    }
    width = (at < count) ? gnss_nmea_terminator(&bytes[at], (uint16_t)(count - at)) : (uint16_t)0U;
    if (width > 3U) {
        return GNSS_WRONG_TERMINATOR;
    }
    if (width == 0U) {
        if (count >= 515U) {
            return GNSS_WRONG_TERMINATOR;
        }
        *number = (uint16_t)(count + 1U);
        return GNSS_INCOMPLETE;
    }
    length = (uint16_t)(at + 2U);
    if (length < 7U) {
        return GNSS_BAD_HEADER;
    }
    whole = (uint16_t)(at + width);
    /* The bits that are the same in each frame. */
    if (bytes[length - 5U] != 0x2AU) {
        return GNSS_WRONG_TERMINATOR;
    }
    /* The checksum. */
    sum = gnss_nmea_checksum(&bytes[1U], (uint16_t)(length - 6U));
    if (!gnss_nmea_has_value(&bytes[length - 4U], sum)) {
        return GNSS_CHECKSUM_MISMATCH;
    }
    *number = whole;
    return GNSS_FRAME;
}

/* Returns whether a frame can begin with this byte. */
static inline bool gnss_rtcm_starts(uint8_t byte)
{
    return byte == 0xD3U;
}

/* Returns the CRC of bytes. */
static inline uint32_t gnss_rtcm_checksum(const uint8_t *bytes, uint16_t count)
{
    /* The remainder of each value of four bits. */
    static const uint32_t table[16] GNSS_IN_FLASH = {
        0x00000000U, 0x864CFB00U, 0x8AD50D00U, 0x0C99F600U, 0x93E6E100U, 0x15AA1A00U, 0x1933EC00U, 0x9F7F1700U,
        0xA1813900U, 0x27CDC200U, 0x2B543400U, 0xAD18CF00U, 0x3267D800U, 0xB42B2300U, 0xB8B2D500U, 0x3EFE2E00U
    };
    uint32_t sum = 0x0U;
    uint16_t i;

    for (i = 0U; i < count; i++) {
        const uint8_t byte = bytes[i];

        sum = (uint32_t)(sum ^ ((uint32_t)byte << 24U));
        sum = (uint32_t)(((uint32_t)sum << 4U) ^ GNSS_READ_32(&table[sum >> 28U]));
        sum = (uint32_t)(((uint32_t)sum << 4U) ^ GNSS_READ_32(&table[sum >> 28U]));
    }
    sum = (uint32_t)(sum >> 8U);
    return sum;
}

/* Classifies one byte or more. The first `seen` bytes must be incomplete; `seen` may be 0. If the bytes begin with a
 * frame, sets `*number` to its length. If they are incomplete, sets `*number` to the number of bytes needed to decide
 * more. */
static inline gnss_outcome gnss_rtcm_classify(const uint8_t *bytes, uint16_t count, uint16_t seen, uint16_t *number)
{
    uint16_t field;
    uint16_t length;

    (void)seen;
    /* The sync. */
    if (!gnss_rtcm_starts(bytes[0])) {
        return GNSS_NO_SYNC;
    }
    if (count < 3U) {
        *number = 3U;
        return GNSS_INCOMPLETE;
    }
    /* The header. */
    if ((bytes[1U] & 0xFCU) != 0x00U) {
        return GNSS_BAD_HEADER;
    }
    field = (uint16_t)(gnss_be16(&bytes[1U]) & 0x3FFU);
    length = (uint16_t)(field + 6U);
    if (count < length) {
        *number = length;
        return GNSS_INCOMPLETE;
    }
    /* The checksum. */
    if (gnss_rtcm_checksum(&bytes[0U], (uint16_t)(length - 3U)) != gnss_be24(&bytes[length - 3U])) {
        return GNSS_CHECKSUM_MISMATCH;
    }
    *number = length;
    return GNSS_FRAME;
}

/* Returns whether a frame can begin with this byte. */
static inline bool gnss_starts(uint8_t byte)
{
    return gnss_ubx_starts(byte) || gnss_nmea_starts(byte) || gnss_rtcm_starts(byte);
}

/* Classifies bytes by the first kind that does not reject them. */
static inline gnss_outcome gnss_classify(const uint8_t *bytes, uint16_t count, uint16_t seen, uint16_t *number)
{
    gnss_outcome outcome;

    outcome = gnss_ubx_classify(bytes, count, seen, number);
    if (outcome != GNSS_NO_SYNC) {
        return outcome;
    }
    outcome = gnss_nmea_classify(bytes, count, seen, number);
    if (outcome != GNSS_NO_SYNC) {
        return outcome;
    }
    outcome = gnss_rtcm_classify(bytes, count, seen, number);
    return outcome;
}

/* Returns the kind of a frame. */
static inline gnss_kind gnss_kind_of(const uint8_t *frame, uint16_t length)
{
    (void)length;
    if (gnss_ubx_starts(frame[0])) {
        return GNSS_KIND_UBX;
    }
    if (gnss_nmea_starts(frame[0])) {
        return GNSS_KIND_NMEA;
    }
    return GNSS_KIND_RTCM;
}

/* Reads the fields of a frame of ubx. */
static inline void gnss_ubx_decode(const uint8_t *frame, uint16_t length, gnss_ubx_message *message)
{
    message->class_ = frame[2U];
    message->id = frame[3U];
    message->payload = &frame[6U];
    message->payload_length = (uint16_t)(length - 8U);
}

/* Writes a frame of ubx. Returns its length, or 0 if `room` is too small or no frame has these values. */
static inline size_t gnss_ubx_encode(const gnss_ubx_message *message, uint8_t *frame, size_t room)
{

    size_t size = 8U;
    uint16_t length;
    uint16_t number = 0U;
    uint32_t field;
    uint16_t sum;
    gnss_ubx_message again;

    if (message->payload_length > 4096U) {
        return 0U;
    }
    size += message->payload_length;
    length = (uint16_t)size;
    if ((size > 4096U) || (room < size)) {
        return 0U;
    }
    gnss_clear(frame, size);
    frame[2U] = (uint8_t)(frame[2U] | message->class_);
    frame[3U] = (uint8_t)(frame[3U] | message->id);
    gnss_put(&frame[6U], message->payload, message->payload_length);
    frame[0] = 0xB5U;
    frame[1] = 0x62U;
    field = (uint32_t)length - 8U;
    frame[4U] = (uint8_t)field;
    frame[5U] = (uint8_t)(field >> 8U);
    sum = gnss_ubx_checksum(&frame[2U], (uint16_t)(length - 4U));
    frame[length - 2U] = (uint8_t)sum;
    frame[length - 1U] = (uint8_t)(sum >> 8U);
    /* Fail if a value is outside its field's range, or contradicts another part of the frame. */
    length = (uint16_t)size;
    if ((gnss_ubx_classify(frame, length, 0U, &number) != GNSS_FRAME) || (number != length)) {
        return 0U;
    }
    gnss_ubx_decode(frame, length, &again);
    if (again.class_ != message->class_) {
        return 0U;
    }
    if (again.id != message->id) {
        return 0U;
    }
    if ((again.payload_length != message->payload_length) || !gnss_same(again.payload, message->payload, again.payload_length)) {
        return 0U;
    }
    return size;
}

/* Reads the fields of a frame of nmea. */
static inline void gnss_nmea_decode(const uint8_t *frame, uint16_t length, gnss_nmea_message *message)
{
    length = gnss_nmea_counted(frame, length);
    gnss_copy(message->start, &frame[0U], 1U);
    message->sentence = &frame[1U];
    message->sentence_length = (uint16_t)(length - 6U);
}

/* Writes a frame of nmea. Returns its length, or 0 if `room` is too small or no frame has these values. */
static inline size_t gnss_nmea_encode(const gnss_nmea_message *message, uint8_t *frame, size_t room)
{

    size_t size = 7U;
    uint16_t length;
    uint16_t number = 0U;
    uint8_t sum;
    gnss_nmea_message again;

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
    gnss_clear(frame, size);
    gnss_put(&frame[0U], message->start, 1U);
    gnss_put(&frame[1U], message->sentence, message->sentence_length);
    if (!gnss_nmea_starts(frame[0])) {
        frame[0] = 0x24U;
    }
    frame[length - 5U] = 0x2AU;
    frame[length - 2U] = 0x0DU;
    frame[length - 1U] = 0x0AU;
    sum = gnss_nmea_checksum(&frame[1U], (uint16_t)(length - 6U));
    gnss_put_hex(&frame[length - 4U], sum, 8U);
    /* Fail if a value is outside its field's range, or contradicts another part of the frame. */
    length = (uint16_t)size;
    if ((gnss_nmea_classify(frame, length, 0U, &number) != GNSS_FRAME) || (number != length)) {
        return 0U;
    }
    gnss_nmea_decode(frame, length, &again);
    if (!gnss_same(&again.start, &message->start, sizeof again.start)) {
        return 0U;
    }
    if ((again.sentence_length != message->sentence_length) || !gnss_same(again.sentence, message->sentence, again.sentence_length)) {
        return 0U;
    }
    return size;
}

/* Reads the fields of a frame of rtcm. */
static inline void gnss_rtcm_decode(const uint8_t *frame, uint16_t length, gnss_rtcm_message *message)
{
    message->payload = &frame[3U];
    message->payload_length = (uint16_t)(length - 6U);
}

/* Writes a frame of rtcm. Returns its length, or 0 if `room` is too small or no frame has these values. */
static inline size_t gnss_rtcm_encode(const gnss_rtcm_message *message, uint8_t *frame, size_t room)
{

    size_t size = 6U;
    uint16_t length;
    uint16_t number = 0U;
    uint32_t field;
    uint32_t sum;
    gnss_rtcm_message again;

    if (message->payload_length > 1029U) {
        return 0U;
    }
    size += message->payload_length;
    length = (uint16_t)size;
    if ((size > 1029U) || (room < size)) {
        return 0U;
    }
    gnss_clear(frame, size);
    gnss_put(&frame[3U], message->payload, message->payload_length);
    frame[0] = 0xD3U;
    field = (uint32_t)length - 6U;
    frame[1U] = (uint8_t)((frame[1U] & 0xFCU) | ((field >> 8U) & 0x03U));
    frame[2U] = (uint8_t)field;
    frame[1U] = (uint8_t)((frame[1U] & 0x03U) | 0x00U);
    sum = gnss_rtcm_checksum(&frame[0U], (uint16_t)(length - 3U));
    frame[length - 3U] = (uint8_t)(sum >> 16U);
    frame[length - 2U] = (uint8_t)(sum >> 8U);
    frame[length - 1U] = (uint8_t)sum;
    /* Fail if a value is outside its field's range, or contradicts another part of the frame. */
    length = (uint16_t)size;
    if ((gnss_rtcm_classify(frame, length, 0U, &number) != GNSS_FRAME) || (number != length)) {
        return 0U;
    }
    gnss_rtcm_decode(frame, length, &again);
    if ((again.payload_length != message->payload_length) || !gnss_same(again.payload, message->payload, again.payload_length)) {
        return 0U;
    }
    return size;
}

GNSS_FUNCTION void gnss_decode(const uint8_t *frame, uint16_t length, gnss_message *message)
{
    message->kind = gnss_kind_of(frame, length);
    switch (message->kind) {
        case GNSS_KIND_UBX:
        gnss_ubx_decode(frame, length, &message->of.ubx);
        break;
        case GNSS_KIND_NMEA:
        gnss_nmea_decode(frame, length, &message->of.nmea);
        break;
        case GNSS_KIND_RTCM:
        gnss_rtcm_decode(frame, length, &message->of.rtcm);
        break;
        default:
        break;
    }
}

GNSS_FUNCTION size_t gnss_encode(const gnss_message *message, uint8_t *frame, size_t room)
{
    switch (message->kind) {
        case GNSS_KIND_UBX:
        return gnss_ubx_encode(&message->of.ubx, frame, room);
        case GNSS_KIND_NMEA:
        return gnss_nmea_encode(&message->of.nmea, frame, room);
        case GNSS_KIND_RTCM:
        return gnss_rtcm_encode(&message->of.rtcm, frame, room);
        default:
        return 0U;
    }
}

GNSS_FUNCTION void gnss_init(gnss_receiver *receiver)
{
    gnss_clear(receiver, sizeof *receiver);
}

GNSS_FUNCTION uint32_t gnss_pending(const gnss_receiver *receiver)
{
    return (uint32_t)receiver->to - receiver->from;
}

static inline void gnss_count_discarded(gnss_receiver *receiver, gnss_outcome reason, uint16_t count)
{
    receiver->counters.discarded[reason] += count;
    receiver->is_lost = true;
}

static inline void gnss_count_frame(gnss_receiver *receiver, uint16_t length)
{
    receiver->counters.frames++;
    receiver->counters.frame_bytes += length;
    if (receiver->is_lost) {
        receiver->is_lost = false;
        receiver->counters.resynchronisations++;
    }
}

/* Forgets the pending bytes. */
static inline void gnss_forget(gnss_receiver *receiver)
{
    receiver->from = 0U;
    receiver->to = 0U;
    receiver->ask_at = 0U;
}

/* Decides about the first pending bytes. Classifies bytes at most once. If they are a frame, moves `from` past it and
 * returns its length, otherwise returns 0. Sets `*again` to false if the next decision needs more bytes. */
static inline uint16_t gnss_next(gnss_receiver *receiver, bool *again)
{
    gnss_outcome outcome;
    uint16_t number = 0U;
    uint16_t seen;
    const uint16_t start = receiver->from;

    *again = false;
    if (receiver->to < receiver->ask_at) {
        return 0U;
    }
    /* If the first byte has not been classified yet, skip bytes that cannot begin a frame. */
    if (receiver->ask_at <= (receiver->from + 1U)) {
        while ((receiver->from < receiver->to) && !gnss_starts(receiver->buffer[receiver->from])) {
            receiver->from++;
        }
        if (receiver->from > start) {
            gnss_count_discarded(receiver, GNSS_NO_SYNC, (uint16_t)(receiver->from - start));
            receiver->ask_at = 0U;
        }
    }
    if (receiver->from == receiver->to) {
        gnss_forget(receiver);
        return 0U;
    }
    seen = (receiver->ask_at > receiver->from) ? (uint16_t)(receiver->ask_at - (receiver->from + 1U)) : (uint16_t)0U;
    receiver->ask_at = 0U;
    outcome = gnss_classify(&receiver->buffer[receiver->from], (uint16_t)(receiver->to - receiver->from), seen, &number);
    if (outcome == GNSS_INCOMPLETE) {
        receiver->ask_at = (uint16_t)(receiver->from + number);
        return 0U;
    }
    *again = true;
    if (outcome == GNSS_FRAME) {
        receiver->from = (uint16_t)(receiver->from + number);
        gnss_count_frame(receiver, number);
        return number;
    }
    receiver->from++;
    gnss_count_discarded(receiver, outcome, 1U);
    return 0U;
}

/* Moves the pending bytes to the front of the buffer. */
static inline void gnss_move_to_front(gnss_receiver *receiver)
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

GNSS_FUNCTION bool gnss_push(gnss_receiver *receiver, uint8_t byte, gnss_message *message)
{
    uint16_t length;
    bool again;

    receiver->counters.bytes++;
    if (((receiver->to + 1U) < receiver->ask_at) && (receiver->to < GNSS_ROOM)) {
        /* No decision is possible yet: only store the byte. */
        receiver->buffer[receiver->to] = byte;
        receiver->to++;
        return false;
    }
    if (receiver->from == receiver->to) {
        gnss_forget(receiver);
        if (!gnss_starts(byte)) {
            gnss_count_discarded(receiver, GNSS_NO_SYNC, 1U);
            return false;
        }
    }
    if (receiver->to == GNSS_ROOM) {
        gnss_move_to_front(receiver);
    }
    receiver->buffer[receiver->to] = byte;
    receiver->to++;
    length = gnss_next(receiver, &again);
    if (length == 0U) {
        return false;
    }
    gnss_decode(&receiver->buffer[receiver->from - length], length, message);
    return true;
}

GNSS_FUNCTION bool gnss_poll(gnss_receiver *receiver, gnss_message *message)
{
    uint16_t length;
    bool again;

    /* Each iteration except the last decides about at least one pending byte. */
    do {
        length = gnss_next(receiver, &again);
        if (length > 0U) {
            gnss_decode(&receiver->buffer[receiver->from - length], length, message);
            return true;
        }
    } while (again);
    return false;
}

GNSS_FUNCTION void gnss_line_event(gnss_receiver *receiver, gnss_event event,
    void (*received)(void *context, const gnss_message *message), void *context)
{
    gnss_message message;

    receiver->counters.events[event]++;
    while (receiver->from < receiver->to) {
        if (gnss_poll(receiver, &message)) {
            if (received != NULL) {
                received(context, &message);
            }
        } else if (receiver->from < receiver->to) {
            /* No more bytes follow, so the first pending byte starts no frame.
             * Reset `ask_at`, which described the discarded byte. */
            receiver->from++;
            receiver->ask_at = 0U;
            gnss_count_discarded(receiver, GNSS_LINE_EVENT, 1U);
        }
    }
    gnss_forget(receiver);
}
#endif

#endif
