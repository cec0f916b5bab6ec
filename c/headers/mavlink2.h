/* Frames of mavlink2. Made by `framelock generate --frame mavlink2 --language c`, version 0.1.0; do not edit.
 * SPDX-License-Identifier: 0BSD
 * You may use, change and ship this file without conditions.
 *
 * This header needs only a C99 or C++17 compiler. It allocates no memory and does not recurse.
 *
 *   static mavlink2_receiver receiver;
 *   mavlink2_message message;
 *
 *   mavlink2_init(&receiver);
 *   if (mavlink2_push(&receiver, byte, &message)) { ... }     for each received byte
 *   mavlink2_line_event(&receiver, MAVLINK2_FRAMING_ERROR, received, NULL);     instead of a damaged byte
 *
 * The counters satisfy this equation at any time, modulo 2^32:
 * counters.bytes == counters.frame_bytes + the sum of counters.discarded + mavlink2_pending(&receiver).
 *
 * Calls for one receiver must not interrupt each other. All functions are `static inline`. If several source files need
 * them, define MAVLINK2_DEFINITIONS as 1 in one of these files, and as 0 in the others, before they include this header:
 * then there is one copy of the code. */
#ifndef MAVLINK2_H
#define MAVLINK2_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifndef MAVLINK2_DEFINITIONS
#define MAVLINK2_FUNCTION static inline
#elif defined(__cplusplus)
#define MAVLINK2_FUNCTION extern "C"
#else
#define MAVLINK2_FUNCTION
#endif

/* The number of bytes in the longest frame. */
#define MAVLINK2_LONGEST 280U

/* The number of bytes in a receiver's buffer. With room for two longest frames, pending bytes are seldom moved. */
#ifndef MAVLINK2_ROOM
#define MAVLINK2_ROOM (2U * MAVLINK2_LONGEST)
#endif
#if (MAVLINK2_ROOM < MAVLINK2_LONGEST) || (MAVLINK2_ROOM > 65255U)
#error "MAVLINK2_ROOM must be between MAVLINK2_LONGEST and 65255"
#endif

/* The outcome of a classification: a frame, incomplete, or the reason why bytes are discarded. */
typedef enum {
    MAVLINK2_NO_SYNC, /* no frame begins with them */
    MAVLINK2_BAD_HEADER, /* the length is too small, or fixed bits are wrong */
    MAVLINK2_UNKNOWN_MESSAGE, /* the message is not in the list */
    MAVLINK2_CHECKSUM_MISMATCH, /* the checksum is wrong */
    MAVLINK2_LINE_EVENT, /* pending at a line event */
    MAVLINK2_REASONS, /* the number of reasons */
    MAVLINK2_FRAME = MAVLINK2_REASONS, /* a frame */
    MAVLINK2_INCOMPLETE /* more bytes are needed */
} mavlink2_outcome;

/* An event on the line, which the UART or a timer notices. */
typedef enum {
    MAVLINK2_FRAMING_ERROR,
    MAVLINK2_PARITY_ERROR,
    MAVLINK2_OVERRUN,
    MAVLINK2_BREAK,
    MAVLINK2_IDLE_LINE,
    MAVLINK2_EVENTS /* the number of events */
} mavlink2_event;

/* Counters. They wrap at 2^32. */
typedef struct {
    uint32_t bytes; /* received bytes */
    uint32_t frames; /* frames */
    uint32_t frame_bytes; /* bytes in frames */
    uint32_t resynchronisations; /* frames that follow discarded bytes */
    uint32_t discarded[MAVLINK2_REASONS]; /* discarded bytes, by reason */
    uint32_t events[MAVLINK2_EVENTS]; /* line events */
} mavlink2_counters;

/* The values of a frame. Pointers are valid until the next call for the receiver. */
typedef struct {
    /* At 3: u8. */
    uint8_t compatible_flags;
    /* At 4: u8. */
    uint8_t sequence;
    /* At 5: u8. */
    uint8_t system;
    /* At 6: u8. */
    uint8_t component;
    /* At 7: u24le. */
    uint32_t message;
    /* At 10: bytes. */
    const uint8_t *payload;
    uint16_t payload_length;
    /* After the frame. */
    bool has_signature;
    uint8_t signature[13];
} mavlink2_message;

