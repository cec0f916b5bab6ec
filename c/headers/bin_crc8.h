/* Frames of bin_crc8. Made by `framelock generate --frame bin-crc8 --language c`, version 0.1.0; do not edit.
 * SPDX-License-Identifier: 0BSD
 * You may use, change and ship this file without conditions.
 *
 * This header needs only a C99 or C++17 compiler. It allocates no memory and does not recurse.
 *
 *   static bin_crc8_receiver receiver;
 *   bin_crc8_message message;
 *
 *   bin_crc8_init(&receiver);
 *   if (bin_crc8_push(&receiver, byte, &message)) { ... }     for each received byte
 *   bin_crc8_line_event(&receiver, BIN_CRC8_FRAMING_ERROR);     instead of a damaged byte
 *
 * The counters satisfy this equation at any time, modulo 2^32:
 * counters.bytes == counters.frame_bytes + the sum of counters.discarded + bin_crc8_pending(&receiver).
 *
 * Calls for one receiver must not interrupt each other. All functions are `static inline`. If several source files need
 * them, define BIN_CRC8_DEFINITIONS as 1 in one of these files, and as 0 in the others, before they include this header:
 * then there is one copy of the code. */
#ifndef BIN_CRC8_H
#define BIN_CRC8_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifndef BIN_CRC8_DEFINITIONS
#define BIN_CRC8_FUNCTION static inline
#elif defined(__cplusplus)
#define BIN_CRC8_FUNCTION extern "C"
#else
#define BIN_CRC8_FUNCTION
#endif

/* The number of bytes in the longest frame. */
#define BIN_CRC8_LONGEST 8U

/* The outcome of a classification: a frame, incomplete, or the reason why bytes are discarded. */
typedef enum {
    BIN_CRC8_NO_SYNC, /* no frame begins with them */
    BIN_CRC8_BROKEN_SYNC, /* a later byte of the sync is wrong */
    BIN_CRC8_CHECKSUM_MISMATCH, /* the checksum is wrong */
    BIN_CRC8_WRONG_TERMINATOR, /* the terminator or fixed bits are wrong */
    BIN_CRC8_LINE_EVENT, /* pending at a line event */
    BIN_CRC8_REASONS, /* the number of reasons */
    BIN_CRC8_FRAME = BIN_CRC8_REASONS, /* a frame */
    BIN_CRC8_INCOMPLETE /* more bytes are needed */
} bin_crc8_outcome;

/* An event on the line, which the UART or a timer notices. */
typedef enum {
    BIN_CRC8_FRAMING_ERROR,
    BIN_CRC8_PARITY_ERROR,
    BIN_CRC8_OVERRUN,
    BIN_CRC8_BREAK,
    BIN_CRC8_IDLE_LINE,
    BIN_CRC8_EVENTS /* the number of events */
} bin_crc8_event;

/* Counters. They wrap at 2^32. */
typedef struct {
    uint32_t bytes; /* received bytes */
    uint32_t frames; /* frames */
    uint32_t frame_bytes; /* bytes in frames */
    uint32_t resynchronisations; /* frames that follow discarded bytes */
    uint32_t discarded[BIN_CRC8_REASONS]; /* discarded bytes, by reason */
    uint32_t events[BIN_CRC8_EVENTS]; /* line events */
} bin_crc8_counters;

/* The values of a frame. */
typedef struct {
    /* At 3: u8. */
    uint8_t pitch;
    /* At 4: u8. */
    uint8_t roll;
    /* At 5: u8. */
    uint8_t yaw;
} bin_crc8_message;

/* A receiver. Read `counters`; the other members are private. */
typedef struct {
    bin_crc8_counters counters;
    uint8_t held[BIN_CRC8_LONGEST]; /* the pending bytes */
    uint8_t count; /* the number of pending bytes */
    bool is_lost; /* bytes were discarded since the last frame */
} bin_crc8_receiver;

/* Starts a receiver. All counters are 0. */
BIN_CRC8_FUNCTION void bin_crc8_init(bin_crc8_receiver *receiver);

/* Returns the number of pending bytes, which may still become part of a frame. */
BIN_CRC8_FUNCTION uint32_t bin_crc8_pending(const bin_crc8_receiver *receiver);

