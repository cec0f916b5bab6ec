/* Proofs about the engine of receivers with a buffer. The engine is in the included files, which the generator copies
 * into each header. The copies differ only in the names and in the type of an index. The classifier here may return any
 * outcome that a layout can return, so the proofs hold for all layouts. The proofs show that a step from any state that
 * satisfies the invariant accesses only memory that it may access, does not overflow, terminates, and keeps the
 * invariant. They also show that the step gives each byte exactly one outcome or leaves the byte pending. */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#define NAME any
#define UPPER ANY
#include "proof.h"

/* The engine has no case that depends on these sizes. */
#define ANY_LONGEST 3U
#define ANY_ROOM 5U
/* More iterations than any loop performs. At most three bytes are pending, and before `poll` and `line_event` at most
 * two. */
#define TURNS 4

typedef uint8_t any_index;

typedef enum {
    ANY_NO_SYNC,
    ANY_BROKEN_SYNC,
    ANY_BAD_HEADER,
    ANY_TOO_LONG,
    ANY_UNKNOWN_MESSAGE,
    ANY_CHECKSUM_MISMATCH,
    ANY_WRONG_TERMINATOR,
    ANY_LINE_EVENT,
    ANY_REASONS,
    ANY_FRAME = ANY_REASONS,
    ANY_INCOMPLETE
} any_outcome;

typedef struct {
    const uint8_t *frame;
    any_index length;
} any_message;

#define ANY_FUNCTION static
#include "../../host/generate/templates/engine/counters.h"
#include "../../host/generate/templates/engine/receiver.h"

/* The answers that the classifier's two functions will give, and the questions that they were asked. A question
 * consists of the first byte, the number of bytes, and the number of bytes that have been classified before. For
 * `any_classify_before` this last number is BEFORE plus the event. */
#define ANSWERS (ANY_LONGEST + 1U)
#define BEFORE 250U
typedef struct {
    uint8_t outcome;
    uint8_t number;
} answer;
typedef struct {
    uint8_t first;
    uint8_t count;
    uint8_t seen;
} question;
static answer answers[ANSWERS];
static question questions[ANSWERS];
static uint8_t asked;
/* A byte can begin a frame if bit `byte & 7` of this mask is 1. */
static uint8_t starting;

static bool any_starts(uint8_t byte)
{
    return ((starting >> (byte & 7U)) & 1U) != 0U;
}

/* Returns whether a layout can give this answer. The harnesses `classify` show, within their
 * bounds, that the shipped layouts except axes_text give no other answers. */
static bool is_possible(answer it, uint8_t count, uint8_t seen)
{
    if (it.outcome == ANY_FRAME) {
        return (it.number >= 1U) && (it.number <= count);
    }
    if (seen >= BEFORE) {
        return it.outcome < ANY_REASONS;
    }
    if (it.outcome == ANY_INCOMPLETE) {
        return (it.number > count) && (it.number <= ANY_LONGEST);
    }
    return (it.outcome < ANY_REASONS) && (it.outcome != ANY_LINE_EVENT);
}

static any_outcome ask(const uint8_t *bytes, uint8_t count, uint8_t seen, any_index *number)
{
    const volatile uint8_t last = bytes[count - 1U];
    answer it;

    (void)last;
    ASSERT((count >= 1U) && (count <= ANY_LONGEST));
    ASSERT(asked < ANSWERS);
    it = answers[asked];
    ASSUME(is_possible(it, count, seen));
    questions[asked].first = bytes[0];
    questions[asked].count = count;
    questions[asked].seen = seen;
    asked++;
    *number = it.number;
    return (any_outcome)it.outcome;
}

static any_outcome any_classify(const uint8_t *bytes, any_index count, any_index seen, any_index *number)
{
    any_outcome outcome;

    ASSERT(seen < count);
    outcome = ask(bytes, count, seen, number);
    ASSUME((outcome != ANY_NO_SYNC) == any_starts(bytes[0]));
    return outcome;
}

