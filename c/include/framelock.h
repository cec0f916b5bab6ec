// framelock: a serial-frame receiver that never goes deaf. docs/c.md shows how to use it.
//
// Memory: each struct is yours, usually a static variable. Nothing is allocated. A receiver or failsafe does
// nothing until it is initialised; before that it must be all zeros, as static variables are.
//
// Pointers are valid or NULL. Where a count goes with one, so many values are there. With NULL nothing happens, and
// the answer is false or FRAMELOCK_NO_OUTPUT. Only where a setpoint or a frame would be written, NULL means: do not
// write it.
//
// What layouts point to, made layouts and buffers must stay for as long as a receiver uses them: the first unchanged,
// the others untouched.
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

// What one of the library's own layouts is.
typedef struct framelock_shipped_layout framelock_shipped_layout;

// A receiver of BIN frames: 'A' 'B' reserved pitch roll yaw CR.
typedef struct framelock_receiver {
  uint64_t aligned;
  size_t opaque[20];
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
  uint32_t bytes;
  // Frames committed.
  uint32_t frames;
  // Bytes in them.
  uint32_t frame_bytes;
  // Bytes discarded because no frame begins with them.
  uint32_t discarded_no_sync;
  // Bytes discarded because a later byte of the sync was wrong.
  uint32_t discarded_broken_sync;
  // Bytes discarded because fixed bits of the header were wrong, or its length was too short.
  uint32_t discarded_header;
  // Bytes discarded because the header told a length above that of the longest frame.
  uint32_t discarded_too_long;
  // Bytes discarded because the header told a message that there is not.
  uint32_t discarded_unknown_message;
  // Bytes discarded because there was no terminator where it was due.
  uint32_t discarded_terminator;
  // Bytes discarded because the checksum was wrong.
  uint32_t discarded_check;
  // Bytes that were pending when a line event came.
  uint32_t discarded_line_event;
  // Bytes that may yet be part of a frame.
  size_t pending;
  // Frames that ended a loss: the first one after bytes were discarded.
  uint32_t resynchronisations;
  // How often `FRAMELOCK_FRAMING_ERROR` was reported.
  uint32_t framing_errors;
  // How often `FRAMELOCK_PARITY_ERROR` was reported.
  uint32_t parity_errors;
  // How often `FRAMELOCK_OVERRUN` was reported.
  uint32_t overruns;
  // How often `FRAMELOCK_BREAK` was reported.
  uint32_t breaks;
  // How often `FRAMELOCK_IDLE_LINE` was reported.
  uint32_t idle_lines;
} framelock_counters;

// A receiver of BIN-CRC8 frames: 'A' 'B' reserved pitch roll yaw crc CR.
typedef struct framelock_crc8_receiver {
  uint64_t aligned;
  size_t opaque[20];
} framelock_crc8_receiver;

// What a frame begins or ends with: some bytes, or one of several sequences of the same length.
typedef struct framelock_patterns {
  // All sequences, one behind the other.
  const uint8_t *bytes;
  // Bytes in each.
  size_t length;
  // How many sequences there are.
  size_t count;
} framelock_patterns;

// What tells a frame's length.
typedef uint8_t framelock_length_kind;

// A number without sign in the header.
typedef struct framelock_number {
  // The place of its first byte, counted from the front.
  size_t at;
  // How many bytes it has, 1 to 4.
  uint8_t bytes;
  // Whether the highest comes first.
  bool big_endian;
} framelock_number;

// What tells a frame's length; a number says that it has `(number & mask) * factor + plus` bytes, without what
// is appended.
typedef struct framelock_length {
  // One of the constants below.
  framelock_length_kind kind;
  // The number.
  struct framelock_number number;
  // Which of its bits count. 0: all.
  uint32_t mask;
  // Bytes for each one of it. 0: one.
  uint32_t factor;
  // What is to be added: the bytes that it does not count, or less than nothing.
  int32_t plus;
} framelock_length;

// Bits of one byte that are the same in each frame.
typedef struct framelock_fixed_bits {
  // The byte's place. In the header it is looked at before the rest of the frame is there.
  int16_t at;
  // Which of its bits.
  uint8_t mask;
  // What they are.
  uint8_t value;
} framelock_fixed_bits;

// A message.
typedef struct framelock_message {
  // Its number.
  uint32_t number;
  // The most that the length field says, without what its mask leaves out.
  uint16_t most;
  // A byte that the checksum covers at the end, though it is not sent: MAVLink's `CRC_EXTRA`.
  uint8_t extra;
  // Whether it does.
  bool has_extra;
} framelock_message;

