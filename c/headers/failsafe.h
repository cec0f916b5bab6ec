/* A failsafe between a receiver and actuators. It bounds the speed of the actuators, and moves them slowly when frames
 * stop and when they come again.
 * This is version 0.1.0 of framelock.
 * SPDX-License-Identifier: 0BSD
 * You may use, change and ship this file without conditions.
 *
 * This header needs only a C99 or C++17 compiler. It allocates no memory and does not recurse.
 *
 *     silence >= hold_after       silence >= ramp_after       every axis at park
 *    +-------------------> HOLD -------------------> RAMP --------------------> PARKED   (at reset)
 *    |                      |                         |                           |
 *    |                      +------------+------------+---------------------------+
 *    |                                   | frames_to_start frames in a row
 *    |                                   v
 *    +-------------------------------- APPROACH   slow, for at least approach_for,
 *    |                                   |        and then until each axis has met its demand
 *    |                                   v
 *    +--------------------------------  LIVE      fast
 *
 *   #define FAILSAFE_AXES 3
 *   #include "failsafe.h"
 *
 *   static failsafe platform;
 *   static const failsafe_parameters parameters = {{128, 128, 128}, FAILSAFE_USUAL(1000, 20)};
 *   uint8_t output[FAILSAFE_AXES];
 *
 *   failsafe_init(&platform, &parameters, now);         returns false if the parameters contradict each other
 *   failsafe_frame(&platform, demands);                 for each frame
 *   phase = failsafe_poll(&platform, now, output);      at regular times; then set the actuators
 *
 * Two consecutive outputs of an axis differ by at most failsafe_most_per_poll units (at most a quarter of the travel,
 * rounded up), and by no more than the axis's speed allows for the time that has passed. This holds in every phase,
 * whatever bytes come, whatever the clock does, and whenever you poll. If time stands still, nothing moves. After a
 * silence of hold_after, a single frame moves nothing, and frames_to_start frames in a row start a slow approach. Only
 * failsafe_poll moves the output, so poll in one place. The failsafe is no safety function: it cannot bound the output
 * if the program crashes.
 *
 * failsafe_frame and failsafe_poll write the same memory, so neither may interrupt the other. If an interrupt receives
 * frames and a task of another priority polls, pass the demands through a shared variable with a flag, and call both
 * functions from the task, or call each of them with interrupts disabled.
 *
 * The time `now` is a counter that may wrap. Poll again before half of its range has passed.
 *
 * By default, all functions are `static inline`. If several source files need them, define FAILSAFE_DEFINITIONS as 1 in
 * one of these files, and as 0 in the others, before they include this header. Then the program contains only one copy
 * of the code. */
#ifndef FAILSAFE_H
#define FAILSAFE_H

#include <stdbool.h>
#include <stdint.h>

/* The number of axes. */
#ifndef FAILSAFE_AXES
#define FAILSAFE_AXES 3
#endif
#if (FAILSAFE_AXES < 1) || (FAILSAFE_AXES > 255)
#error "FAILSAFE_AXES must be between 1 and 255"
#endif

/* The type of a demand on an axis: uint8_t or uint16_t. */
#ifndef FAILSAFE_DEMAND
#define FAILSAFE_DEMAND uint8_t
#endif

#ifndef FAILSAFE_DEFINITIONS
#define FAILSAFE_FUNCTION static inline
#elif defined(__cplusplus)
#define FAILSAFE_FUNCTION extern "C"
#else
#define FAILSAFE_FUNCTION
#endif

typedef FAILSAFE_DEMAND failsafe_demand;

/* The behaviour of a failsafe. Times are in ticks of your clock. */
typedef struct {
    failsafe_demand park[FAILSAFE_AXES]; /* the position of each axis while no frames come */
    uint32_t longest_step; /* the longest time for which one poll moves an axis: at least 1, usually two poll periods */
    uint32_t hold_after; /* silence after which the output is held: at least longest_step */
    uint32_t ramp_after; /* silence after which the output moves to park: at least hold_after */
    uint8_t frames_to_start; /* frames in a row that end a silence: at least 2; between two polls they count as one */
    uint32_t approach_for; /* the shortest time of an approach: at least 1 */
    uint32_t approach_travel; /* time for the whole travel, in an approach and to park: live_travel to UINT32_MAX / 2 */
    uint32_t live_travel; /* the time for the whole travel of a live axis: at least four times longest_step */
} failsafe_parameters;

