/* A failsafe between a receiver and actuators. It moves the actuators safely when frames stop and when they come again.
 * This is version 0.1.0 of framelock.
 * SPDX-License-Identifier: 0BSD
 * You may use, change and ship this file without conditions.
 *
 * This header needs only a C99 or C++17 compiler. It allocates no memory and does not recurse.
 *
 *                         frame                           silence >= hold_after
 *               +------------------------ HOLD <-----------------------------+
 *               v                           | silence >= ramp_after           |
 *     +------------------+                  v                                 |
 *     |     APPROACH     |    frame       RAMP -- every axis at park --> PARKED
 *     | bounded rate to  |<-----------------+---------- frame ------------+
 *     |    the demand    |
 *     +------------------+
 *               | every axis at the demand
 *               v
 *            LIVE: output = demand, frame by frame        (at reset: PARKED)
 *
 *   #define FAILSAFE_AXES 3
 *   #include "failsafe.h"
 *
 *   static failsafe platform;
 *   uint8_t output[FAILSAFE_AXES];
 *
 *   failsafe_init(&platform, &parameters, now);         returns false if the parameters contradict each other
 *   failsafe_frame(&platform, now, demands);            for each frame
 *   phase = failsafe_poll(&platform, now, output);      each time, before you set the actuators
 *
 * The time `now` is a counter that may wrap. Poll more often than the counter wraps. If the time goes backwards, the
 * failsafe assumes a long silence and moves the output to park, which is safe. Calls for one failsafe must not interrupt
 * each other.
 *
 * All functions are `static inline`. If several source files need them, define FAILSAFE_DEFINITIONS as 1 in one of
 * these files, and as 0 in the others, before they include this header. Then the program contains only one copy of the
 * code. */
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
    uint32_t hold_after; /* silence after which the output is held: at least 1 */
    uint32_t ramp_after; /* silence after which the output moves to park: at least hold_after */
    failsafe_demand park[FAILSAFE_AXES]; /* the position of each axis while no frames come */
    uint32_t ticks_per_unit[FAILSAFE_AXES]; /* the time that each axis takes for one unit of demand: at least 1 */
} failsafe_parameters;

/* The state of the output. */
typedef enum {
    FAILSAFE_LIVE, /* the output is the last frame's demands */
    FAILSAFE_APPROACH, /* frames come again: the output moves to the demands at the bounded rate */
    FAILSAFE_HOLD, /* silence: the output does not move */
    FAILSAFE_RAMP, /* longer silence: the output moves to park at the bounded rate */
    FAILSAFE_PARKED /* every axis is at park */
} failsafe_phase;

/* One axis that moves at a bounded rate. */
typedef struct {
    failsafe_demand position;
    uint32_t since_unit; /* ticks since the axis last moved by a unit; less than ticks_per_unit */
} failsafe_axis;

/* A failsafe. Its members are private. */
typedef struct {
    failsafe_parameters parameters;
    uint32_t now; /* the time of the last call */
    uint32_t silence; /* ticks since the last frame; saturates at UINT32_MAX */
    failsafe_demand demands[FAILSAFE_AXES];
    failsafe_axis axes[FAILSAFE_AXES];
} failsafe;

/* Initialises a failsafe with every axis at park. Returns false, and does nothing, if the parameters contradict each
 * other. */
FAILSAFE_FUNCTION bool failsafe_init(failsafe *self, const failsafe_parameters *parameters, uint32_t now);

/* Initialises a failsafe whose actuators are at `output`, for example after a reset. From there they move to park.
 * Returns false, and does nothing, if the parameters contradict each other. */
FAILSAFE_FUNCTION bool failsafe_resume(failsafe *self, const failsafe_parameters *parameters, uint32_t now,
                                       const failsafe_demand *output);

/* Takes the demands of a frame that was received at the time `now`. */
FAILSAFE_FUNCTION void failsafe_frame(failsafe *self, uint32_t now, const failsafe_demand *demands);

/* Writes the position of each axis at the time `now` to `output`, and returns the phase. */
FAILSAFE_FUNCTION failsafe_phase failsafe_poll(failsafe *self, uint32_t now, failsafe_demand *output);

#if !defined(FAILSAFE_DEFINITIONS) || FAILSAFE_DEFINITIONS

/* Puts an axis at a position. */
static inline void failsafe_set(failsafe_axis *axis, failsafe_demand position)
{
    axis->position = position;
    axis->since_unit = 0U;
}

