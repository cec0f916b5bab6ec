/* The receiver on which the Rust harnesses perform steps, and its counters. The including file defines RUST_REASONS:
 * the C names of the reasons to discard bytes, in the order of `counters` in src/windows.rs, and for packets also
 * BROKEN_STUFFING as the last. NONE stands for a reason that the header does not have. */
static X(receiver) receiver;
static X(message) message;

/* Returns the number of bytes in frames plus the number of discarded bytes. */
static uint32_t placed(const X(counters) *counters)
{
    uint32_t sum = counters->frame_bytes;
    uint8_t i;

    for (i = 0U; i < XX(REASONS); i++) {
        sum += counters->discarded[i];
    }
    return sum;
}

/* Returns the counter with this number, in the order of `counters` in src/windows.rs. */
uint32_t c_counter(uint8_t place)
{
    static const X(outcome) reasons[] = RUST_REASONS;
    const X(counters) *counters = &receiver.counters;

    switch (place) {
    case 0: return counters->bytes;
    case 1: return counters->frames;
    case 2: return counters->frame_bytes;
    case 3: return counters->resynchronisations;
    default: break;
    }
    place = (uint8_t)(place - 4U);
    if (place < XX(EVENTS)) {
        return counters->events[place];
    }
    place = (uint8_t)(place - XX(EVENTS));
    return (reasons[place] == NONE) ? 0U : counters->discarded[reasons[place]];
}
