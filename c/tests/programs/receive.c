/* Reads steps of two bytes from standard input, and prints the result of each.
 * 'b': a byte is received. 'e': a line event. 't': time passes; the second byte is the number of ticks.
 * RECEIVER is framelock_receiver or framelock_crc8_receiver. */
#include <inttypes.h>
#include <stdio.h>

#include "framelock.h"

#define JOINED(a, b) a##b
#define JOIN(a, b) JOINED(a, b)
#define OF_RECEIVER(function) JOIN(RECEIVER, function)

int main(void)
{
    RECEIVER receiver;
    framelock_failsafe failsafe;
    framelock_failsafe_parameters parameters = {20, 60, {128, 0, 255}, {1, 2, 3}};
    framelock_setpoint setpoint = {0, 0, 0};
    framelock_counters counters;
    uint32_t now = 0xFFFFFF00u; /* it soon wraps */
    int what, value;

    OF_RECEIVER(_init)(&receiver);
    if (!framelock_failsafe_init(&failsafe, &parameters, now)) {
        return 1;
    }
    while ((what = getchar()) != EOF && (value = getchar()) != EOF) {
        switch (what) {
        case 'b':
            if (OF_RECEIVER(_push)(&receiver, (uint8_t)value, &setpoint)) {
                printf("%d %d %d\n", setpoint.pitch, setpoint.roll, setpoint.yaw);
                framelock_failsafe_frame(&failsafe, now, setpoint);
            }
            break;
        case 'e':
            OF_RECEIVER(_line_event)(&receiver, (framelock_line_event)value);
            break;
        default: {
            framelock_setpoint output;
            framelock_phase phase;
            now += (uint32_t)value;
            phase = framelock_failsafe_poll(&failsafe, now, &output);
            printf("phase %d: %d %d %d\n", phase, output.pitch, output.roll, output.yaw);
        }
        }
    }
    if (!OF_RECEIVER(_counters)(&receiver, &counters)) {
        return 1;
    }
    printf("%" PRIu32 " bytes, %" PRIu32 " frames, %" PRIu32 " in them, %" PRIu32
           " resynchronisations, %zu pending\n",
           counters.bytes, counters.frames, counters.frame_bytes, counters.resynchronisations,
           counters.pending);
    printf("discarded %" PRIu32 " %" PRIu32 " %" PRIu32 " %" PRIu32 " %" PRIu32 "\n", counters.discarded_no_sync,
           counters.discarded_broken_sync, counters.discarded_terminator, counters.discarded_check,
           counters.discarded_line_event);
    printf("events %" PRIu32 " %" PRIu32 " %" PRIu32 " %" PRIu32 " %" PRIu32 "\n", counters.framing_errors, counters.parity_errors,
           counters.overruns, counters.breaks, counters.idle_lines);
    return 0;
}
