/* NULL, zeros and parameters that break a rule do what the header says: nothing. */
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

int main(void)
{
    const framelock_failsafe_parameters good = {1, 1, {7, 8, 9}, {1, 1, 1}};
    framelock_failsafe_parameters bad;
    framelock_setpoint setpoint = {4, 5, 6};
    framelock_counters counters;

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
