/* Takes steps, and prints the result of each: a received frame as the number of its layout and its bytes, the counters
 * as numbers. The first byte selects one of the lines below. Steps:
 * 'b' and a byte: the byte is received. 'p': poll. 'e' and a number: a line event. 'c': print the counters.
 * 's', a layout, a length and that many bytes: seal the bytes. */
#include "steps.h"

/* The library's own layouts, written in C as a user of the library would write them. */

static const framelock_fixed_bits sbus_fixed[] = {{23, 0xF0, 0}};
static const framelock_layout own_sbus[] = {{
    .sync = {(const uint8_t *)"\x0F", 1, 1},
    .longest = 25,
    .fixed = sbus_fixed,
    .fixed_count = 1,
    .terminator = {(const uint8_t *)"\x00\x04\x14\x24\x34", 1, 5},
}};

static const framelock_layout own_ibus[] = {{
    .sync = {(const uint8_t *)"\x20\x40", 2, 1},
    .longest = 32,
    .checksum = {.algorithm = FRAMELOCK_INVERTED_SUM, .bytes = 2, .at = -2, .to = -3},
}};

static const framelock_layout own_crsf[] = {{
    .sync = {(const uint8_t *)"\xC8\x00\xEA\xEC\xEE", 1, 5},
    .length = {.kind = FRAMELOCK_LENGTH_FIELD, .number = {.at = 1, .bytes = 1}, .plus = 2},
    .shortest = 4,
    .longest = 64,
    .checksum = {.algorithm = FRAMELOCK_CRC, .bytes = 1, .at = -1, .from = 2, .to = -2,
                 .crc = {.width = 8, .polynomial = 0xD5}},
}};

static const framelock_fixed_bits nmea_fixed[] = {{-5, 0xFF, '*'}};
static const framelock_fixed_bits rtcm_fixed[] = {{1, 0xFC, 0}};
static const framelock_layout own_gnss[] = {
    {
        .sync = {(const uint8_t *)"\xB5\x62", 2, 1},
        .length = {.kind = FRAMELOCK_LENGTH_FIELD, .number = {.at = 4, .bytes = 2}, .plus = 8},
        .shortest = 8,
        .longest = 100,
        .checksum = {.algorithm = FRAMELOCK_FLETCHER, .bytes = 2, .at = -2, .from = 2, .to = -3},
    },
    {
        .sync = {(const uint8_t *)"$!", 1, 2},
        .length = {.kind = FRAMELOCK_DELIMITER},
        .shortest = 7,
        .longest = 128,
        .fixed = nmea_fixed,
        .fixed_count = 1,
        .checksum = {.algorithm = FRAMELOCK_XOR, .written = FRAMELOCK_HEX, .bytes = 1, .at = -4, .from = 1,
                     .to = -6},
        .terminator = {(const uint8_t *)"\r\n", 2, 1},
    },
    {
        .sync = {(const uint8_t *)"\xD3", 1, 1},
        .length = {.kind = FRAMELOCK_LENGTH_FIELD, .number = {.at = 1, .bytes = 2, .big_endian = true},
                   .mask = 0x03FF, .plus = 6},
        .shortest = 6,
        .longest = 1029,
        .fixed = rtcm_fixed,
        .fixed_count = 1,
        .checksum = {.algorithm = FRAMELOCK_CRC, .written = FRAMELOCK_BIG_ENDIAN, .bytes = 3, .at = -3,
                     .to = -4, .crc = {.width = 24, .polynomial = 0x864CFB}},
    },
};

static const framelock_message messages[] = {{0, 9, 50, true}, {30, 28, 39, true}, {253, 54, 83, true}};
static const framelock_fixed_bits mavlink_fixed[] = {{2, 0xFE, 0}};
#define MAVLINK_CRC                                                                                     \
    {                                                                                                   \
        .algorithm = FRAMELOCK_CRC, .bytes = 2, .at = -2, .from = 1, .to = -3,                          \
        .crc = {.width = 16, .polynomial = 0x1021, .initial = 0xFFFF, .reflected_in = true,             \
                .reflected_out = true},                                                                 \
    }
static const framelock_layout own_mavlink[] = {
    {
        .sync = {(const uint8_t *)"\xFE", 1, 1},
        .length = {.kind = FRAMELOCK_LENGTH_FIELD, .number = {.at = 1, .bytes = 1}, .plus = 8},
        .shortest = 8,
        .longest = 263,
        .messages = {.number = {.at = 5, .bytes = 1}, .known = messages, .count = 3},
        .checksum = MAVLINK_CRC,
    },
    {
        .sync = {(const uint8_t *)"\xFD", 1, 1},
        .length = {.kind = FRAMELOCK_LENGTH_FIELD, .number = {.at = 1, .bytes = 1}, .plus = 12},
        .shortest = 12,
        .longest = 280,
        .fixed = mavlink_fixed,
        .fixed_count = 1,
        .messages = {.number = {.at = 7, .bytes = 3}, .known = messages, .count = 3},
        .checksum = MAVLINK_CRC,
        .appendix = {.at = 2, .mask = 1, .bytes = 13},
    },
};