// The messages of a protocol, by a number in the header.
typedef struct framelock_messages {
  // The number.
  struct framelock_number number;
  // What there is, by rising numbers: what is out of order may not be found.
  const struct framelock_message *known;
  // How many there are at `known`. 0: frames of any message.
  size_t count;
} framelock_messages;

// How a checksum is computed.
typedef uint8_t framelock_algorithm;

// How a checksum is written.
typedef uint8_t framelock_written;

// A CRC of 8 to 32 bits by its parameters, as <https://reveng.sourceforge.io/crc-catalogue> has them.
typedef struct framelock_crc {
  // `width`.
  uint8_t width;
  // `refin`.
  bool reflected_in;
  // `refout`.
  bool reflected_out;
  // `poly`.
  uint32_t polynomial;
  // `init`.
  uint32_t initial;
  // `xorout`.
  uint32_t xor_out;
} framelock_crc;

// A checksum in a frame.
typedef struct framelock_checksum {
  // How it is computed.
  framelock_algorithm algorithm;
  // How it is written.
  framelock_written written;
  // How many bytes of it are kept, 1 to 4: the lowest.
  uint8_t bytes;
  // Where they are.
  int16_t at;
  // The first byte that it covers.
  int16_t from;
  // The last.
  int16_t to;
  // The parameters of a CRC.
  struct framelock_crc crc;
} framelock_checksum;

// Bytes behind some frames, which neither the length nor the checksum counts: MAVLink's signature.
typedef struct framelock_appendix {
  // The place of the byte, counted from the front, that says whether they are there.
  size_t at;
  // They are if any of these bits is set.
  uint8_t mask;
  // How many. 0: none are.
  size_t bytes;
} framelock_appendix;

// What a frame looks like. What you leave out is 0, and means that there is none.
//
// A place in a frame is a number: 0 is the first byte, 1 the second; -1 is the last, -2 the one before it.
typedef struct framelock_layout {
  // What a frame begins with.
  struct framelock_patterns sync;
  // What tells how long a frame is.
  struct framelock_length length;
  // Bytes in the shortest frame.
  size_t shortest;
  // Bytes in the longest frame. It bounds memory, and how late a frame may come behind a false beginning.
  size_t longest;
  // Bits that are the same in each frame, besides sync and terminator.
  const struct framelock_fixed_bits *fixed;
  // How many there are at `fixed`.
  size_t fixed_count;
  // Which messages there are, if a frame of another is none.
  struct framelock_messages messages;
  // The checksum.
  struct framelock_checksum checksum;
  // What a frame ends with.
  struct framelock_patterns terminator;
  // What is behind some frames.
  struct framelock_appendix appendix;
  // NULL in yours. In the library's own layouts the rest of them: there, `longest` alone is yours to change.
  const struct framelock_shipped_layout *shipped;
} framelock_layout;

// A receiver of frames of any layouts.
typedef struct framelock_layout_receiver {
  size_t opaque[26];
} framelock_layout_receiver;

// Room for a layout as a receiver asks it: made once, not for each byte.
typedef struct framelock_made_layout {
  size_t opaque[40];
} framelock_made_layout;

// A frame that was received. Its bytes are there until the next call with that receiver.
typedef struct framelock_frame {
  // All of it, from the sync to the end.
  const uint8_t *bytes;
  // How many bytes.
  size_t length;
  // Which of the receiver's layouts it has: the first is 0.
  size_t layout;
} framelock_frame;

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

// Each frame has `longest` bytes.
#define FRAMELOCK_FIXED_LENGTH 0

// A number in the header.
#define FRAMELOCK_LENGTH_FIELD 1

// The first terminator behind the sync is the end.
#define FRAMELOCK_DELIMITER 2

// There is no checksum.
#define FRAMELOCK_NO_CHECKSUM 0

// A cyclic redundancy check.
#define FRAMELOCK_CRC 1

// The bytes added up.
#define FRAMELOCK_SUM 2

// All bits of the sum inverted: 0xFFFF - sum, in two bytes.
#define FRAMELOCK_INVERTED_SUM 3

// What makes the sum zero.
#define FRAMELOCK_NEGATED_SUM 4

// The exclusive or of the bytes.
#define FRAMELOCK_XOR 5