/* The usual parameters after `park`, for a clock with this many ticks in a second and polls this many ticks apart. The
 * failsafe holds after 0.1 s of silence, and ramps after 0.5 s. Three frames start an approach, which takes at least a
 * second. The whole travel takes 1 s in an approach, and 0.2 s when live. If polls are more than 25 ms apart, choose a
 * longer live_travel. */
#define FAILSAFE_USUAL(ticks_per_second, poll_every)                                                                   \
    2U * (poll_every), (ticks_per_second) / 10U, (ticks_per_second) / 2U, 3U, (ticks_per_second), (ticks_per_second),  \
        (ticks_per_second) / 5U

/* Whether the parameters after `park` agree with each other. For constants, the compiler can check it:
 *
 *   #if !FAILSAFE_AGREE(FAILSAFE_USUAL(1000, 20))
 *   #error "the failsafe's parameters contradict each other"
 *   #endif */
#define FAILSAFE_AGREE(...) FAILSAFE_AGREE_(__VA_ARGS__)
#define FAILSAFE_AGREE_(step, hold, ramp, frames, least, slow, fast)                                                   \
    ((step) > 0U && (step) <= (hold) && (hold) <= (ramp) && (frames) > 1U && (least) > 0U && (step) <= (fast) / 4U &&  \
     (fast) <= (slow) && (slow) <= UINT32_MAX / 2U)

/* The state of the output. */
typedef enum {
    FAILSAFE_LIVE, /* the output follows the last frame's demands, at most as fast as live_travel says */
    FAILSAFE_APPROACH, /* frames come again: at least one axis still moves to its demand slowly */
    FAILSAFE_HOLD, /* silence: the output does not move */
    FAILSAFE_RAMP, /* longer silence: the output moves to park slowly */
    FAILSAFE_PARKED /* every axis is at park */
} failsafe_phase;

/* The speed of an axis: the most that the axis moves in a tick, and in a poll. */
typedef struct {
    uint32_t per_tick;
    uint32_t per_poll;
} failsafe_speed;

/* One axis. */
typedef struct {
    uint32_t position; /* the highest bits are the output */
    bool is_live;
    bool rises; /* whether the last target was above the axis */
} failsafe_axis;

/* A failsafe. Its members are private, except for the three counters. */
typedef struct {
    failsafe_parameters parameters;
    failsafe_speed slow; /* the speed in an approach, and on the way to park */
    failsafe_speed fast; /* the speed of a live axis */
    uint32_t now; /* the time of the last poll */
    uint32_t quiet; /* ticks since the last frame; saturates */
    uint32_t silence; /* ticks since the last frame that moved the output; saturates */
    uint32_t approached; /* ticks since the approach began, a late poll counting as longest_step; saturates */
    uint8_t in_row; /* frames since the last silence; saturates */
    bool has_frame; /* whether a frame has come since the last poll */
    bool had_frame; /* whether a poll has taken a frame */
    failsafe_demand demands[FAILSAFE_AXES];
    failsafe_axis axes[FAILSAFE_AXES];
    uint32_t clock_faults; /* how often the time seemed to go backwards; such a poll counts as no time */
    uint32_t late_polls; /* polls more than longest_step after the poll before; they make the axes slower */
    uint32_t slow_frames; /* frames hold_after or more after the frame before: if this grows, the sender is too slow */
} failsafe;

/* Initialises a failsafe with every axis at park. Returns false, and does nothing, unless FAILSAFE_AGREE accepts the
 * parameters. */
FAILSAFE_FUNCTION bool failsafe_init(failsafe *self, const failsafe_parameters *parameters, uint32_t now);

/* Initialises a failsafe whose actuators are at `output`, for example after a reset. From there they move to park.
 * Returns false, and does nothing, unless FAILSAFE_AGREE accepts the parameters. */
