// framelock: a serial-frame receiver that never goes deaf. docs/c.md shows how to use it.
//
// Memory: each struct is yours, usually a static variable. Nothing is allocated. A receiver or failsafe does
// nothing until it is initialised; before that it must be all zeros, as static variables are.
//
// Pointers are valid or NULL. With NULL nothing happens, and the answer is false or FRAMELOCK_NO_OUTPUT.
// Only where a setpoint would be written, NULL means: do not write it.
//
// Interrupts: two functions must not work on the same receiver or failsafe at once. Call them from one
// interrupt, or mask that interrupt while the main loop calls them.
//
// This file is made from c/src; do not edit it.

#ifndef FRAMELOCK_H
#define FRAMELOCK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// A receiver of BIN frames: 'A' 'B' reserved pitch roll yaw CR.
typedef struct framelock_receiver {
  uint64_t aligned;
  size_t opaque[18];
} framelock_receiver;

// One demand for each actuator, each 0 to 255 over the actuator's full travel.
typedef struct framelock_setpoint {
  // Demand of actuator 1.
  uint8_t pitch;
  // Demand of actuator 2.
  uint8_t roll;
  // Demand of actuator 3.
  uint8_t yaw;
} framelock_setpoint;

// Something that the UART or a timer noticed: one of the constants below. Any other is ignored.
typedef uint8_t framelock_line_event;

// Where each byte went, and how often things happened. The counters wrap.
//
// At any time `bytes` is `frame_bytes`, all of `discarded_...` and `pending` together.
typedef struct framelock_counters {
  // Bytes received.
  size_t bytes;
  // Frames committed.
  size_t frames;
  // Bytes in them.
  size_t frame_bytes;
  // Bytes discarded because no frame begins with them.
  size_t discarded_no_sync;
  // Bytes discarded because an 'A' was not followed by a 'B'.
  size_t discarded_broken_sync;
  // Bytes discarded because there was no CR where it was due.
  size_t discarded_terminator;
  // Bytes discarded because the checksum was wrong.
  size_t discarded_check;
  // Bytes that were pending when a line event came.
  size_t discarded_line_event;
  // Bytes that may yet be part of a frame.
  size_t pending;
  // Frames that ended a loss: the first one after bytes were discarded.
  size_t resynchronisations;
  // How often `FRAMELOCK_FRAMING_ERROR` was reported.
  size_t framing_errors;
  // How often `FRAMELOCK_PARITY_ERROR` was reported.
  size_t parity_errors;
  // How often `FRAMELOCK_OVERRUN` was reported.
  size_t overruns;
  // How often `FRAMELOCK_BREAK` was reported.
  size_t breaks;
  // How often `FRAMELOCK_IDLE_LINE` was reported.
  size_t idle_lines;
} framelock_counters;

// A receiver of BIN-CRC8 frames: 'A' 'B' reserved pitch roll yaw crc CR.
typedef struct framelock_crc8_receiver {
  uint64_t aligned;
  size_t opaque[18];
} framelock_crc8_receiver;

// A failsafe: what is between the setpoints and the actuators.
typedef struct framelock_failsafe {
  uint32_t opaque[16];
} framelock_failsafe;

// How a failsafe behaves. Times are in ticks of your clock, whatever that is.
typedef struct framelock_failsafe_parameters {
  // Silence after which the output is held. At least 1.
  uint32_t hold_after;
  // Silence after which the output moves to `park`. At least `hold_after`.
  uint32_t ramp_after;
  // Where each axis goes when no setpoint comes.
  struct framelock_setpoint park;
  // How many ticks one unit of demand takes, for pitch, roll and yaw. At least 1.
  uint32_t ticks_per_unit[3];
} framelock_failsafe_parameters;

// What a failsafe is doing: one of the constants below.
typedef uint8_t framelock_phase;

// No stop bit where one was due: noise, or a wrong baud rate.
#define FRAMELOCK_FRAMING_ERROR 0

// A parity error.
#define FRAMELOCK_PARITY_ERROR 1

// Bytes were lost because nobody fetched them in time.
#define FRAMELOCK_OVERRUN 2

// The line was held low for longer than a byte.
#define FRAMELOCK_BREAK 3

// No byte for longer than the sender leaves between the bytes of a frame.
#define FRAMELOCK_IDLE_LINE 4

// Nothing: it is not initialised, and there is no output.
#define FRAMELOCK_NO_OUTPUT 0

// The output is the last frame's setpoint.
#define FRAMELOCK_LIVE 1

// Frames come again; the output moves to the setpoint at the bounded rate.
#define FRAMELOCK_APPROACH 2

// Silence: the output stays where it is.
#define FRAMELOCK_HOLD 3

// Longer silence: the output moves to park at the bounded rate.
#define FRAMELOCK_RAMP 4

// Every axis is at park.
#define FRAMELOCK_PARKED 5

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Begins to receive. All counters are 0.
void framelock_receiver_init(struct framelock_receiver *receiver);

// Takes the next byte. If it completes a frame, writes its setpoint and returns true. If not, leaves
// `setpoint` as it is and returns false.
bool framelock_receiver_push(struct framelock_receiver *receiver,
                             uint8_t byte,
                             struct framelock_setpoint *setpoint);

// Drops what is pending, so that no frame has bytes from before the event, and counts it. Do not push a
// byte that is known to be bad: report the event in its place.
void framelock_receiver_line_event(struct framelock_receiver *receiver,
                                   framelock_line_event event);

// Writes the counters and returns true; or false if there are none.
bool framelock_receiver_counters(const struct framelock_receiver *receiver,
                                 struct framelock_counters *counters);

// As `framelock_receiver_init`.
void framelock_crc8_receiver_init(struct framelock_crc8_receiver *receiver);

// As `framelock_receiver_push`.
bool framelock_crc8_receiver_push(struct framelock_crc8_receiver *receiver,
                                  uint8_t byte,
                                  struct framelock_setpoint *setpoint);

// As `framelock_receiver_line_event`.
void framelock_crc8_receiver_line_event(struct framelock_crc8_receiver *receiver,
                                        framelock_line_event event);

// As `framelock_receiver_counters`.
bool framelock_crc8_receiver_counters(const struct framelock_crc8_receiver *receiver,
                                      struct framelock_counters *counters);

// Begins parked, at the time `now`. If the parameters break one of their rules it returns false, and the
// failsafe is not initialised.
bool framelock_failsafe_init(struct framelock_failsafe *failsafe,
                             const struct framelock_failsafe_parameters *parameters,
                             uint32_t now);

// Say that a frame was received, at the time `now`, with this setpoint.
void framelock_failsafe_frame(struct framelock_failsafe *failsafe,
                              uint32_t now,
                              struct framelock_setpoint setpoint);

// Writes where each axis is to be at the time `now`, and returns why. The time is a counter that may wrap:
// call this more often than it does. `FRAMELOCK_NO_OUTPUT` leaves `output` as it is.
framelock_phase framelock_failsafe_poll(struct framelock_failsafe *failsafe,
                                        uint32_t now,
                                        struct framelock_setpoint *output);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* FRAMELOCK_H */