/* Parts that no protocol above has. */
static const framelock_layout odd[] = {
    {
        .sync = {(const uint8_t *)"<1<2", 2, 2},
        .length = {.kind = FRAMELOCK_LENGTH_FIELD, .number = {.at = 2, .bytes = 1}, .mask = 7, .factor = 2,
                   .plus = 6},
        .shortest = 8,
        .longest = 18,
        .checksum = {.algorithm = FRAMELOCK_SUM, .bytes = 2, .at = -3, .to = -4},
        .terminator = {(const uint8_t *)">", 1, 1},
    },
    {
        .sync = {(const uint8_t *)"<<", 2, 1},
        .longest = 6,
        .checksum = {.algorithm = FRAMELOCK_NEGATED_SUM, .bytes = 1, .at = -1, .from = 2, .to = -2},
    },
};

#define LINE(layouts) {layouts, sizeof layouts / sizeof layouts[0]}
#define SHIPPED(name) {&framelock_##name##_layout, 1}
static framelock_layout shipped_gnss[3], shipped_mavlink[2];
static const struct {
    const framelock_layout *layouts;
    size_t count;
} lines[] = {
    SHIPPED(bin), SHIPPED(bin_crc8), SHIPPED(six_axes), SHIPPED(sbus), SHIPPED(ibus), SHIPPED(crsf),
    LINE(shipped_gnss), LINE(shipped_mavlink), LINE(own_sbus), LINE(own_ibus), LINE(own_crsf),
    LINE(own_gnss), LINE(own_mavlink), LINE(odd),
};

static void say_frame(void *when, const framelock_frame *frame)
{
    say(*(const char *)when);
    say_number(frame->layout);
    say(' ');
    say_bytes(frame->bytes, frame->length);
    say('\n');
}

static void say_counters(const framelock_counters *now)
{
    const size_t all[] = {
        now->bytes, now->frames, now->frame_bytes, now->discarded_no_sync, now->discarded_broken_sync,
        now->discarded_header, now->discarded_too_long, now->discarded_unknown_message,
        now->discarded_terminator, now->discarded_check, now->discarded_line_event, now->pending,
        now->resynchronisations, now->framing_errors, now->parity_errors, now->overruns, now->breaks,
        now->idle_lines,
    };
    for (size_t at = 0; at < sizeof all / sizeof all[0]; at++) {
        say_number(all[at]);
        say(at + 1 < sizeof all / sizeof all[0] ? ' ' : '\n');
    }
}

bool take(uint8_t *steps, size_t length)
{
    static framelock_layout_receiver receiver;
    static framelock_made_layout made[3];
    static uint8_t buffer[2100];
    static char pushed = 'b', polled = 'p', at_event = 'e';
    const framelock_layout *layouts = lines[steps[0]].layouts;
    framelock_frame frame;
    framelock_counters counters;

    shipped_gnss[0] = framelock_ubx_layout;
    shipped_gnss[0].longest = 100;
    shipped_gnss[1] = framelock_nmea_layout;
    shipped_gnss[2] = framelock_rtcm_layout;
    shipped_mavlink[0] = framelock_mavlink1_common_layout;
    shipped_mavlink[1] = framelock_mavlink2_ardupilotmega_layout;
    if (!framelock_layout_receiver_init(&receiver, layouts, made, lines[steps[0]].count, buffer,
                                        sizeof buffer)) {
        return false;
    }
    for (size_t at = 1; at < length; at++) {
        switch (steps[at]) {
        case 'b':
            if (framelock_layout_receiver_push(&receiver, steps[++at], &frame)) {
                say_frame(&pushed, &frame);
            }
            break;
        case 'p':
            while (framelock_layout_receiver_poll(&receiver, &frame)) {
                say_frame(&polled, &frame);
            }
            break;
        case 'e':
            framelock_layout_receiver_line_event(&receiver, steps[++at], say_frame, &at_event);
            break;
        case 'c':
            if (!framelock_layout_receiver_counters(&receiver, &counters)) {
                return false;
            }
            say_counters(&counters);
            break;
        default: {
            uint8_t *unsealed = &steps[at + 3];
            size_t count = steps[at + 2];
            say(framelock_seal(&layouts[steps[at + 1]], unsealed, count) ? 's' : '-');
            say_bytes(unsealed, count);
            say('\n');
            at += 2 + count;
        }
        }
    }
    return true;
}