/* A receiver. Read `counters`; the other members are private. */
typedef struct {
    mavlink2_counters counters;
    uint16_t from; /* the pending bytes are buffer[from] to buffer[to - 1] */
    uint16_t to;
    uint16_t ask_at; /* the next decision is possible when `to` reaches this index */
    bool is_lost; /* bytes were discarded since the last frame */
    uint8_t buffer[MAVLINK2_ROOM];
} mavlink2_receiver;

/* Starts a receiver. All counters are 0. */
MAVLINK2_FUNCTION void mavlink2_init(mavlink2_receiver *receiver);

/* Returns the number of pending bytes, which may still become part of a frame. */
MAVLINK2_FUNCTION uint32_t mavlink2_pending(const mavlink2_receiver *receiver);

/* Takes the next byte. If a frame is complete, returns true and writes its values to `*message`. Classifies bytes at most
 * once. So after a false start a complete frame may stay pending, until the following calls catch up. */
MAVLINK2_FUNCTION bool mavlink2_push(mavlink2_receiver *receiver, uint8_t byte, mavlink2_message *message);

/* Decides about pending bytes up to the next frame. If a frame is found, returns true and writes its values to
 * `*message`. If no byte follows soon, call this function until it returns false. */
MAVLINK2_FUNCTION bool mavlink2_poll(mavlink2_receiver *receiver, mavlink2_message *message);

/* Reports a line event: no more bytes follow the pending bytes. Calls `received` with each frame among them, and
 * discards the other bytes. `received` may be NULL. */
MAVLINK2_FUNCTION void mavlink2_line_event(mavlink2_receiver *receiver, mavlink2_event event,
    void (*received)(void *context, const mavlink2_message *message), void *context);

/* Reads the values of a frame. */
MAVLINK2_FUNCTION void mavlink2_decode(const uint8_t *frame, uint16_t length, mavlink2_message *message);

/* Writes a frame with these values. Returns its length, or 0 if `room` is too small or no frame has these values. */
MAVLINK2_FUNCTION size_t mavlink2_encode(const mavlink2_message *message, uint8_t *frame, size_t room);

#if !defined(MAVLINK2_DEFINITIONS) || MAVLINK2_DEFINITIONS

/* On AVR, tables stay in flash. */
#ifdef __AVR__
#include <avr/pgmspace.h>
#define MAVLINK2_IN_FLASH PROGMEM
#define MAVLINK2_READ_8(entry) pgm_read_byte(entry)
#define MAVLINK2_READ_16(entry) pgm_read_word(entry)
#define MAVLINK2_READ_32(entry) pgm_read_dword(entry)
#else
#define MAVLINK2_IN_FLASH
#define MAVLINK2_READ_8(entry) (*(entry))
#define MAVLINK2_READ_16(entry) (*(entry))
#define MAVLINK2_READ_32(entry) (*(entry))
#endif

/* Sets bytes to 0. */
static inline void mavlink2_clear(void *object, size_t size)
{
    uint8_t *byte = (uint8_t *)object;

    while (size > 0U) {
        *byte = 0U;
        byte++;
        size--;
    }
}

/* Copies bytes. */
static inline void mavlink2_copy(void *to, const void *from, size_t size)
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
static inline bool mavlink2_same(const void *one, const void *other, size_t size)
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
static inline uint16_t mavlink2_le16(const uint8_t *bytes)
{
    return (uint16_t)(((unsigned)bytes[1] << 8U) | bytes[0]);
}

/* Reads a number of three bytes, little-endian. */
static inline uint32_t mavlink2_le24(const uint8_t *bytes)
{
    return ((uint32_t)bytes[2] << 16U) | ((uint32_t)bytes[1] << 8U) | bytes[0];
}

/* Writes a number of `count` bytes, little-endian, by setting those bits that are 1. */
static inline void mavlink2_put_le(uint8_t *bytes, uint8_t count, uint32_t number)
{
    uint8_t i;

    for (i = 0U; i < count; i++) {
        bytes[i] = (uint8_t)(bytes[i] | (number & 0xFFU));
        number >>= 8U;
    }
}

