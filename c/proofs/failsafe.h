/* Proofs about the failsafe. A file that runs these proofs includes the failsafe's header and then this file. The
 * proofs cover all parameters that `init` accepts, and a call in any state that satisfies the invariant. They show that
 * the call accesses only memory that it may access, does not overflow, keeps the invariant, and moves no axis away from
 * its target. */
#define NAME failsafe
#define UPPER FAILSAFE
#include "proof.h"

#define TURNS 4

static failsafe platform;
static failsafe_demand demands[FAILSAFE_AXES];
static failsafe_demand output[FAILSAFE_AXES];

static bool invariant(void)
{
    const failsafe_parameters *const parameters = &platform.parameters;
    uint8_t i;

    for (i = 0U; i < FAILSAFE_AXES; i++) {
        if (platform.axes[i].since_unit >= parameters->ticks_per_unit[i]) {
            return false;
        }
    }
    return (parameters->hold_after > 0U) && (parameters->ramp_after >= parameters->hold_after);
}

static void start(void)
{
    failsafe any;
    failsafe_demand any_demands[FAILSAFE_AXES];
    uint8_t i;

    platform = any;
    for (i = 0U; i < FAILSAFE_AXES; i++) {
        demands[i] = any_demands[i];
    }
    ASSUME(invariant());
}

/* Returns whether a position lies between two other positions, or equals one of these two. */
static bool is_between(failsafe_demand position, failsafe_demand one, failsafe_demand other)
{
    return (one <= position && position <= other) || (other <= position && position <= one);
}

PROOF(init, TURNS)
{
    failsafe_parameters parameters;
    const uint32_t now = nondet_uint32();
    uint8_t i;

    const bool is_accepted = failsafe_init(&platform, &parameters, now);
    if (is_accepted) {
        ASSERT(invariant() && failsafe_poll(&platform, now, output) == FAILSAFE_PARKED);
        for (i = 0U; i < FAILSAFE_AXES; i++) {
            ASSERT(output[i] == parameters.park[i]);
        }
    } else {
        ASSERT(parameters.hold_after == 0U || parameters.ramp_after < parameters.hold_after ||
               parameters.ticks_per_unit[0] == 0U || parameters.ticks_per_unit[FAILSAFE_AXES - 1] == 0U);
    }
    COVER(is_accepted);
    COVER(!is_accepted);
}

PROOF(frame, TURNS)
{
    uint8_t i;

    start();
    failsafe_frame(&platform, nondet_uint32(), demands);
    ASSERT(invariant() && platform.silence == 0U);
    for (i = 0U; i < FAILSAFE_AXES; i++) {
        ASSERT(platform.demands[i] == demands[i]);
    }
    COVER(platform.axes[0].position != demands[0]);
}

PROOF(poll, TURNS)
{
    start();
    const failsafe before = platform;
    const uint32_t now = nondet_uint32();
    const failsafe_phase phase = failsafe_poll(&platform, now, output);
    const uint8_t i = nondet_uint8();

    ASSERT(invariant() && platform.now == now);
    ASSUME(i < FAILSAFE_AXES);
    const failsafe_demand from = before.axes[i].position;
    const failsafe_demand demand = before.demands[i];
    const failsafe_demand park = before.parameters.park[i];
    ASSERT(is_between(output[i], from, demand) || is_between(output[i], from, park) || is_between(output[i], demand, park));
    ASSERT(phase != FAILSAFE_LIVE || output[i] == demand);
    ASSERT(phase != FAILSAFE_PARKED || output[i] == park);
    ASSERT(phase != FAILSAFE_APPROACH || is_between(output[i], from, demand));
    ASSERT((phase != FAILSAFE_HOLD && phase != FAILSAFE_RAMP && phase != FAILSAFE_PARKED) || platform.silence >= before.parameters.hold_after);
    COVER(phase == FAILSAFE_RAMP && output[i] != from && output[i] != park);
    COVER(phase == FAILSAFE_APPROACH && output[i] != from);
}

/* Functions for the harnesses in Rust. */

void c_start(void)
{
    start();
}

/* Returns one part of the state. `which` selects the part: 0 to 3 are times, and from 4 on each axis has five parts. */
uint32_t c_state(uint8_t which)
{
    const uint8_t axis = (uint8_t)((which - 4U) / 5U);

    switch (which) {
    case 0: return platform.now;
    case 1: return platform.silence;
    case 2: return platform.parameters.hold_after;
    case 3: return platform.parameters.ramp_after;
    default: break;
    }
    switch ((which - 4U) % 5U) {
    case 0: return platform.parameters.park[axis];
    case 1: return platform.parameters.ticks_per_unit[axis];
    case 2: return platform.demands[axis];
    case 3: return platform.axes[axis].position;
    default: return platform.axes[axis].since_unit;
    }
}

uint8_t c_poll(uint32_t now)
{
    return failsafe_poll(&platform, now, output);
}

uint32_t c_output(uint8_t axis)
{
    return output[axis];
}

void c_demand(uint8_t axis, uint16_t demand)
{
    demands[axis] = (failsafe_demand)demand;
}

void c_frame(uint32_t now)
{
    failsafe_frame(&platform, now, demands);
}