FAILSAFE_FUNCTION bool failsafe_resume(failsafe *self, const failsafe_parameters *parameters, uint32_t now,
                                       const failsafe_demand *output);

/* Returns the largest number of units by which two consecutive outputs of an axis differ, whatever happens. */
FAILSAFE_FUNCTION failsafe_demand failsafe_most_per_poll(const failsafe *self);

/* Takes the demands of a frame. The frame counts as received at the next poll. */
FAILSAFE_FUNCTION void failsafe_frame(failsafe *self, const failsafe_demand *demands);

/* Writes the position of each axis at the time `now` to `output`, and returns the phase. */
FAILSAFE_FUNCTION failsafe_phase failsafe_poll(failsafe *self, uint32_t now, failsafe_demand *output);

#if !defined(FAILSAFE_DEFINITIONS) || FAILSAFE_DEFINITIONS

/* One unit of demand, and the position of the largest demand. */
#define FAILSAFE_UNIT ((uint32_t)1U << (32U - (8U * sizeof(failsafe_demand))))
#define FAILSAFE_MOST (UINT32_MAX - (FAILSAFE_UNIT - 1U))

/* Returns a sum, or the largest number if the sum is larger. */
static inline uint32_t failsafe_add(uint32_t one, uint32_t other)
{
    return (other > (UINT32_MAX - one)) ? UINT32_MAX : (one + other);
}

/* Returns the speed of an axis that takes this time for its whole travel. */
static inline failsafe_speed failsafe_speed_of(uint32_t travel, uint32_t longest_step)
{
    const uint32_t per_tick = FAILSAFE_MOST / travel;
    const failsafe_speed speed = {per_tick, per_tick * longest_step}; /* fits: longest_step is less than travel */

    return speed;
}

/* Returns the most that an axis moves in a poll that comes `elapsed` ticks after the poll before. */
static inline uint32_t failsafe_way(failsafe_speed speed, uint32_t elapsed)
{
    const uint64_t way = (uint64_t)speed.per_tick * elapsed;

    return (way < speed.per_poll) ? (uint32_t)way : speed.per_poll;
}

/* Adds the time since the last poll to the timers, and takes the frame that has come since then. Returns the
 * elapsed time, which is 0 at a clock fault. */
static inline uint32_t failsafe_pass(failsafe *self, uint32_t now)
{
    const failsafe_parameters *const parameters = &self->parameters;
    uint32_t elapsed = now - self->now;
    uint8_t i;

    self->now = now;
    if (elapsed > (UINT32_MAX / 2U)) {
        elapsed = 0U;
        self->clock_faults++;
    }
    if (elapsed > parameters->longest_step) {
        self->late_polls++;
    }
    self->quiet = failsafe_add(self->quiet, elapsed);
    self->silence = failsafe_add(self->silence, elapsed);
    if (self->quiet >= parameters->hold_after) {
        self->in_row = 0U;
        self->approached = 0U;
        for (i = 0U; i < FAILSAFE_AXES; i++) {
            self->axes[i].is_live = false;
        }
    }
    if (self->in_row >= parameters->frames_to_start) {
        self->approached = failsafe_add(
            self->approached, (elapsed < parameters->longest_step) ? elapsed : parameters->longest_step);
    }
    if (self->has_frame) {
        if (self->had_frame && (self->quiet >= parameters->hold_after)) {
            self->slow_frames++;
        }
        self->had_frame = true;
        self->has_frame = false;
        self->quiet = 0U;
        if (self->in_row < UINT8_MAX) {
            self->in_row++;
        }
    }
    if (self->in_row >= parameters->frames_to_start) {
        self->silence = self->quiet;
    }
    return elapsed;
}

/* Moves an axis towards the target by at most `slow`, or by at most `fast` if the axis is live. If `may_go_live`, the
 * axis goes live when it meets its target, or when the target has passed it. */
static inline void failsafe_step(failsafe_axis *axis, uint32_t target, uint32_t slow, uint32_t fast, bool may_go_live)
{
    const bool rises = target > axis->position;
    uint32_t way = rises ? (target - axis->position) : (axis->position - target);

    if (may_go_live && ((way <= slow) || (rises != axis->rises))) {
        axis->is_live = true;
    }
    axis->rises = rises;
    if (way > (axis->is_live ? fast : slow)) {
        way = axis->is_live ? fast : slow;
    }
    axis->position = rises ? (axis->position + way) : (axis->position - way);
}

