/* Runs steps against the failsafe in C. Standard input has the parameters, the start time, and the steps. Numbers are
 * little-endian. A demand has two bytes, and a time has four. The steps:
 *
 *   0 demands        a frame
 *   1 time           a poll; prints the phase, the output and the counters
 *   2 time output    resume at this output
 *   3 parameters     try contradictory parameters: `init` and `resume` must refuse them and change nothing */
#include "failsafe.h"

#include <stdio.h>
#include <string.h>

static failsafe platform;
static bool is_at_end;

static uint32_t next_number(uint8_t bytes)
{
    uint32_t number = 0U;
    uint8_t i;

    for (i = 0U; i < bytes; i++) {
        const int byte = getchar();

        is_at_end = byte == EOF;
        number |= (uint32_t)(is_at_end ? 0 : byte) << (8U * i);
    }
    return number;
}

static void next_demands(failsafe_demand *demands)
{
    uint8_t i;

    for (i = 0U; i < FAILSAFE_AXES; i++) {
        demands[i] = (failsafe_demand)next_number(2U);
    }
}

static void next_parameters(failsafe_parameters *parameters)
{
    next_demands(parameters->park);
    parameters->longest_step = next_number(4U);
    parameters->hold_after = next_number(4U);
    parameters->ramp_after = next_number(4U);
    parameters->frames_to_start = (uint8_t)next_number(1U);
    parameters->approach_for = next_number(4U);
    parameters->approach_travel = next_number(4U);
    parameters->live_travel = next_number(4U);
}

/* Returns whether `init` and `resume` refuse the parameters and change nothing. */
static bool is_refused(const failsafe_parameters *parameters)
{
    static const failsafe_demand output[FAILSAFE_AXES] = {7U};
    static failsafe before;
    bool is_accepted;

    memcpy(&before, &platform, sizeof platform);
    is_accepted = failsafe_init(&platform, parameters, 12345U);
    is_accepted = failsafe_resume(&platform, parameters, 54321U, output) || is_accepted;
    return !is_accepted && (memcmp(&before, &platform, sizeof platform) == 0);
}

int main(void)
{
    failsafe_parameters parameters;
    failsafe_parameters wrong;
    failsafe_demand demands[FAILSAFE_AXES];
    uint8_t i;

    next_parameters(&parameters);
    memset(&platform, 0x5A, sizeof(failsafe));
    if (!failsafe_init(&platform, &parameters, next_number(4U))) {
        printf("contradiction\n");
        return 0;
    }
    printf("%u\n", (unsigned)failsafe_most_per_poll(&platform));
    for (;;) {
        const uint32_t what = next_number(1U);

        if (is_at_end) {
            return 0;
        }
        if (what == 0U) {
            next_demands(demands);
            failsafe_frame(&platform, demands);
        } else if (what == 1U) {
            const failsafe_phase phase = failsafe_poll(&platform, next_number(4U), demands);

            printf("%d", (int)phase);
            for (i = 0U; i < FAILSAFE_AXES; i++) {
                printf(" %u", (unsigned)demands[i]);
            }
            printf(", %u %u %u\n", (unsigned)platform.clock_faults, (unsigned)platform.late_polls,
                   (unsigned)platform.slow_frames);
        } else if (what == 3U) {
            next_parameters(&wrong);
            printf("%s\n", is_refused(&wrong) ? "refused" : "accepted, or changed");
        } else {
            const uint32_t now = next_number(4U);

            next_demands(demands);
            if (!failsafe_resume(&platform, &parameters, now, demands)) {
                printf("contradiction\n");
            }
        }
    }
}
