/* Proofs about the failsafe. A file that runs these proofs includes the failsafe's header and then this file. The
 * proofs cover all parameters that `init` accepts, and a call in any state that satisfies the invariant, at any time.
 * The harness of `init` is an exception: its travel times are below 256, or so long that `init` rejects them. The
 * proofs show that the call accesses only memory that it may access, has no signed overflow, and keeps the invariant.
 * They also show that, from one call of `poll` to the next, the output of an axis changes by at most
 * `failsafe_most_per_poll`. */
#define NAME failsafe
#define UPPER FAILSAFE
#include "proof.h"

#define TURNS 4

static failsafe platform;
static failsafe_demand demands[FAILSAFE_AXES];
static failsafe_demand output[FAILSAFE_AXES];

static bool follows(void)
{
    return platform.in_row >= platform.parameters.frames_to_start;
}

/* An axis is live only while frames come, and only when the approach has lasted long enough. */
static bool invariant(void)
{
    const failsafe_parameters *const parameters = &platform.parameters;
    const bool may_be_live = follows() && platform.approached >= parameters->approach_for;
    uint8_t i;

    for (i = 0U; i < FAILSAFE_AXES; i++) {
        if (platform.axes[i].position > FAILSAFE_MOST || (platform.axes[i].is_live && !may_be_live)) {
            return false;
        }
    }
    if (!follows() && platform.approached > 0U) {
        return false;
    }
    return FAILSAFE_AGREE(parameters->longest_step, parameters->hold_after, parameters->ramp_after,
                          parameters->frames_to_start, parameters->approach_for, parameters->approach_travel,
                          parameters->live_travel);
}

static void start(void)
{
    failsafe any;
    failsafe_demand any_demands[FAILSAFE_AXES];
    uint8_t i;

    platform = any;
    platform.has_frame = nondet_bool();
    platform.had_frame = nondet_bool();
    for (i = 0U; i < FAILSAFE_AXES; i++) {
        platform.axes[i].is_live = nondet_bool();
        platform.axes[i].rises = nondet_bool();
        demands[i] = any_demands[i];
    }
    ASSUME(invariant() && platform.slow.per_poll <= platform.fast.per_poll);
    ASSUME(platform.fast.per_poll <= FAILSAFE_MOST / 4U);
}

/* Returns whether every member of the failsafe is unchanged. */
static bool is_same(const failsafe *before)
{
    const uint8_t i = nondet_uint8();

    ASSUME(i < FAILSAFE_AXES);
    return platform.parameters.longest_step == before->parameters.longest_step &&
           platform.parameters.hold_after == before->parameters.hold_after &&
           platform.parameters.ramp_after == before->parameters.ramp_after &&
           platform.parameters.frames_to_start == before->parameters.frames_to_start &&
           platform.parameters.approach_for == before->parameters.approach_for &&
           platform.parameters.approach_travel == before->parameters.approach_travel &&
           platform.parameters.live_travel == before->parameters.live_travel &&
           platform.parameters.park[i] == before->parameters.park[i] &&
           platform.slow.per_tick == before->slow.per_tick && platform.slow.per_poll == before->slow.per_poll &&
           platform.fast.per_tick == before->fast.per_tick && platform.fast.per_poll == before->fast.per_poll &&
           platform.now == before->now && platform.quiet == before->quiet && platform.silence == before->silence &&
           platform.approached == before->approached && platform.in_row == before->in_row &&
           platform.has_frame == before->has_frame && platform.had_frame == before->had_frame &&
           platform.demands[i] == before->demands[i] && platform.axes[i].position == before->axes[i].position &&
           platform.axes[i].is_live == before->axes[i].is_live && platform.axes[i].rises == before->axes[i].rises &&
           platform.clock_faults == before->clock_faults && platform.late_polls == before->late_polls &&
           platform.slow_frames == before->slow_frames;
}

static failsafe_demand difference(failsafe_demand one, failsafe_demand other)
{
    return (failsafe_demand)((one > other) ? (one - other) : (other - one));
}