/* Writes bytes by setting those bits that are 1. */
static inline void mavlink2_put(uint8_t *to, const uint8_t *bytes, size_t count)
{
    size_t i;

    for (i = 0U; i < count; i++) {
        to[i] = (uint8_t)(to[i] | bytes[i]);
    }
}

/* Returns whether a frame can begin with this byte. */
static inline bool mavlink2_starts(uint8_t byte)
{
    return byte == 0xFDU;
}

/* Returns the CRC of bytes, followed by `extra`. */
static inline uint16_t mavlink2_checksum(const uint8_t *bytes, uint16_t count, uint8_t extra)
{
    /* The remainder of each value of four bits. */
    static const uint16_t table[16] MAVLINK2_IN_FLASH = {
        0x0000U, 0x1081U, 0x2102U, 0x3183U, 0x4204U, 0x5285U, 0x6306U, 0x7387U, 0x8408U, 0x9489U, 0xA50AU, 0xB58BU,
        0xC60CU, 0xD68DU, 0xE70EU, 0xF78FU
    };
    uint16_t sum = 0xFFFFU;
    uint16_t i;

    for (i = 0U; i < count + 1U; i++) {
        const uint8_t byte = (i < count) ? bytes[i] : extra;

        sum = (uint16_t)(sum ^ byte);
        sum = (uint16_t)((sum >> 4U) ^ MAVLINK2_READ_16(&table[sum & 0x0FU]));
        sum = (uint16_t)((sum >> 4U) ^ MAVLINK2_READ_16(&table[sum & 0x0FU]));
    }
    return sum;
}

/* The number of known messages. */
#define MAVLINK2_MESSAGES 325U