static any_outcome any_classify_before(const uint8_t *bytes, any_index count, any_event event, any_index *number)
{
    return ask(bytes, count, (uint8_t)(BEFORE + event), number);
}

static bool any_read(const uint8_t *frame, any_index length, any_message *message)
{
    message->frame = frame;
    message->length = length;
    return true;
}

static void any_clear(void *object, size_t size)
{
    static const any_receiver none;

    ASSERT(size == sizeof none);
    *(any_receiver *)object = none;
}

#include "../../host/generate/templates/engine/counting.h"
#include "../../host/generate/templates/engine/buffered.h"

static any_receiver receiver;
static any_message message;

/* The engine never sets `ask_at` to 1. In Rust this value means that a line event is being handled. */
static bool invariant(void)
{
    return (receiver.from <= receiver.to) && (receiver.to <= ANY_ROOM) && (receiver.to - receiver.from < (int)ANY_LONGEST) &&
        (receiver.ask_at <= receiver.from + ANY_LONGEST) && (receiver.ask_at != 1U);
}

/* Returns the number of bytes in frames plus the number of discarded bytes. */
static uint32_t placed(void)
{
    const uint32_t *const discarded = receiver.counters.discarded;

    return receiver.counters.frame_bytes + discarded[0] + discarded[1] + discarded[2] + discarded[3] + discarded[4] +
        discarded[5] + discarded[6] + discarded[7];
}

/* Puts the receiver into any state that satisfies the invariant, and makes the classifier give arbitrary answers. The
 * counters are 0, which does not restrict the proofs, because a step only adds to the counters. */
static void start(void)
{
    static const any_counters none;
    any_receiver any;

    receiver = any;
    receiver.counters = none;
    receiver.is_lost = nondet_bool();
    ASSUME(invariant());
    __CPROVER_havoc_object(answers);
    starting = nondet_uint8();
    asked = 0U;
}

static bool is_in_buffer(void)
{
    return (message.length >= 1U) && (message.length <= receiver.from) &&
        (message.frame == &receiver.buffer[receiver.from - message.length]);
}

PROOF(init, TURNS)
{
    any_receiver any;

    receiver = any;
    any_init(&receiver);
    ASSERT(invariant() && any_pending(&receiver) == 0U && !receiver.is_lost);
    ASSERT(receiver.counters.bytes == 0U && placed() == 0U && receiver.counters.frames == 0U);
}

PROOF(push, TURNS)
{
    start();
    const uint32_t before = any_pending(&receiver);
    const bool found = any_push(&receiver, nondet_uint8(), &message);

    ASSERT(invariant() && asked <= 1U);
    ASSERT(receiver.counters.bytes == 1U && receiver.counters.frames == (found ? 1U : 0U));
    ASSERT(before + 1U == placed() + any_pending(&receiver));
    ASSERT(!found || is_in_buffer());
    COVER(found && any_pending(&receiver) > 0U);
    COVER(!found && receiver.from > 0U && receiver.ask_at > receiver.to);
}

PROOF(poll, TURNS)
{
    start();
    const uint32_t before = any_pending(&receiver);
    const bool found = any_poll(&receiver, &message);

    ASSERT(invariant() && receiver.counters.bytes == 0U && receiver.counters.frames == (found ? 1U : 0U));
    ASSERT(before == placed() + any_pending(&receiver));
    ASSERT(!found || is_in_buffer());
    COVER(found && asked == 2U);
    COVER(!found && any_pending(&receiver) > 0U);
}

static uint8_t received_frames;
static uint8_t received_bytes;

static void received(void *context, const any_message *one)
{
    ASSERT(context == &received_frames);
    message = *one;
    ASSERT(is_in_buffer());
    received_frames++;
    received_bytes = (uint8_t)(received_bytes + one->length);
}

