/* Calls with NULL, with zeros, and with parameters and layouts that break a rule have no effect, as the header says. */
#undef NDEBUG
#include <assert.h>

#include "framelock.h"

static framelock_receiver receiver;
static framelock_crc8_receiver crc8_receiver;
static framelock_failsafe failsafe;

static const char frame[] = "AB\0\1\2\3\r";

static bool is_delivered(framelock_receiver *to, framelock_setpoint *setpoint)
{
    bool delivered = false;
    for (size_t at = 0; at < 7; at++) {
        delivered = framelock_receiver_push(to, (uint8_t)frame[at], setpoint);
    }
    return delivered;
}

static framelock_layout_receiver layout_receiver;
static framelock_made_layout made[2];
static uint8_t buffer[14];
static size_t at_event;
static framelock_layout nothing;

static void found(void *context, const framelock_frame *whole)
{
    assert(context == &at_event && whole->bytes == &buffer[1] && whole->length == 7 && whole->layout == 1);
    at_event++;
}

/* Returns whether a receiver accepts the layout. */
static bool begins(const framelock_layout *layout)
{
    return framelock_layout_receiver_init(&layout_receiver, layout, made, 1, buffer, sizeof buffer);
}

static void layouts(void)
{
    framelock_layout layout = framelock_bin_layout, two[2];
    framelock_frame whole;
    framelock_counters counters;

    assert(!framelock_layout_receiver_push(&layout_receiver, 'A', &whole));
    assert(!framelock_layout_receiver_poll(&layout_receiver, &whole));
    framelock_layout_receiver_line_event(&layout_receiver, FRAMELOCK_BREAK, found, &at_event);
    assert(!framelock_layout_receiver_counters(&layout_receiver, &counters));
    assert(!framelock_layout_receiver_push(NULL, 'A', &whole));
    assert(!framelock_layout_receiver_poll(NULL, &whole));
    framelock_layout_receiver_line_event(NULL, FRAMELOCK_BREAK, found, &at_event);
    assert(!framelock_layout_receiver_counters(NULL, &counters));

    assert(begins(&layout));
    assert(!framelock_layout_receiver_init(NULL, &layout, made, 1, buffer, sizeof buffer));
    assert(!begins(NULL));
    assert(!framelock_layout_receiver_push(&layout_receiver, 'A', &whole));
    assert(!framelock_layout_receiver_init(&layout_receiver, NULL, NULL, 0, buffer, sizeof buffer));
    assert(!framelock_layout_receiver_init(&layout_receiver, &layout, NULL, 1, buffer, sizeof buffer));
    assert(!framelock_layout_receiver_init(&layout_receiver, &layout, made, 1, NULL, sizeof buffer));
    assert(!framelock_layout_receiver_init(&layout_receiver, &layout, made, 1, buffer, 6));
    assert(framelock_layout_receiver_init(&layout_receiver, &layout, made, 1, buffer, 7));
    assert(!begins(&nothing));

    /* Layouts with values that are not allowed. */
    layout = nothing;
    layout.longest = 7;
    assert(!begins(&layout));
    layout.terminator.bytes = (const uint8_t *)"\r";
    layout.terminator.length = layout.terminator.count = 1;
    assert(begins(&layout));
    layout.sync.length = layout.sync.count = 1;
    assert(!begins(&layout));
    layout.sync.length = layout.sync.count = SIZE_MAX;
    assert(!begins(&layout));
    layout.sync.count = 0;
    assert(begins(&layout));
    layout.length.kind = 3;
    assert(!begins(&layout));
    layout.length.kind = 0;
    layout.checksum.algorithm = 7;
    assert(!begins(&layout));
    layout.checksum.algorithm = 1;
    layout.checksum.written = 3;
    assert(!begins(&layout));
    assert(!framelock_seal(&layout, buffer, 7));
    layout.checksum.algorithm = 0;
    layout.fixed_count = 1;
    assert(!begins(&layout));
    layout.fixed_count = 0;
    layout.messages.count = 1;
    assert(!begins(&layout));
    layout.messages.count = 0;

    /* Layouts that contradict themselves. */
    assert(begins(&layout));
    layout.shortest = 40;
    assert(!begins(&layout));
    layout = framelock_bin_layout;
    layout.longest = 8;
    assert(!begins(&layout) && !framelock_seal(&layout, buffer, 8));

    assert(framelock_seal(&framelock_bin_layout, buffer, 7) && buffer[6] == '\r');
    assert(!framelock_seal(&framelock_bin_layout, buffer, 8));
    assert(!framelock_seal(NULL, buffer, 7) && !framelock_seal(&framelock_bin_layout, NULL, 7));

    /* A false start of one layout contains a frame of the other. A line event delivers the frame. */
    two[0] = nothing;
    two[0].sync.bytes = (const uint8_t *)"<";
    two[0].sync.length = two[0].sync.count = 1;
    two[0].longest = 9;
    two[0].terminator = two[0].sync;
    two[1] = framelock_bin_layout;
    assert(framelock_layout_receiver_init(&layout_receiver, two, made, 2, buffer, sizeof buffer));
    assert(!framelock_layout_receiver_push(&layout_receiver, '<', NULL));
    for (size_t at = 0; at < 7; at++) {
        assert(!framelock_layout_receiver_push(&layout_receiver, (uint8_t)frame[at], NULL));
    }
    assert(!framelock_layout_receiver_poll(&layout_receiver, NULL));
    framelock_layout_receiver_line_event(&layout_receiver, 200, NULL, NULL);
    assert(framelock_layout_receiver_counters(&layout_receiver, &counters) && counters.pending == 8);
    framelock_layout_receiver_line_event(&layout_receiver, FRAMELOCK_IDLE_LINE, found, &at_event);
    assert(at_event == 1);
    assert(framelock_layout_receiver_counters(&layout_receiver, &counters) && counters.pending == 0);
    assert(counters.frames == 1 && counters.discarded_line_event == 1 && counters.idle_lines == 1);
    assert(!framelock_layout_receiver_counters(&layout_receiver, NULL));
}