/* Returns the index of a message, or MAVLINK2_MESSAGES if it is unknown. A binary search. */
static inline uint16_t mavlink2_find(uint32_t message)
{
    static const uint16_t numbers[325] MAVLINK2_IN_FLASH = {
        0x0000U, 0x0001U, 0x0002U, 0x0004U, 0x0005U, 0x0006U, 0x0007U, 0x0008U, 0x000BU, 0x0014U, 0x0015U, 0x0016U,
        0x0017U, 0x0018U, 0x0019U, 0x001AU, 0x001BU, 0x001CU, 0x001DU, 0x001EU, 0x001FU, 0x0020U, 0x0021U, 0x0022U,
        0x0023U, 0x0024U, 0x0025U, 0x0026U, 0x0027U, 0x0028U, 0x0029U, 0x002AU, 0x002BU, 0x002CU, 0x002DU, 0x002EU,
        0x002FU, 0x0030U, 0x0031U, 0x0032U, 0x0033U, 0x0036U, 0x0037U, 0x003DU, 0x003EU, 0x003FU, 0x0040U, 0x0041U,
        0x0042U, 0x0043U, 0x0045U, 0x0046U, 0x0049U, 0x004AU, 0x004BU, 0x004CU, 0x004DU, 0x0050U, 0x0051U, 0x0052U,
        0x0053U, 0x0054U, 0x0055U, 0x0056U, 0x0057U, 0x0059U, 0x005AU, 0x005BU, 0x005CU, 0x005DU, 0x0064U, 0x0065U,
        0x0066U, 0x0067U, 0x0068U, 0x0069U, 0x006AU, 0x006BU, 0x006CU, 0x006DU, 0x006EU, 0x006FU, 0x0070U, 0x0071U,
        0x0072U, 0x0073U, 0x0074U, 0x0075U, 0x0076U, 0x0077U, 0x0078U, 0x0079U, 0x007AU, 0x007BU, 0x007CU, 0x007DU,
        0x007EU, 0x007FU, 0x0080U, 0x0081U, 0x0082U, 0x0083U, 0x0084U, 0x0085U, 0x0086U, 0x0087U, 0x0088U, 0x0089U,
        0x008AU, 0x008BU, 0x008CU, 0x008DU, 0x008EU, 0x008FU, 0x0090U, 0x0092U, 0x0093U, 0x0094U, 0x0095U, 0x0096U,
        0x0097U, 0x0098U, 0x0099U, 0x009AU, 0x009BU, 0x009CU, 0x009DU, 0x009EU, 0x00A0U, 0x00A1U, 0x00A2U, 0x00A3U,
        0x00A4U, 0x00A5U, 0x00A6U, 0x00A7U, 0x00A8U, 0x00A9U, 0x00AAU, 0x00ABU, 0x00ACU, 0x00ADU, 0x00AEU, 0x00AFU,
        0x00B0U, 0x00B1U, 0x00B2U, 0x00B3U, 0x00B4U, 0x00B5U, 0x00B6U, 0x00B7U, 0x00B8U, 0x00B9U, 0x00BAU, 0x00BFU,
        0x00C0U, 0x00C1U, 0x00C2U, 0x00C3U, 0x00C8U, 0x00C9U, 0x00D6U, 0x00D7U, 0x00D8U, 0x00D9U, 0x00DAU, 0x00DBU,
        0x00E1U, 0x00E2U, 0x00E6U, 0x00E7U, 0x00E8U, 0x00E9U, 0x00EAU, 0x00EBU, 0x00F1U, 0x00F2U, 0x00F3U, 0x00F4U,
        0x00F5U, 0x00F6U, 0x00F7U, 0x00F8U, 0x00F9U, 0x00FAU, 0x00FBU, 0x00FCU, 0x00FDU, 0x00FEU, 0x0100U, 0x0101U,
        0x0102U, 0x0103U, 0x0104U, 0x0105U, 0x0106U, 0x0107U, 0x0108U, 0x0109U, 0x010AU, 0x010BU, 0x010CU, 0x010DU,
        0x010EU, 0x010FU, 0x0113U, 0x0114U, 0x0115U, 0x0118U, 0x0119U, 0x011AU, 0x011BU, 0x011CU, 0x011DU, 0x011EU,
        0x011FU, 0x0120U, 0x0122U, 0x0123U, 0x0127U, 0x0128U, 0x012BU, 0x012CU, 0x012DU, 0x0136U, 0x0137U, 0x0140U,
        0x0141U, 0x0142U, 0x0143U, 0x0144U, 0x014AU, 0x014BU, 0x014CU, 0x014DU, 0x014EU, 0x014FU, 0x0150U, 0x0153U,
        0x0154U, 0x0159U, 0x015EU, 0x0168U, 0x0169U, 0x0172U, 0x0173U, 0x0174U, 0x0175U, 0x0177U, 0x0178U, 0x017CU,
        0x0181U, 0x0182U, 0x0183U, 0x0184U, 0x0186U, 0x018BU, 0x018CU, 0x018DU, 0x0190U, 0x0191U, 0x019AU, 0x019BU,
        0x019CU, 0x019DU, 0x01B3U, 0x01B4U, 0x01B5U, 0x01B8U, 0x2328U, 0x232DU, 0x2711U, 0x2712U, 0x2713U, 0x2714U,
        0x2715U, 0x2716U, 0x2717U, 0x2718U, 0x27A7U, 0x2AF8U, 0x2AF9U, 0x2AFAU, 0x2AFBU, 0x2AFCU, 0x2AFDU, 0x2B02U,
        0x2B03U, 0x2B0CU, 0x2B16U, 0x2B17U, 0x2B18U, 0x2B19U, 0x2B1AU, 0x2B1BU, 0x2B1CU, 0x2B1DU, 0x2B1EU, 0x2B1FU,
        0x2B20U, 0x2B21U, 0x2B22U, 0x2B23U, 0x2B24U, 0x2B34U, 0x3264U, 0x3265U, 0x3266U, 0x3267U, 0x3268U, 0x3269U,
        0x3273U, 0x3276U, 0x3277U, 0x3278U, 0xA410U, 0xA411U, 0xC351U, 0xC352U, 0xC353U, 0xC354U, 0xC355U, 0xCB20U,
        0xCB21U
    };
    uint16_t low = 0U;
    uint16_t high = MAVLINK2_MESSAGES;

    while (low < high) {
        const uint16_t middle = (uint16_t)((unsigned)(low + high) / 2U);

        if (MAVLINK2_READ_16(&numbers[middle]) < message) {
            low = (uint16_t)(middle + 1U);
        } else {
            high = middle;
        }
    }
    if ((low < MAVLINK2_MESSAGES) && (MAVLINK2_READ_16(&numbers[low]) == message)) {
        return low;
    }
    return MAVLINK2_MESSAGES;
}