PROOF(init, TURNS)
{
    failsafe_parameters parameters;
    const uint32_t now = nondet_uint32();
    uint8_t i;

    start();
    const failsafe before = platform;

    /* The solver cannot divide by an arbitrary number in reasonable time, so the times are short, or so long that they
     * are rejected. */
    parameters.approach_travel = nondet_bool() ? nondet_uint8() : (UINT32_MAX - nondet_uint8());
    parameters.live_travel = nondet_bool() ? nondet_uint8() : (UINT32_MAX - nondet_uint8());
    const bool is_accepted = failsafe_init(&platform, &parameters, now);
    ASSERT(is_accepted == (parameters.longest_step > 0U && parameters.hold_after >= parameters.longest_step &&
                           parameters.ramp_after >= parameters.hold_after && parameters.frames_to_start >= 2U &&
                           parameters.approach_for > 0U &&
                           parameters.live_travel >= (uint64_t)parameters.longest_step * 4U &&
                           parameters.approach_travel >= parameters.live_travel &&
                           parameters.approach_travel <= UINT32_MAX / 2U));
    if (is_accepted) {
        ASSERT(invariant() && failsafe_pass(&platform, now) == 0U);
        ASSERT(failsafe_move(&platform, nondet_uint32(), nondet_uint32(), output) == FAILSAFE_PARKED);
        for (i = 0U; i < FAILSAFE_AXES; i++) {
            ASSERT(output[i] == parameters.park[i]);
        }
    } else {
        ASSERT(is_same(&before));
    }
    COVER(is_accepted);
    COVER(!is_accepted);
}

PROOF(frame, TURNS)
{
    uint8_t i;

    start();
    failsafe_frame(&platform, demands);
    ASSERT(invariant() && platform.has_frame);
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
    const failsafe_demand from = (failsafe_demand)(before.axes[i].position / FAILSAFE_UNIT);
    const failsafe_demand moved = difference(from, output[i]);
    ASSERT(platform.axes[i].is_live || moved <= (before.slow.per_poll + (uint64_t)FAILSAFE_UNIT - 1U) / FAILSAFE_UNIT);
    ASSERT(moved <= failsafe_most_per_poll(&before));
    const uint64_t passed = ((uint64_t)1U << 32U) + now - before.now;
    ASSERT(moved == 0U || (now != before.now && (uint32_t)passed <= UINT32_MAX / 2U));
    ASSERT(moved == 0U || follows() || platform.silence >= before.parameters.ramp_after);
    ASSERT(follows() == (phase == FAILSAFE_LIVE || phase == FAILSAFE_APPROACH));
    ASSERT(phase != FAILSAFE_LIVE || platform.axes[i].is_live);
    ASSERT(phase != FAILSAFE_PARKED || output[i] == before.parameters.park[i]);
    COVER(phase == FAILSAFE_RAMP && output[i] != from && output[i] != before.parameters.park[i]);
    COVER(phase == FAILSAFE_APPROACH && output[i] != from);
    COVER(phase == FAILSAFE_LIVE && output[i] != from);
}

/* Functions for the harnesses in Rust. */

void c_start(void)
{
    start();
}

/* Returns one part of the state. `which` selects the part: the parts 0 to 20 belong to no axis, and after them each
 * axis has five parts. */
uint32_t c_state(uint8_t which)
{
    const uint8_t axis = (uint8_t)((which - 21U) / 5U);

    switch (which) {
    case 0: return platform.now;
    case 1: return platform.quiet;
    case 2: return platform.silence;
    case 3: return platform.in_row;
    case 4: return platform.approached;
    case 5: return platform.has_frame;
    case 6: return platform.had_frame;
    case 7: return platform.clock_faults;
    case 8: return platform.late_polls;
    case 9: return platform.slow_frames;
    case 10: return platform.slow.per_tick;
    case 11: return platform.slow.per_poll;
    case 12: return platform.fast.per_tick;
    case 13: return platform.fast.per_poll;
    case 14: return platform.parameters.longest_step;
    case 15: return platform.parameters.hold_after;
    case 16: return platform.parameters.ramp_after;
    case 17: return platform.parameters.frames_to_start;
    case 18: return platform.parameters.approach_for;
    case 19: return platform.parameters.approach_travel;
    case 20: return platform.parameters.live_travel;
    default: break;
    }
    switch ((which - 21U) % 5U) {
    case 0: return platform.parameters.park[axis];
    case 1: return platform.demands[axis];
    case 2: return platform.axes[axis].position;
    case 3: return platform.axes[axis].is_live;
    default: return platform.axes[axis].rises;
    }
}

uint32_t c_pass(uint32_t now)
{
    return failsafe_pass(&platform, now);
}

uint8_t c_move(uint32_t slow, uint32_t fast)
{
    return failsafe_move(&platform, slow, fast, output);
}

uint32_t c_way(uint32_t per_tick, uint32_t per_poll, uint32_t elapsed)
{
    const failsafe_speed speed = {per_tick, per_poll};

    return failsafe_way(speed, elapsed);
}

uint32_t c_output(uint8_t axis)
{
    return output[axis];
}