PROOF(line_event, TURNS)
{
    start();
    const uint32_t before = any_pending(&receiver);
    const uint8_t event = nondet_uint8();
    const bool has_receiver = nondet_bool();

    ASSUME(event < ANY_EVENTS);
    any_line_event(&receiver, (any_event)event, has_receiver ? received : NULL, &received_frames);
    ASSERT(invariant() && any_pending(&receiver) == 0U && receiver.counters.events[event] == 1U);
    ASSERT(before == placed() && receiver.counters.bytes == 0U);
    ASSERT(!has_receiver || (received_frames == receiver.counters.frames && received_bytes == receiver.counters.frame_bytes));
    COVER(has_receiver && received_frames == 2U);
    COVER(received_frames == 1U && asked == 2U && questions[1].seen == BEFORE + event);
    COVER(receiver.counters.discarded[ANY_LINE_EVENT] > 0U && received_frames == 1U);
}

/* Functions for the harnesses in Rust. The C receiver performs its step first. Then the Rust receiver performs the same
 * step. The Rust receiver must ask the classifier the same questions as the C receiver, and gets the same answers. */

static uint8_t asked_in_rust;

void c_start_engine(void)
{
    start();
    asked_in_rust = 0U;
}

/* Returns one part of the receiver's state. `which` selects the part. */
uint8_t c_engine_state(uint8_t which)
{
    switch (which) {
    case 0: return receiver.from;
    case 1: return receiver.to;
    case 2: return receiver.ask_at;
    default: return receiver.is_lost;
    }
}

uint8_t c_byte(uint8_t place)
{
    return receiver.buffer[place];
}

uint8_t c_starts(uint8_t byte)
{
    return any_starts(byte);
}

/* Checks that the Rust receiver asks the same question as the C receiver. For the question `any_classify_before`,
 * `seen` is BEFORE plus the event. Returns the answer: the low byte is the outcome, and the high byte is the number. */
uint16_t c_answer(uint8_t first, uint8_t count, uint8_t seen)
{
    const question it = questions[asked_in_rust];
    const answer told = answers[asked_in_rust];

    ASSERT(asked_in_rust < asked);
    ASSERT(it.first == first && it.count == count && it.seen == seen);
    asked_in_rust++;
    return (uint16_t)(told.number * 256U + told.outcome);
}

uint8_t c_asked_the_same(void)
{
    return asked_in_rust == asked;
}

/* Pushes a byte. Returns the length of the delivered frame, whose bytes precede index `from`. Returns 0 if no frame is
 * delivered. */
uint8_t c_push(uint8_t byte)
{
    return any_push(&receiver, byte, &message) ? message.length : 0U;
}

uint8_t c_poll_frame(void)
{
    return any_poll(&receiver, &message) ? message.length : 0U;
}

/* The lengths and the first bytes of the frames that a line event delivers. */
static uint8_t lengths[ANY_LONGEST];
static uint8_t firsts[ANY_LONGEST];

static void note(void *context, const any_message *one)
{
    (void)context;
    lengths[received_frames] = one->length;
    firsts[received_frames] = one->frame[0];
    received_frames++;
}

uint8_t c_frames_of_event(uint8_t event)
{
    received_frames = 0U;
    any_line_event(&receiver, (any_event)event, note, NULL);
    return received_frames;
}

uint8_t c_length(uint8_t place)
{
    return lengths[place];
}

uint8_t c_first(uint8_t place)
{
    return firsts[place];
}

uint32_t c_counter(uint8_t place)
{
    const any_counters *const counters = &receiver.counters;

    switch (place) {
    case 0: return counters->bytes;
    case 1: return counters->frames;
    case 2: return counters->frame_bytes;
    case 3: return counters->resynchronisations;
    default: break;
    }
    place = (uint8_t)(place - 4U);
    return (place < ANY_EVENTS) ? counters->events[place] : counters->discarded[place - ANY_EVENTS];
}