/* Returns the byte that the checksum covers although it is not sent. */
static inline uint8_t mavlink2_extra(uint16_t message)
{
    static const uint8_t extra[325] MAVLINK2_IN_FLASH = {
        0x32U, 0x7CU, 0x89U, 0xEDU, 0xD9U, 0x68U, 0x77U, 0x75U, 0x59U, 0xD6U, 0x9FU, 0xDCU,
        0xA8U, 0x18U, 0x17U, 0xAAU, 0x90U, 0x43U, 0x73U, 0x27U, 0xF6U, 0xB9U, 0x68U, 0xEDU,
        0xF4U, 0xDEU, 0xD4U, 0x09U, 0xFEU, 0xE6U, 0x1CU, 0x1CU, 0x84U, 0xDDU, 0xE8U, 0x0BU,
        0x99U, 0x29U, 0x27U, 0x4EU, 0xC4U, 0x0FU, 0x03U, 0xA7U, 0xB7U, 0x77U, 0xBFU, 0x76U,
        0x94U, 0x15U, 0xF3U, 0x7CU, 0x26U, 0x14U, 0x9EU, 0x98U, 0x8FU, 0x0EU, 0x6AU, 0x31U,
        0x16U, 0x8FU, 0x8CU, 0x05U, 0x96U, 0xE7U, 0xB7U, 0x3FU, 0x36U, 0x2FU, 0xAFU, 0x66U,
        0x9EU, 0xD0U, 0x38U, 0x5DU, 0x8AU, 0x6CU, 0x20U, 0xB9U, 0x54U, 0x22U, 0xAEU, 0x7CU,
        0xEDU, 0x04U, 0x4CU, 0x80U, 0x38U, 0x74U, 0x86U, 0xEDU, 0xCBU, 0xFAU, 0x57U, 0xCBU,
        0xDCU, 0x19U, 0xE2U, 0x2EU, 0x1DU, 0xDFU, 0x55U, 0x06U, 0xE5U, 0xCBU, 0x01U, 0xC3U,
        0x6DU, 0xA8U, 0xB5U, 0x2FU, 0x48U, 0x83U, 0x7FU, 0x67U, 0x9AU, 0xB2U, 0xC8U, 0x86U,
        0xDBU, 0xD0U, 0xBCU, 0x54U, 0x16U, 0x13U, 0x15U, 0x86U, 0x4EU, 0x44U, 0xBDU, 0x7FU,
        0x9AU, 0x15U, 0x15U, 0x90U, 0x01U, 0xEAU, 0x49U, 0xB5U, 0x16U, 0x53U, 0xA7U, 0x8AU,
        0xEAU, 0xF0U, 0x2FU, 0xBDU, 0x34U, 0xAEU, 0xE5U, 0x55U, 0x9FU, 0xBAU, 0x48U, 0x5CU,
        0x24U, 0x47U, 0x62U, 0x78U, 0x86U, 0xCDU, 0x45U, 0x65U, 0x32U, 0xCAU, 0x11U, 0xA2U,
        0xD0U, 0xCFU, 0xA3U, 0x69U, 0x97U, 0x23U, 0x96U, 0xB3U, 0x5AU, 0x68U, 0x55U, 0x5FU,
        0x82U, 0xB8U, 0x51U, 0x08U, 0xCCU, 0x31U, 0xAAU, 0x2CU, 0x53U, 0x2EU, 0x47U, 0x83U,
        0xBBU, 0x5CU, 0x92U, 0xB3U, 0x0CU, 0x85U, 0x31U, 0x1AU, 0xC1U, 0x23U, 0x0EU, 0x6DU,
        0x3BU, 0x16U, 0x7EU, 0x12U, 0x3EU, 0x46U, 0x30U, 0x7BU, 0x4AU, 0x63U, 0x89U, 0xD2U,
        0x01U, 0x14U, 0xFBU, 0x0AU, 0xEAU, 0x9EU, 0x13U, 0xD9U, 0xF3U, 0x1CU, 0x5FU, 0xF3U,
        0x58U, 0xF3U, 0x4EU, 0x84U, 0x17U, 0x5BU, 0xECU, 0xE7U, 0x48U, 0xE1U, 0xF5U, 0xC7U,
        0x63U, 0xD1U, 0xE8U, 0x0BU, 0x5DU, 0x4BU, 0x0AU, 0x1AU, 0x75U, 0xFBU, 0xC7U, 0xE8U,
        0x93U, 0x84U, 0x04U, 0x08U, 0x9CU, 0x00U, 0x32U, 0xB6U, 0x6EU, 0xB7U, 0xA0U, 0x6AU,
        0x21U, 0x4DU, 0x86U, 0xC1U, 0x1EU, 0x42U, 0x71U, 0x75U, 0xD1U, 0xBAU, 0x04U, 0x85U,
        0x67U, 0xC1U, 0x47U, 0xF0U, 0xC3U, 0x86U, 0x0FU, 0xEAU, 0x40U, 0x0BU, 0x5DU, 0x2EU,
        0x6AU, 0xCDU, 0x90U, 0x85U, 0x55U, 0xC3U, 0x4FU, 0x80U, 0xB1U, 0x82U, 0x2FU, 0x8EU,
        0x84U, 0xD0U, 0xC9U, 0xC1U, 0xBDU, 0xA2U, 0x72U, 0xFEU, 0x8CU, 0xF9U, 0x4DU, 0x31U,
        0x5EU, 0x8BU, 0x07U, 0x14U, 0xE3U, 0xEFU, 0xF6U, 0xB5U, 0x3EU, 0xF0U, 0x98U, 0x0DU,
        0xEFU
    };
    return MAVLINK2_READ_8(&extra[message]);
}

