/* Frames of bin. Made by `framelock generate --frame bin --language c`, version 0.1.0; do not edit.
 * SPDX-License-Identifier: 0BSD
 * You may use, change and ship this file without conditions.
 *
 * This header needs only a C99 or C++17 compiler. It allocates no memory and does not recurse.
 *
 *   static bin_receiver receiver;
 *   bin_message message;
 *
 *   bin_init(&receiver);
 *   if (bin_push(&receiver, byte, &message)) { ... }     for each received byte
 *   bin_line_event(&receiver, BIN_FRAMING_ERROR);     instead of a damaged byte
 *
 * The counters satisfy this equation at any time, modulo 2^32:
 * counters.bytes == counters.frame_bytes + the sum of counters.discarded + bin_pending(&receiver).
 *
 * Calls for one receiver must not interrupt each other. All functions are `static inline`. If several source files need
 * them, define BIN_DEFINITIONS as 1 in one of these files, and as 0 in the others, before they include this header:
 * then there is one copy of the code. */
#ifndef BIN_H
#define BIN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifndef BIN_DEFINITIONS
#define BIN_FUNCTION static inline
#elif defined(__cplusplus)
#define BIN_FUNCTION extern "C"
#else
#define BIN_FUNCTION
#endif

/* The number of bytes in the longest frame. */
#define BIN_LONGEST 7U

/* The outcome of a classification: a frame, incomplete, or the reason why bytes are discarded. */
typedef enum {
    BIN_NO_SYNC, /* no frame begins with them */
    BIN_BROKEN_SYNC, /* a later byte of the sync is wrong */
    BIN_WRONG_TERMINATOR, /* the terminator or fixed bits are wrong */
    BIN_LINE_EVENT, /* pending at a line event */
    BIN_REASONS, /* the number of reasons */
    BIN_FRAME = BIN_REASONS, /* a frame */
    BIN_INCOMPLETE /* more bytes are needed */
} bin_outcome;

/* An event on the line, which the UART or a timer notices. */
typedef enum {
    BIN_FRAMING_ERROR,
    BIN_PARITY_ERROR,
    BIN_OVERRUN,
    BIN_BREAK,
    BIN_IDLE_LINE,
    BIN_EVENTS /* the number of events */
} bin_event;

/* Counters. They wrap at 2^32. */
typedef struct {
    uint32_t bytes; /* received bytes */
    uint32_t frames; /* frames */
    uint32_t frame_bytes; /* bytes in frames */
    uint32_t resynchronisations; /* frames that follow discarded bytes */
    uint32_t discarded[BIN_REASONS]; /* discarded bytes, by reason */
    uint32_t events[BIN_EVENTS]; /* line events */
} bin_counters;

/* The values of a frame. */
typedef struct {
    /* At 3: u8. */
    uint8_t pitch;
    /* At 4: u8. */
    uint8_t roll;
    /* At 5: u8. */
    uint8_t yaw;
} bin_message;

/* A receiver. Read `counters`; the other members are private. */
typedef struct {
    bin_counters counters;
    uint8_t held[BIN_LONGEST]; /* the pending bytes */
    uint8_t count; /* the number of pending bytes */
    bool is_lost; /* bytes were discarded since the last frame */
} bin_receiver;

/* Starts a receiver. All counters are 0. */
BIN_FUNCTION void bin_init(bin_receiver *receiver);

/* Returns the number of pending bytes, which may still become part of a frame. */
BIN_FUNCTION uint32_t bin_pending(const bin_receiver *receiver);

/* Takes the next byte. If it completes a frame, returns true and writes the frame's values to `*message`. */
BIN_FUNCTION bool bin_push(bin_receiver *receiver, uint8_t byte, bin_message *message);

/* Reports a line event. Discards the pending bytes, because the rest of their frame is lost. */
BIN_FUNCTION void bin_line_event(bin_receiver *receiver, bin_event event);

/* Reads the values of a frame. */
BIN_FUNCTION void bin_decode(const uint8_t *frame, uint8_t length, bin_message *message);

/* Writes a frame with these values. Returns its length, or 0 if `room` is too small or no frame has these values. */
BIN_FUNCTION size_t bin_encode(const bin_message *message, uint8_t *frame, size_t room);

#if !defined(BIN_DEFINITIONS) || BIN_DEFINITIONS

/* Sets bytes to 0. */
static inline void bin_clear(void *object, size_t size)
{
    uint8_t *byte = (uint8_t *)object;

    while (size > 0U) {
        *byte = 0U;
        byte++;
        size--;
    }
}