/* Moves each axis by at most `slow`, or by at most `fast` if the axis is live. Writes the output, and returns the
 * phase. */
static inline failsafe_phase failsafe_move(failsafe *self, uint32_t slow, uint32_t fast, failsafe_demand *output)
{
    const bool follows = self->in_row >= self->parameters.frames_to_start;
    const bool holds = self->silence < self->parameters.ramp_after;
    const bool may_go_live = self->approached >= self->parameters.approach_for;
    bool are_live = true;
    bool are_parked = true;
    uint8_t i;

    for (i = 0U; i < FAILSAFE_AXES; i++) {
        failsafe_axis *const axis = &self->axes[i];
        const uint32_t park = self->parameters.park[i] * FAILSAFE_UNIT;
        uint32_t target = park;

        if (follows) {
            target = self->demands[i] * FAILSAFE_UNIT;
        } else if (holds) {
            target = axis->position;
        }
        failsafe_step(axis, target, slow, fast, may_go_live);
        are_live = are_live && axis->is_live;
        are_parked = are_parked && (axis->position == park);
        output[i] = (failsafe_demand)(axis->position / FAILSAFE_UNIT);
    }
    if (follows) {
        return are_live ? FAILSAFE_LIVE : FAILSAFE_APPROACH;
    }
    if (holds) {
        return FAILSAFE_HOLD;
    }
    return are_parked ? FAILSAFE_PARKED : FAILSAFE_RAMP;
}

FAILSAFE_FUNCTION bool failsafe_resume(failsafe *self, const failsafe_parameters *parameters, uint32_t now,
                                       const failsafe_demand *output)
{
    uint8_t i;

    if (!FAILSAFE_AGREE(parameters->longest_step, parameters->hold_after, parameters->ramp_after,
                        parameters->frames_to_start, parameters->approach_for, parameters->approach_travel,
                        parameters->live_travel)) {
        return false;
    }
    self->parameters = *parameters;
    self->slow = failsafe_speed_of(parameters->approach_travel, parameters->longest_step);
    self->fast = failsafe_speed_of(parameters->live_travel, parameters->longest_step);
    self->now = now;
    self->quiet = UINT32_MAX;
    self->silence = UINT32_MAX;
    self->approached = 0U;
    self->in_row = 0U;
    self->has_frame = false;
    self->had_frame = false;
    for (i = 0U; i < FAILSAFE_AXES; i++) {
        self->demands[i] = parameters->park[i];
        self->axes[i].position = output[i] * FAILSAFE_UNIT;
        self->axes[i].is_live = false;
        self->axes[i].rises = false;
    }
    self->clock_faults = 0U;
    self->late_polls = 0U;
    self->slow_frames = 0U;
    return true;
}

FAILSAFE_FUNCTION bool failsafe_init(failsafe *self, const failsafe_parameters *parameters, uint32_t now)
{
    return failsafe_resume(self, parameters, now, parameters->park);
}

FAILSAFE_FUNCTION failsafe_demand failsafe_most_per_poll(const failsafe *self)
{
    const uint32_t slow = self->slow.per_poll;
    const uint32_t fast = self->fast.per_poll;

    return (failsafe_demand)((((slow > fast) ? slow : fast) + (FAILSAFE_UNIT - 1U)) / FAILSAFE_UNIT);
}

FAILSAFE_FUNCTION void failsafe_frame(failsafe *self, const failsafe_demand *demands)
{
    uint8_t i;

    for (i = 0U; i < FAILSAFE_AXES; i++) {
        self->demands[i] = demands[i];
    }
    self->has_frame = true;
}

FAILSAFE_FUNCTION failsafe_phase failsafe_poll(failsafe *self, uint32_t now, failsafe_demand *output)
{
    const uint32_t elapsed = failsafe_pass(self, now);

    return failsafe_move(self, failsafe_way(self->slow, elapsed), failsafe_way(self->fast, elapsed), output);
}

#endif

#endif