/* Classifies one byte or more. The first `seen` bytes must be incomplete; `seen` may be 0. If the bytes begin with a
 * frame, sets `*number` to its length. If they are incomplete, sets `*number` to the number of bytes needed to decide
 * more. */
static inline mavlink2_outcome mavlink2_classify(const uint8_t *bytes, uint16_t count, uint16_t seen, uint16_t *number)
{
    uint8_t field;
    uint16_t length;
    uint16_t message;
    uint16_t whole;

    (void)seen;
    /* The sync. */
    if (!mavlink2_starts(bytes[0])) {
        return MAVLINK2_NO_SYNC;
    }
    if (count < 10U) {
        *number = 10U;
        return MAVLINK2_INCOMPLETE;
    }
    /* The header. */
    if ((bytes[2U] & 0xFEU) != 0x00U) {
        return MAVLINK2_BAD_HEADER;
    }
    message = mavlink2_find(mavlink2_le24(&bytes[7U]));
    if (message == MAVLINK2_MESSAGES) {
        return MAVLINK2_UNKNOWN_MESSAGE;
    }
    field = bytes[1U];
    length = (uint16_t)(field + 12U);
    whole = length;
    if ((bytes[2] & 0x01U) != 0U) {
        whole = (uint16_t)(length + 13U);
    }
    if (count < whole) {
        *number = whole;
        return MAVLINK2_INCOMPLETE;
    }
    /* The checksum. */
    if (mavlink2_checksum(&bytes[1U], (uint16_t)(length - 3U), mavlink2_extra(message)) != mavlink2_le16(&bytes[length - 2U])) {
        return MAVLINK2_CHECKSUM_MISMATCH;
    }
    *number = whole;
    return MAVLINK2_FRAME;
}

MAVLINK2_FUNCTION void mavlink2_decode(const uint8_t *frame, uint16_t length, mavlink2_message *message)
{
    const bool has_trailer = (frame[2] & 0x01U) != 0U;
    if (has_trailer) {
        length = (uint16_t)(length - 13U);
    }
    mavlink2_clear(message, sizeof *message);
    message->compatible_flags = frame[3U];
    message->sequence = frame[4U];
    message->system = frame[5U];
    message->component = frame[6U];
    message->message = (uint32_t)(mavlink2_le24(&frame[7U]));
    message->payload = &frame[10U];
    message->payload_length = (uint16_t)(length - 12U);
    message->has_signature = has_trailer;
    if (message->has_signature) {
        mavlink2_copy(message->signature, &frame[length], 13U);
    }
}