/* Takes the next byte. If it completes a frame, returns true and writes the frame's values to `*message`. */
BIN_CRC8_FUNCTION bool bin_crc8_push(bin_crc8_receiver *receiver, uint8_t byte, bin_crc8_message *message);

/* Reports a line event. Discards the pending bytes, because the rest of their frame is lost. */
BIN_CRC8_FUNCTION void bin_crc8_line_event(bin_crc8_receiver *receiver, bin_crc8_event event);

/* Reads the values of a frame. */
BIN_CRC8_FUNCTION void bin_crc8_decode(const uint8_t *frame, uint8_t length, bin_crc8_message *message);

/* Writes a frame with these values. Returns its length, or 0 if `room` is too small or no frame has these values. */
BIN_CRC8_FUNCTION size_t bin_crc8_encode(const bin_crc8_message *message, uint8_t *frame, size_t room);

#if !defined(BIN_CRC8_DEFINITIONS) || BIN_CRC8_DEFINITIONS

/* On AVR, tables stay in flash. */
#ifdef __AVR__
#include <avr/pgmspace.h>
#define BIN_CRC8_IN_FLASH PROGMEM
#define BIN_CRC8_READ_8(entry) pgm_read_byte(entry)
#define BIN_CRC8_READ_16(entry) pgm_read_word(entry)
#define BIN_CRC8_READ_32(entry) pgm_read_dword(entry)
#else
#define BIN_CRC8_IN_FLASH
#define BIN_CRC8_READ_8(entry) (*(entry))
#define BIN_CRC8_READ_16(entry) (*(entry))
#define BIN_CRC8_READ_32(entry) (*(entry))
#endif

/* Sets bytes to 0. */
static inline void bin_crc8_clear(void *object, size_t size)
{
    uint8_t *byte = (uint8_t *)object;

    while (size > 0U) {
        *byte = 0U;
        byte++;
        size--;
    }
}

/* Returns whether a frame can begin with this byte. */
static inline bool bin_crc8_starts(uint8_t byte)
{
    return byte == 0x41U;
}

/* Returns the CRC of bytes. */
static inline uint8_t bin_crc8_checksum(const uint8_t *bytes, uint8_t count)
{
    /* The remainder of each value of four bits. */
    static const uint8_t table[16] BIN_CRC8_IN_FLASH = {
        0x00U, 0x2FU, 0x5EU, 0x71U, 0xBCU, 0x93U, 0xE2U, 0xCDU, 0x57U, 0x78U, 0x09U, 0x26U,
        0xEBU, 0xC4U, 0xB5U, 0x9AU
    };
    uint8_t sum = 0xFFU;
    uint8_t i;

    for (i = 0U; i < count; i++) {
        const uint8_t byte = bytes[i];

        sum = (uint8_t)(sum ^ byte);
        sum = (uint8_t)(((unsigned)sum << 4U) ^ BIN_CRC8_READ_8(&table[sum >> 4U]));
        sum = (uint8_t)(((unsigned)sum << 4U) ^ BIN_CRC8_READ_8(&table[sum >> 4U]));
    }
    return (uint8_t)(sum ^ 0xFFU);
}

/* Classifies one byte or more. The first `seen` bytes must be incomplete; `seen` may be 0. If the bytes begin with a
 * frame, sets `*number` to its length. If they are incomplete, sets `*number` to the number of bytes needed to decide
 * more. */
static inline bin_crc8_outcome bin_crc8_classify(const uint8_t *bytes, uint8_t count, uint8_t seen, uint8_t *number)
{
    uint8_t length;

    (void)seen;
    /* The sync. */
    if (!bin_crc8_starts(bytes[0])) {
        return BIN_CRC8_NO_SYNC;
    }
    if ((count > 1U) && (bytes[1] != 0x42U)) {
        return BIN_CRC8_BROKEN_SYNC;
    }
    if (count < 2U) {
        *number = (uint8_t)(count + 1U);
        return BIN_CRC8_INCOMPLETE;
    }
    length = 8U;
    if (count < length) {
        *number = length;
        return BIN_CRC8_INCOMPLETE;
    }
    /* The terminator. */
    if (bytes[length - 1U] != 0x0DU) {
        return BIN_CRC8_WRONG_TERMINATOR;
    }
    /* The checksum. */
    if (bin_crc8_checksum(&bytes[2U], (uint8_t)(length - 4U)) != bytes[length - 2U]) {
        return BIN_CRC8_CHECKSUM_MISMATCH;
    }
    *number = length;
    return BIN_CRC8_FRAME;
}