/* Returns whether a frame can begin with this byte. */
static inline bool bin_starts(uint8_t byte)
{
    return byte == 0x41U;
}

/* Classifies one byte or more. The first `seen` bytes must be incomplete; `seen` may be 0. If the bytes begin with a
 * frame, sets `*number` to its length. If they are incomplete, sets `*number` to the number of bytes needed to decide
 * more. */
static inline bin_outcome bin_classify(const uint8_t *bytes, uint8_t count, uint8_t seen, uint8_t *number)
{
    uint8_t length;

    (void)seen;
    /* The sync. */
    if (!bin_starts(bytes[0])) {
        return BIN_NO_SYNC;
    }
    if ((count > 1U) && (bytes[1] != 0x42U)) {
        return BIN_BROKEN_SYNC;
    }
    if (count < 2U) {
        *number = (uint8_t)(count + 1U);
        return BIN_INCOMPLETE;
    }
    length = 7U;
    if (count < length) {
        *number = length;
        return BIN_INCOMPLETE;
    }
    /* The terminator. */
    if (bytes[length - 1U] != 0x0DU) {
        return BIN_WRONG_TERMINATOR;
    }
    *number = length;
    return BIN_FRAME;
}

BIN_FUNCTION void bin_decode(const uint8_t *frame, uint8_t length, bin_message *message)
{
    (void)length;
    message->pitch = frame[3U];
    message->roll = frame[4U];
    message->yaw = frame[5U];
}

BIN_FUNCTION size_t bin_encode(const bin_message *message, uint8_t *frame, size_t room)
{

    const size_t size = 7U;
    uint8_t length;
    uint8_t number = 0U;
    bin_message again;

    length = (uint8_t)size;
    if (room < size) {
        return 0U;
    }
    bin_clear(frame, size);
    frame[3U] = (uint8_t)(frame[3U] | message->pitch);
    frame[4U] = (uint8_t)(frame[4U] | message->roll);
    frame[5U] = (uint8_t)(frame[5U] | message->yaw);
    frame[0] = 0x41U;
    frame[1] = 0x42U;
    frame[length - 1U] = 0x0DU;
    /* Fail if a value is outside its field's range, or contradicts another part of the frame. */
    length = (uint8_t)size;
    if ((bin_classify(frame, length, 0U, &number) != BIN_FRAME) || (number != length)) {
        return 0U;
    }
    bin_decode(frame, length, &again);
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

BIN_FUNCTION void bin_init(bin_receiver *receiver)
{
    bin_clear(receiver, sizeof *receiver);
}

BIN_FUNCTION uint32_t bin_pending(const bin_receiver *receiver)
{
    return receiver->count;
}

static inline void bin_count_discarded(bin_receiver *receiver, bin_outcome reason, uint8_t count)
{
    receiver->counters.discarded[reason] += count;
    receiver->is_lost = true;
}

static inline void bin_count_frame(bin_receiver *receiver, uint8_t length)
{
    receiver->counters.frames++;
    receiver->counters.frame_bytes += length;
    if (receiver->is_lost) {
        receiver->is_lost = false;
        receiver->counters.resynchronisations++;
    }
}

BIN_FUNCTION bool bin_push(bin_receiver *receiver, uint8_t byte, bin_message *message)
{
    bin_outcome outcome = BIN_INCOMPLETE;
    uint8_t number = 0U;
    uint8_t start = 0U;
    uint8_t i;

    receiver->counters.bytes++;
    receiver->held[receiver->count] = byte;
    receiver->count++;
    /* Discard bytes up to the first one that can begin a frame. */
    while (start < receiver->count) {
        outcome = bin_classify(&receiver->held[start], (uint8_t)(receiver->count - start), 0U, &number);
        if (outcome >= BIN_FRAME) {
            break;
        }
        bin_count_discarded(receiver, outcome, 1U);
        start++;
    }
    if (outcome == BIN_FRAME) {
        /* All frames have the same length, so this one is all of the pending bytes. */
        bin_decode(receiver->held, BIN_LONGEST, message);
        bin_count_frame(receiver, BIN_LONGEST);
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

BIN_FUNCTION void bin_line_event(bin_receiver *receiver, bin_event event)
{
    receiver->counters.events[event]++;
    if (receiver->count > 0U) {
        bin_count_discarded(receiver, BIN_LINE_EVENT, receiver->count);
        receiver->count = 0U;
    }
}
#endif

#endif