MAVLINK2_FUNCTION size_t mavlink2_encode(const mavlink2_message *message, uint8_t *frame, size_t room)
{

    size_t size = 12U;
    uint16_t length;
    uint16_t number = 0U;
    uint32_t field;
    uint16_t known;
    uint16_t sum;
    mavlink2_message again;

    if (message->payload_length > 280U) {
        return 0U;
    }
    size += message->payload_length;
    length = (uint16_t)size;
    if (message->has_signature) {
        size += 13U;
    }
    if ((size > 280U) || (room < size)) {
        return 0U;
    }
    mavlink2_clear(frame, size);
    if (message->has_signature) {
        frame[2] = 0x01U;
        mavlink2_copy(&frame[length], message->signature, 13U);
    }
    frame[3U] = (uint8_t)(frame[3U] | message->compatible_flags);
    frame[4U] = (uint8_t)(frame[4U] | message->sequence);
    frame[5U] = (uint8_t)(frame[5U] | message->system);
    frame[6U] = (uint8_t)(frame[6U] | message->component);
    mavlink2_put_le(&frame[7U], 3U, message->message);
    mavlink2_put(&frame[10U], message->payload, message->payload_length);
    frame[0] = 0xFDU;
    field = (uint32_t)length - 12U;
    frame[1U] = (uint8_t)field;
    frame[2U] = (uint8_t)((frame[2U] & 0x01U) | 0x00U);
    known = mavlink2_find(mavlink2_le24(&frame[7U]));
    if (known == MAVLINK2_MESSAGES) {
        return 0U;
    }
    sum = mavlink2_checksum(&frame[1U], (uint16_t)(length - 3U), mavlink2_extra(known));
    frame[length - 2U] = (uint8_t)sum;
    frame[length - 1U] = (uint8_t)(sum >> 8U);
    /* Fail if a value is outside its field's range, or contradicts another part of the frame. */
    length = (uint16_t)size;
    if ((mavlink2_classify(frame, length, 0U, &number) != MAVLINK2_FRAME) || (number != length)) {
        return 0U;
    }
    mavlink2_decode(frame, length, &again);
    if (again.compatible_flags != message->compatible_flags) {
        return 0U;
    }
    if (again.sequence != message->sequence) {
        return 0U;
    }
    if (again.system != message->system) {
        return 0U;
    }
    if (again.component != message->component) {
        return 0U;
    }
    if (again.message != message->message) {
        return 0U;
    }
    if ((again.payload_length != message->payload_length) || !mavlink2_same(again.payload, message->payload, again.payload_length)) {
        return 0U;
    }
    if ((again.has_signature != message->has_signature) || (again.has_signature && (!mavlink2_same(&again.signature, &message->signature, sizeof again.signature)))) {
        return 0U;
    }
    return size;
}

MAVLINK2_FUNCTION void mavlink2_init(mavlink2_receiver *receiver)
{
    mavlink2_clear(receiver, sizeof *receiver);
}

MAVLINK2_FUNCTION uint32_t mavlink2_pending(const mavlink2_receiver *receiver)
{
    return (uint32_t)receiver->to - receiver->from;
}

static inline void mavlink2_count_discarded(mavlink2_receiver *receiver, mavlink2_outcome reason, uint16_t count)
{
    receiver->counters.discarded[reason] += count;
    receiver->is_lost = true;
}

static inline void mavlink2_count_frame(mavlink2_receiver *receiver, uint16_t length)
{
    receiver->counters.frames++;
    receiver->counters.frame_bytes += length;
    if (receiver->is_lost) {
        receiver->is_lost = false;
        receiver->counters.resynchronisations++;
    }
}

/* Forgets the pending bytes. */
static inline void mavlink2_forget(mavlink2_receiver *receiver)
{
    receiver->from = 0U;
    receiver->to = 0U;
    receiver->ask_at = 0U;
}

/* Decides about the first pending bytes. Classifies bytes at most once. If they are a frame, moves `from` past it and
 * returns its length, otherwise returns 0. Sets `*again` to false if the next decision needs more bytes. */
