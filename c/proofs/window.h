/* Proofs about a receiver whose frames all have the same length. They show that a step from any state that satisfies
 * the invariant accesses only memory that it may access, does not overflow, and keeps the invariant. They also show
 * that the step gives each byte exactly one outcome or leaves the byte pending.
 *
 * The file of a layout includes the header, defines the following macros, and includes this file:
 *
 *   NAME, UPPER    the prefixes of the header's names
 *   RUST_REASONS   see counters.h
 *   VALUES         the values of a message */
#include "proof.h"
#include "counters.h"

/* More iterations than any loop performs. */
#define BOUND 18
/* More than the size of a receiver in bytes. */
#define INIT_BOUND 100

static bool invariant(const X(receiver) *receiver)
{
    uint8_t number;

    return (receiver->count < XX(LONGEST)) &&
        ((receiver->count == 0U) || (X(classify)(receiver->held, receiver->count, 0U, &number) == XX(INCOMPLETE)));
}

/* Returns a receiver in any state that satisfies the invariant. Its counters are 0, which does not restrict the
 * proofs, because a step only adds to the counters. */
static X(receiver) any_receiver(void)
{
    static const X(counters) none;
    X(receiver) receiver;

    receiver.counters = none;
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
    ASSERT(receiver.counters.bytes == 1U);
    ASSERT(before + 1U == placed(&receiver.counters) + X(pending)(&receiver));
    ASSERT(receiver.counters.frames == (found ? 1U : 0U));
    COVER(found && receiver.counters.resynchronisations == 1U);
    COVER(!found && before == XX(LONGEST) - 1U && X(pending)(&receiver) > 0U);
}

PROOF(line_event, BOUND)
{
    X(receiver) receiver = any_receiver();
    const uint32_t before = X(pending)(&receiver);
    const uint8_t event = nondet_uint8();

    ASSUME(event < XX(EVENTS));
    X(line_event)(&receiver, (X(event))event);
    ASSERT(invariant(&receiver) && X(pending)(&receiver) == 0U);
    ASSERT(receiver.counters.events[event] == 1U && receiver.counters.bytes == 0U);
    ASSERT(before == receiver.counters.discarded[XX(LINE_EVENT)] && before == placed(&receiver.counters));
    COVER(before > 0U);
}

PROOF(encode, BOUND)
{
    uint8_t bytes[XX(LONGEST)];
    uint8_t number;
    X(message) message;
    const uint8_t room = nondet_uint8();

    ASSUME(room <= XX(LONGEST));
    /* Place the room at the end of the array, so that writing past it is an error. */
    uint8_t *const frame = bytes + (XX(LONGEST) - room);
    const size_t length = X(encode)(&message, frame, room);

    if (length > 0U) {
        ASSERT(length == XX(LONGEST) && length <= room);
        ASSERT(X(classify)(frame, XX(LONGEST), 0U, &number) == XX(FRAME) && number == length);
    }
    COVER(length > 0U);
}

/* Functions for the harnesses in Rust. */

/* Makes `count` bytes pending. `is_lost` says whether bytes were discarded since the last frame. */
void c_hold(uint8_t count, uint8_t is_lost)
{
    receiver.count = count;
    receiver.is_lost = is_lost != 0U;
}

void c_hold_byte(uint8_t place, uint8_t byte)
{
    receiver.held[place] = byte;
}

uint8_t c_held_byte(uint8_t place)
{
    return receiver.held[place];
}

uint8_t c_is_lost(void)
{
    return receiver.is_lost;
}

uint8_t c_push(uint8_t byte)
{
    return X(push)(&receiver, byte, &message);
}

void c_line_event(uint8_t event)
{
    X(line_event)(&receiver, (X(event))event);
}

uint32_t c_pending(void)
{
    return X(pending)(&receiver);
}

uint32_t c_value(uint8_t place)
{
    const uint32_t values[] = VALUES;

    return values[place];
}
