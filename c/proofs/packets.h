/* Proofs about a receiver of packets. They show that a step from any state that satisfies the invariant accesses only
 * memory that it may access, does not overflow, and keeps the invariant. They also show that the step gives each byte
 * exactly one outcome or leaves the byte pending, and that the receiver delivers each packet that `encode` writes.
 *
 * The packets have up to three bytes: slip.c and cobs.c define the header's LONGEST as 4, and include the header. Then
 * they define NAME and UPPER, the prefixes of the header's names, and include this file. */
#include "proof.h"
#define RUST_REASONS \
    {XX(NO_SYNC), NONE, NONE, XX(TOO_LONG), NONE, NONE, NONE, XX(LINE_EVENT), XX(BROKEN_STUFFING)}
#include "counters.h"

/* More iterations than any loop performs. */
#define BOUND 12
/* More than the size of a receiver in bytes. */
#define INIT_BOUND 100
#define PAYLOAD (XX(LONGEST) - 1U)
#define SPACE (2U * XX(LONGEST) + 4U)

static bool invariant(const X(receiver) *receiver)
{
    return (receiver->stage != XX(INSIDE)) ||
        ((receiver->length < receiver->ask_at) && (receiver->ask_at <= XX(LONGEST)));
}

/* Returns a receiver in any state that satisfies the invariant. Its counters are 0, which does not restrict the
 * proofs, because a step only adds to the counters. */
static X(receiver) any_receiver(void)
{
    static const X(counters) none;
    const uint8_t stage = nondet_uint8();
    X(receiver) receiver;

    ASSUME(stage <= (uint8_t)XX(INSIDE));
    receiver.counters = none;
    receiver.pending = nondet_uint16();
    receiver.stage = (X(stage))stage;
    receiver.is_lost = nondet_bool();
    ASSUME(invariant(&receiver));
    return receiver;
}

PROOF(init, INIT_BOUND)
{
    X(receiver) receiver;

    X(init)(&receiver);
    ASSERT(invariant(&receiver) && X(pending)(&receiver) == 0U && !receiver.is_lost);
    ASSERT(receiver.counters.bytes == 0U && placed(&receiver.counters) == 0U && receiver.counters.frames == 0U);
}

PROOF(push, BOUND)
{
    X(receiver) receiver = any_receiver();
    X(message) message;
    const uint32_t before = X(pending)(&receiver);
    const bool found = X(push)(&receiver, nondet_uint8(), &message);

    ASSERT(invariant(&receiver));
    ASSERT(receiver.counters.bytes == 1U && receiver.counters.frames == (found ? 1U : 0U));
    ASSERT(before + 1U == placed(&receiver.counters) + X(pending)(&receiver));
    ASSERT(!found || (message.packet == receiver.buffer && message.packet_length <= PAYLOAD));
    COVER(found && message.packet_length == PAYLOAD);
    COVER(receiver.counters.discarded[XX(BROKEN_STUFFING)] == 7U);
}

PROOF(line_event, BOUND)
{
    X(receiver) receiver = any_receiver();
    const uint32_t before = X(pending)(&receiver);
    const uint8_t event = nondet_uint8();
    const bool is_kept = (event == XX(IDLE_LINE)) && (receiver.stage == XX(AT_START));

    ASSUME(event < XX(EVENTS));
    X(line_event)(&receiver, (X(event))event, NULL, NULL);
    ASSERT(invariant(&receiver) && X(pending)(&receiver) == (is_kept ? before : 0U));
    ASSERT((receiver.stage == XX(AT_START)) == is_kept && receiver.stage != XX(INSIDE));
    ASSERT(receiver.counters.events[event] == 1U && receiver.counters.bytes == 0U && receiver.counters.frames == 0U);
    ASSERT(receiver.counters.discarded[XX(LINE_EVENT)] == (is_kept ? 0U : before));
    COVER(is_kept && before == 2U);
}

PROOF(encode, BOUND)
{
    static const X(receiver) none;
    uint8_t bytes[SPACE];
    uint8_t payload[PAYLOAD];
    const uint8_t room = nondet_uint8();
    X(message) sent;
    uint8_t i;

    sent.packet = payload;
    ASSUME(room <= SPACE && sent.packet_length <= PAYLOAD);
    /* Place the room at the end of the array, so that writing past it is an error. */
    uint8_t *const frame = bytes + (SPACE - room);
    const size_t length = X(encode)(&sent, frame, room);

    ASSERT(length <= room && (length > 0U || room < SPACE || sent.packet_length == 0U));
    receiver = none;
    for (i = 0U; i < length; i++) {
        const bool found = X(push)(&receiver, frame[i], &message);

        ASSERT(found == (i + 1U == length));
    }
    if (length > 0U) {
        ASSERT(message.packet_length == sent.packet_length);
        for (i = 0U; i < message.packet_length; i++) {
            ASSERT(message.packet[i] == payload[i]);
        }
    }
    COVER(length == room && length > XX(LONGEST) + 1U);
}

/* Functions for the harnesses in Rust. */

uint8_t c_push(uint8_t byte)
{
    return X(push)(&receiver, byte, &message);
}

void c_line_event(uint8_t event)
{
    X(line_event)(&receiver, (X(event))event, NULL, NULL);
}

uint8_t c_frame_length(void)
{
    return (uint8_t)receiver.length;
}

uint8_t c_frame_byte(uint8_t place)
{
    return receiver.buffer[place];
}

uint32_t c_pending(void)
{
    return X(pending)(&receiver);
}