static inline uint16_t mavlink2_next(mavlink2_receiver *receiver, bool *again)
{
    mavlink2_outcome outcome;
    uint16_t number = 0U;
    uint16_t seen;
    const uint16_t start = receiver->from;

    *again = false;
    if (receiver->to < receiver->ask_at) {
        return 0U;
    }
    /* If the first byte has not been classified yet, skip bytes that cannot begin a frame. */
    if (receiver->ask_at <= (receiver->from + 1U)) {
        while ((receiver->from < receiver->to) && !mavlink2_starts(receiver->buffer[receiver->from])) {
            receiver->from++;
        }
        if (receiver->from > start) {
            mavlink2_count_discarded(receiver, MAVLINK2_NO_SYNC, (uint16_t)(receiver->from - start));
            receiver->ask_at = 0U;
        }
    }
    if (receiver->from == receiver->to) {
        mavlink2_forget(receiver);
        return 0U;
    }
    seen = (receiver->ask_at > receiver->from) ? (uint16_t)(receiver->ask_at - (receiver->from + 1U)) : (uint16_t)0U;
    receiver->ask_at = 0U;
    outcome = mavlink2_classify(&receiver->buffer[receiver->from], (uint16_t)(receiver->to - receiver->from), seen, &number);
    if (outcome == MAVLINK2_INCOMPLETE) {
        receiver->ask_at = (uint16_t)(receiver->from + number);
        return 0U;
    }
    *again = true;
    if (outcome == MAVLINK2_FRAME) {
        receiver->from = (uint16_t)(receiver->from + number);
        mavlink2_count_frame(receiver, number);
        return number;
    }
    receiver->from++;
    mavlink2_count_discarded(receiver, outcome, 1U);
    return 0U;
}

/* Moves the pending bytes to the front of the buffer. */
static inline void mavlink2_move_to_front(mavlink2_receiver *receiver)
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

MAVLINK2_FUNCTION bool mavlink2_push(mavlink2_receiver *receiver, uint8_t byte, mavlink2_message *message)
{
    uint16_t length;
    bool again;

    receiver->counters.bytes++;
    if (((receiver->to + 1U) < receiver->ask_at) && (receiver->to < MAVLINK2_ROOM)) {
        /* No decision is possible yet: only store the byte. */
        receiver->buffer[receiver->to] = byte;
        receiver->to++;
        return false;
    }
    if (receiver->from == receiver->to) {
        mavlink2_forget(receiver);
        if (!mavlink2_starts(byte)) {
            mavlink2_count_discarded(receiver, MAVLINK2_NO_SYNC, 1U);
            return false;
        }
    }
    if (receiver->to == MAVLINK2_ROOM) {
        mavlink2_move_to_front(receiver);
    }
    receiver->buffer[receiver->to] = byte;
    receiver->to++;
    length = mavlink2_next(receiver, &again);
    if (length == 0U) {
        return false;
    }
    mavlink2_decode(&receiver->buffer[receiver->from - length], length, message);
    return true;
}

MAVLINK2_FUNCTION bool mavlink2_poll(mavlink2_receiver *receiver, mavlink2_message *message)
{
    uint16_t length;
    bool again;

    /* Each iteration except the last decides about at least one pending byte. */
    do {
        length = mavlink2_next(receiver, &again);
        if (length > 0U) {
            mavlink2_decode(&receiver->buffer[receiver->from - length], length, message);
            return true;
        }
    } while (again);
    return false;
}

MAVLINK2_FUNCTION void mavlink2_line_event(mavlink2_receiver *receiver, mavlink2_event event,
    void (*received)(void *context, const mavlink2_message *message), void *context)
{
    mavlink2_message message;

    receiver->counters.events[event]++;
    while (receiver->from < receiver->to) {
        if (mavlink2_poll(receiver, &message)) {
            if (received != NULL) {
                received(context, &message);
            }
        } else if (receiver->from < receiver->to) {
            /* No more bytes follow, so the first pending byte starts no frame.
             * Reset `ask_at`, which described the discarded byte. */
            receiver->from++;
            receiver->ask_at = 0U;
            mavlink2_count_discarded(receiver, MAVLINK2_LINE_EVENT, 1U);
        }
    }
    mavlink2_forget(receiver);
}
#endif

#endif