int main(void)
{
    const framelock_failsafe_parameters good = {1, 1, {7, 8, 9}, {1, 1, 1}};
    framelock_failsafe_parameters bad;
    framelock_setpoint setpoint = {4, 5, 6};
    framelock_counters counters;

    layouts();
    framelock_receiver_init(NULL);
    framelock_crc8_receiver_init(NULL);
    assert(!is_delivered(NULL, &setpoint));
    assert(!framelock_crc8_receiver_push(NULL, 'A', &setpoint));
    framelock_receiver_line_event(NULL, FRAMELOCK_BREAK);
    framelock_crc8_receiver_line_event(NULL, FRAMELOCK_BREAK);
    assert(!framelock_receiver_counters(NULL, &counters));
    assert(!framelock_crc8_receiver_counters(NULL, &counters));

    assert(!is_delivered(&receiver, &setpoint));
    framelock_receiver_line_event(&receiver, FRAMELOCK_BREAK);
    assert(!framelock_receiver_counters(&receiver, &counters));
    assert(!framelock_crc8_receiver_push(&crc8_receiver, 'A', &setpoint));
    framelock_crc8_receiver_line_event(&crc8_receiver, FRAMELOCK_BREAK);
    assert(!framelock_crc8_receiver_counters(&crc8_receiver, &counters));

    framelock_receiver_init(&receiver);
    assert(is_delivered(&receiver, NULL));
    framelock_receiver_line_event(&receiver, 200);
    assert(!framelock_receiver_counters(&receiver, NULL));
    assert(framelock_receiver_counters(&receiver, &counters));
    assert(counters.frames == 1 && counters.bytes == 7);
    assert(counters.framing_errors + counters.parity_errors + counters.overruns + counters.breaks
               + counters.idle_lines == 0);

    framelock_failsafe_frame(NULL, 0, setpoint);
    assert(framelock_failsafe_poll(NULL, 0, &setpoint) == FRAMELOCK_NO_OUTPUT);
    framelock_failsafe_frame(&failsafe, 0, setpoint);
    assert(framelock_failsafe_poll(&failsafe, 0, &setpoint) == FRAMELOCK_NO_OUTPUT);
    assert(!framelock_failsafe_init(NULL, &good, 0));
    assert(!framelock_failsafe_init(&failsafe, NULL, 0));
    bad = good;
    bad.hold_after = 0;
    assert(!framelock_failsafe_init(&failsafe, &bad, 0));
    bad = good;
    bad.hold_after = 2;
    assert(!framelock_failsafe_init(&failsafe, &bad, 0));
    for (int axis = 0; axis < 3; axis++) {
        bad = good;
        bad.ticks_per_unit[axis] = 0;
        assert(!framelock_failsafe_init(&failsafe, &bad, 0));
        assert(framelock_failsafe_poll(&failsafe, 0, &setpoint) == FRAMELOCK_NO_OUTPUT);
    }
    assert(setpoint.pitch == 4 && setpoint.roll == 5 && setpoint.yaw == 6);

    assert(framelock_failsafe_init(&failsafe, &good, 0));
    assert(framelock_failsafe_poll(&failsafe, 0, NULL) == FRAMELOCK_PARKED);
    assert(framelock_failsafe_poll(&failsafe, 0, &setpoint) == FRAMELOCK_PARKED);
    assert(setpoint.pitch == 7 && setpoint.roll == 8 && setpoint.yaw == 9);
    assert(!framelock_failsafe_init(&failsafe, &bad, 0));
    assert(framelock_failsafe_poll(&failsafe, 0, &setpoint) == FRAMELOCK_NO_OUTPUT);
    return 0;
}
