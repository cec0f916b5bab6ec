/* Checks that failsafe_init and failsafe_resume do nothing if the parameters contradict each other. */
#define FAILSAFE_AXES 2
#include "failsafe.h"

#include <stdio.h>
#include <string.h>

static failsafe platform;
static failsafe before;

/* Tries both functions with these parameters. Returns whether they are refused and nothing changes. */
static bool is_refused(const failsafe_parameters *parameters)
{
    static const failsafe_demand output[FAILSAFE_AXES] = {7U, 249U};
    bool refused;

    memcpy(&before, &platform, sizeof platform);
    refused = !failsafe_init(&platform, parameters, 12345U);
    refused = refused && (memcmp(&before, &platform, sizeof platform) == 0);
    refused = refused && !failsafe_resume(&platform, parameters, 54321U, output);
    return refused && (memcmp(&before, &platform, sizeof platform) == 0);
}

int main(void)
{
    static const failsafe_parameters right = {{128U, 100U}, FAILSAFE_USUAL(1000U, 20U)};
    static const failsafe_demand demands[FAILSAFE_AXES] = {200U, 3U};
    failsafe_demand output[FAILSAFE_AXES];
    uint32_t now;
    uint8_t wrong;

    if (!failsafe_init(&platform, &right, 0U)) {
        return 1;
    }
    /* The failsafe has a state that another initialisation would change. */
    for (now = 0U; now < 3000U; now += 20U) {
        failsafe_frame(&platform, demands);
        (void)failsafe_poll(&platform, now, output);
    }
    for (wrong = 0U; wrong < 9U; wrong++) {
        failsafe_parameters parameters = right;

        switch (wrong) {
        case 0U:
            parameters.longest_step = 0U;
            break;
        case 1U:
            parameters.hold_after = parameters.longest_step - 1U;
            break;
        case 2U:
            parameters.ramp_after = parameters.hold_after - 1U;
            break;
        case 3U:
            parameters.frames_to_start = 1U;
            break;
        case 4U:
            parameters.approach_for = 0U;
            break;
        case 5U:
            parameters.live_travel = 4U * parameters.longest_step - 1U;
            break;
        case 6U:
            parameters.approach_travel = parameters.live_travel - 1U;
            break;
        case 7U:
            parameters.approach_travel = UINT32_MAX / 2U + 1U;
            break;
        default:
            parameters.frames_to_start = 0U;
            break;
        }
        if (!is_refused(&parameters)) {
            fprintf(stderr, "case %u: the parameters are accepted, or something changes\n", (unsigned)wrong);
            return 1;
        }
    }
    printf("9 refused\n");
    return 0;
}