BIN_CRC8_FUNCTION void bin_crc8_decode(const uint8_t *frame, uint8_t length, bin_crc8_message *message)
{
    (void)length;
    message->pitch = frame[3U];
    message->roll = frame[4U];
    message->yaw = frame[5U];
}

BIN_CRC8_FUNCTION size_t bin_crc8_encode(const bin_crc8_message *message, uint8_t *frame, size_t room)
{

    const size_t size = 8U;
    uint8_t length;
    uint8_t number = 0U;
    uint8_t sum;
    bin_crc8_message again;

    length = (uint8_t)size;
    if (room < size) {
        return 0U;
    }
    bin_crc8_clear(frame, size);
    frame[3U] = (uint8_t)(frame[3U] | message->pitch);
    frame[4U] = (uint8_t)(frame[4U] | message->roll);
    frame[5U] = (uint8_t)(frame[5U] | message->yaw);
    frame[0] = 0x41U;
    frame[1] = 0x42U;
    frame[length - 1U] = 0x0DU;
    sum = bin_crc8_checksum(&frame[2U], (uint8_t)(length - 4U));
    frame[length - 2U] = (uint8_t)sum;
    /* Fail if a value is outside its field's range, or contradicts another part of the frame. */
    length = (uint8_t)size;
    if ((bin_crc8_classify(frame, length, 0U, &number) != BIN_CRC8_FRAME) || (number != length)) {
        return 0U;
    }
    bin_crc8_decode(frame, length, &again);
    if (again.pitch != message->pitch) {
        return 0U;
    }
    if (again.roll != message->roll) {
        return 0U;
    }
    if (again.yaw != message->yaw) {
        return 0U;
    }
    return size;
}

BIN_CRC8_FUNCTION void bin_crc8_init(bin_crc8_receiver *receiver)
{
    bin_crc8_clear(receiver, sizeof *receiver);
}

BIN_CRC8_FUNCTION uint32_t bin_crc8_pending(const bin_crc8_receiver *receiver)
{
    return receiver->count;
}

static inline void bin_crc8_count_discarded(bin_crc8_receiver *receiver, bin_crc8_outcome reason, uint8_t count)
{
    receiver->counters.discarded[reason] += count;
    receiver->is_lost = true;
}

static inline void bin_crc8_count_frame(bin_crc8_receiver *receiver, uint8_t length)
{
    receiver->counters.frames++;
    receiver->counters.frame_bytes += length;
    if (receiver->is_lost) {
        receiver->is_lost = false;
        receiver->counters.resynchronisations++;
    }
}

BIN_CRC8_FUNCTION bool bin_crc8_push(bin_crc8_receiver *receiver, uint8_t byte, bin_crc8_message *message)
{
    bin_crc8_outcome outcome = BIN_CRC8_INCOMPLETE;
    uint8_t number = 0U;
    uint8_t start = 0U;
    uint8_t i;

    receiver->counters.bytes++;
    receiver->held[receiver->count] = byte;
    receiver->count++;
    /* Discard bytes up to the first one that can begin a frame. */
    while (start < receiver->count) {
        outcome = bin_crc8_classify(&receiver->held[start], (uint8_t)(receiver->count - start), 0U, &number);
        if (outcome >= BIN_CRC8_FRAME) {
            break;
        }
        bin_crc8_count_discarded(receiver, outcome, 1U);
        start++;
    }
    if (outcome == BIN_CRC8_FRAME) {
        /* All frames have the same length, so this one is all of the pending bytes. */
        bin_crc8_decode(receiver->held, BIN_CRC8_LONGEST, message);
        bin_crc8_count_frame(receiver, BIN_CRC8_LONGEST);
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

BIN_CRC8_FUNCTION void bin_crc8_line_event(bin_crc8_receiver *receiver, bin_crc8_event event)
{
    receiver->counters.events[event]++;
    if (receiver->count > 0U) {
        bin_crc8_count_discarded(receiver, BIN_CRC8_LINE_EVENT, receiver->count);
        receiver->count = 0U;
    }
}
#endif

#endif