// Two sums of 8 bits: the second adds up what the first has been. The first is the low byte.
#define FRAMELOCK_FLETCHER 6

// As a number, the lowest byte first.
#define FRAMELOCK_LITTLE_ENDIAN 0

// As a number, the highest byte first.
#define FRAMELOCK_BIG_ENDIAN 1

// As two hexadecimal digits for each byte, the highest first; read in capitals or not.
#define FRAMELOCK_HEX 2

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

// BIN: 'A' 'B' reserved pitch roll yaw CR.
extern const struct framelock_layout framelock_bin_layout;

// BIN-CRC8: 'A' 'B' reserved pitch roll yaw crc CR.
extern const struct framelock_layout framelock_bin_crc8_layout;

// Six axes of 16 bits, in either byte order.
extern const struct framelock_layout framelock_six_axes_layout;

// Futaba's sbus::LAYOUT.
extern const struct framelock_layout framelock_sbus_layout;

// FlySky's iBUS, the frames for servos.
extern const struct framelock_layout framelock_ibus_layout;

// crsf::LAYOUT, of TBS and ExpressLRS.
extern const struct framelock_layout framelock_crsf_layout;

// u-blox's ubx::LAYOUT. `longest` is the protocol's, 65543: make it what the messages need that you switch on.
extern const struct framelock_layout framelock_ubx_layout;

// nmea::LAYOUT 0183.
extern const struct framelock_layout framelock_nmea_layout;

// rtcm::LAYOUT 3.
extern const struct framelock_layout framelock_rtcm_layout;

// MAVLink 1, with the messages of the dialect `common`.
extern const struct framelock_layout framelock_mavlink1_common_layout;

// MAVLink 1, with the messages of the dialects `common` and `ardupilotmega`.
extern const struct framelock_layout framelock_mavlink1_ardupilotmega_layout;

// MAVLink 2, with the messages of the dialect `common`.
extern const struct framelock_layout framelock_mavlink2_common_layout;

// MAVLink 2, with the messages of the dialects `common` and `ardupilotmega`.
extern const struct framelock_layout framelock_mavlink2_ardupilotmega_layout;

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

// Makes `length` bytes a frame: writes sync, length, fixed bits, terminator and checksum, and leaves the rest as
// it is. Of several syncs or terminators it writes the first, unless one is there. Set the bits that announce an
// appendix before, and put it behind the frame.
//
// Returns whether it is a frame then: not if no frame has so many bytes, there is no such message, a terminator
// stands where none may, or the layout has something wrong.
bool framelock_seal(const struct framelock_layout *layout,
                    uint8_t *frame,
                    size_t length);

// Begins to receive frames of `count` layouts, which are tried in order until one fits. All counters
// are 0. `made` is room for as many layouts, which the receiver uses from now on.
//
// The buffer has `size` bytes: at least as many as the longest frame, better twice. If it has fewer, or a layout has
// a pointer or a constant that cannot be, or contradicts itself, it returns false, and the receiver is not initialised.
bool framelock_layout_receiver_init(struct framelock_layout_receiver *receiver,
                                    const struct framelock_layout *layouts,
                                    struct framelock_made_layout *made,
                                    size_t count,
                                    uint8_t *buffer,
                                    size_t size);

// Takes the next byte. If that leads to a frame, says which and returns true. If not, leaves `frame` as it is and
// returns false.
//
// Behind a false beginning each call catches up by one: if no byte follows soon, call
// `framelock_layout_receiver_poll` until it returns false.
bool framelock_layout_receiver_push(struct framelock_layout_receiver *receiver,
                                    uint8_t byte,
                                    struct framelock_frame *frame);

// Goes on with what `framelock_layout_receiver_push` has left, up to the next frame; returns as it does.
bool framelock_layout_receiver_poll(struct framelock_layout_receiver *receiver,
                                    struct framelock_frame *frame);

// Calls `found`, unless it is NULL, with each frame that lies whole in what is pending; drops the rest, so that no
// frame has bytes from before the event, and counts it. Do not push a byte that is known to be bad: report the
// event in its place. `found` must not call functions with this receiver.
void framelock_layout_receiver_line_event(struct framelock_layout_receiver *receiver,
                                          framelock_line_event event,
                                          void (*found)(void *context,
                                                        const struct framelock_frame *frame),
                                          void *context);

// Writes the counters and returns true; or false if there are none.
bool framelock_layout_receiver_counters(const struct framelock_layout_receiver *receiver,
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