/* Moves an axis towards the target for `ticks` ticks, by one unit every `ticks_per_unit` ticks. Stops at the target. */
static inline void failsafe_move(failsafe_axis *axis, failsafe_demand target, uint32_t ticks, uint32_t ticks_per_unit)
{
    const bool is_up = target > axis->position;
    const failsafe_demand distance =
        is_up ? (failsafe_demand)(target - axis->position) : (failsafe_demand)(axis->position - target);
    uint32_t units = 0U;
    uint32_t rest = ticks;

    if (ticks == 0U) {
        return;
    }
    if (ticks >= ticks_per_unit) {
        units = ticks / ticks_per_unit;
        rest = ticks % ticks_per_unit;
    }
    /* Add the ticks since the axis last moved by a unit. Compare before adding, because the sum with `rest` may exceed
     * 32 bits. */
    if (axis->since_unit >= (ticks_per_unit - rest)) {
        units++;
        rest = axis->since_unit - (ticks_per_unit - rest);
    } else {
        rest += axis->since_unit;
    }
    if (units >= distance) {
        failsafe_set(axis, target);
        return;
    }
    axis->position = is_up ? (failsafe_demand)(axis->position + units) : (failsafe_demand)(axis->position - units);
    axis->since_unit = rest;
}

/* Moves all axes towards their targets for `ticks` ticks. */
static inline void failsafe_move_all(failsafe *self, const failsafe_demand *targets, uint32_t ticks)
{
    uint8_t i;

    for (i = 0U; i < FAILSAFE_AXES; i++) {
        failsafe_move(&self->axes[i], targets[i], ticks, self->parameters.ticks_per_unit[i]);
    }
}

/* Returns whether all axes are at these positions. */
static inline bool failsafe_is_at(const failsafe *self, const failsafe_demand *positions)
{
    uint8_t i;

    for (i = 0U; i < FAILSAFE_AXES; i++) {
        if (self->axes[i].position != positions[i]) {
            return false;
        }
    }
    return true;
}

/* Moves the axes to their positions at the time `now`. Returns the phase at that time. */
static inline failsafe_phase failsafe_pass(failsafe *self, uint32_t now)
{
    const uint32_t hold_after = self->parameters.hold_after;
    const uint32_t ramp_after = self->parameters.ramp_after;
    const uint32_t elapsed = now - self->now;
    const uint32_t before = self->silence;
    const uint32_t until_hold = (before < hold_after) ? (hold_after - before) : 0U;
    const uint32_t until_ramp = (before < ramp_after) ? (ramp_after - before) : 0U;

    self->now = now;
    self->silence = (elapsed > (UINT32_MAX - before)) ? UINT32_MAX : (before + elapsed);
    /* Move towards the demands until the hold begins, and towards park after the ramp begins. */
    failsafe_move_all(self, self->demands, (elapsed < until_hold) ? elapsed : until_hold);
    failsafe_move_all(self, self->parameters.park, (elapsed > until_ramp) ? (elapsed - until_ramp) : 0U);
    if (self->silence < hold_after) {
        return failsafe_is_at(self, self->demands) ? FAILSAFE_LIVE : FAILSAFE_APPROACH;
    }
    if (self->silence < ramp_after) {
        return FAILSAFE_HOLD;
    }
    return failsafe_is_at(self, self->parameters.park) ? FAILSAFE_PARKED : FAILSAFE_RAMP;
}

FAILSAFE_FUNCTION bool failsafe_resume(failsafe *self, const failsafe_parameters *parameters, uint32_t now,
                                       const failsafe_demand *output)
{
    uint8_t i;

    if ((parameters->hold_after == 0U) || (parameters->ramp_after < parameters->hold_after)) {
        return false;
    }
    for (i = 0U; i < FAILSAFE_AXES; i++) {
        if (parameters->ticks_per_unit[i] == 0U) {
            return false;
        }
    }
    self->parameters = *parameters;
    self->now = now;
    self->silence = UINT32_MAX;
    for (i = 0U; i < FAILSAFE_AXES; i++) {
        self->demands[i] = parameters->park[i];
        failsafe_set(&self->axes[i], output[i]);
    }
    return true;
}

FAILSAFE_FUNCTION bool failsafe_init(failsafe *self, const failsafe_parameters *parameters, uint32_t now)
{
    return failsafe_resume(self, parameters, now, parameters->park);
}

FAILSAFE_FUNCTION void failsafe_frame(failsafe *self, uint32_t now, const failsafe_demand *demands)
{
    const bool is_live = failsafe_pass(self, now) == FAILSAFE_LIVE;
    uint8_t i;

    self->silence = 0U;
    for (i = 0U; i < FAILSAFE_AXES; i++) {
        self->demands[i] = demands[i];
        if (is_live) {
            failsafe_set(&self->axes[i], demands[i]);
        }
    }
}

FAILSAFE_FUNCTION failsafe_phase failsafe_poll(failsafe *self, uint32_t now, failsafe_demand *output)
{
    const failsafe_phase phase = failsafe_pass(self, now);
    uint8_t i;

    for (i = 0U; i < FAILSAFE_AXES; i++) {
        output[i] = self->axes[i].position;
    }
    return phase;
}

#endif

#endif
