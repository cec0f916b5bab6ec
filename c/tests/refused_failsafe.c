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

#define PARK {128U, 100U}
#define TOO_LONG (UINT32_MAX / 2U + 1U)

static const failsafe_parameters right = {PARK, FAILSAFE_USUAL(1000U, 20U)};

/* The same parameters. In each row, one of them contradicts another one. */
static const failsafe_parameters wrong[] = {
    {PARK, 0U, 100U, 500U, 3U, 1000U, 1000U, 200U},
    {PARK, 40U, 39U, 500U, 3U, 1000U, 1000U, 200U},
    {PARK, 40U, 100U, 99U, 3U, 1000U, 1000U, 200U},
    {PARK, 40U, 100U, 500U, 1U, 1000U, 1000U, 200U},
    {PARK, 40U, 100U, 500U, 0U, 1000U, 1000U, 200U},
    {PARK, 40U, 100U, 500U, 3U, 0U, 1000U, 200U},
    {PARK, 40U, 100U, 500U, 3U, 1000U, 1000U, 159U},
    {PARK, 40U, 100U, 500U, 3U, 1000U, 199U, 200U},
    {PARK, 40U, 100U, 500U, 3U, 1000U, TOO_LONG, 200U},
};

int main(void)
{
    static const failsafe_demand demands[FAILSAFE_AXES] = {200U, 3U};
    failsafe_demand output[FAILSAFE_AXES];
    uint32_t now;
    unsigned i;

    if (!failsafe_init(&platform, &right, 0U)) {
        return 1;
    }
    /* The failsafe has a state that another initialisation would change. */
    for (now = 0U; now < 3000U; now += 20U) {
        failsafe_frame(&platform, demands);
        (void)failsafe_poll(&platform, now, output);
    }
    for (i = 0U; i < sizeof wrong / sizeof wrong[0]; i++) {
        if (!is_refused(&wrong[i])) {
            fprintf(stderr, "case %u: the parameters are accepted, or something changes\n", i);
            return 1;
        }
    }
    printf("%u refused\n", i);
    return 0;
}
