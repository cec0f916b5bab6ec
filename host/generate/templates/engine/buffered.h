ANY_FUNCTION uint32_t any_pending(const any_receiver *receiver)
{
    return (uint32_t)receiver->to - receiver->from;
}

/* Forgets the pending bytes. */
static inline void any_forget(any_receiver *receiver)
{
    receiver->from = 0U;
    receiver->to = 0U;
    receiver->ask_at = 0U;
}

/* Discards pending bytes up to the first byte that can begin a frame. Then classifies the other bytes, at most once. If
 * they begin with a frame, moves `from` past the frame and returns the frame's length. If they are rejected, discards
 * the first one. Returns 0 if there is no frame. Sets `*again` to false if the next decision needs more bytes, and to
 * true otherwise. If `has_waited` is true, discarded bytes are counted as ANY_LINE_EVENT. */
static inline any_index any_next(any_receiver *receiver, bool has_waited, bool *again)
{
    any_outcome outcome;
    any_index number = 0U;
    any_index seen;
    const any_index start = receiver->from;

    *again = false;
    if (receiver->to < receiver->ask_at) {
        return 0U;
    }
    /* If the first byte has not been classified yet, skip bytes that cannot begin a frame. */
    if (receiver->ask_at <= (receiver->from + 1U)) {
        while ((receiver->from < receiver->to) && !any_starts(receiver->buffer[receiver->from])) {
            receiver->from++;
        }
        if (receiver->from > start) {
            any_count_discarded(receiver, has_waited ? ANY_LINE_EVENT : ANY_NO_SYNC, (any_index)(receiver->from - start));
            receiver->ask_at = 0U;
        }
    }
    if (receiver->from == receiver->to) {
        any_forget(receiver);
        return 0U;
    }
    seen = (receiver->ask_at > receiver->from) ? (any_index)(receiver->ask_at - (receiver->from + 1U)) : (any_index)0U;
    receiver->ask_at = 0U;
    outcome = any_classify(&receiver->buffer[receiver->from], (any_index)(receiver->to - receiver->from), seen, &number);
    if (outcome == ANY_INCOMPLETE) {
        receiver->ask_at = (any_index)(receiver->from + number);
        return 0U;
    }
    *again = true;
    if (outcome == ANY_FRAME) {
        receiver->from = (any_index)(receiver->from + number);
        any_count_frame(receiver, number);
        return number;
    }
    receiver->from++;
    any_count_discarded(receiver, has_waited ? ANY_LINE_EVENT : outcome, 1U);
    return 0U;
}

/* Moves the pending bytes to the front of the buffer. */
static inline void any_move_to_front(any_receiver *receiver)
{
    const any_index from = receiver->from;
    any_index i;

    receiver->from = 0U;
    receiver->to = (any_index)(receiver->to - from);
    receiver->ask_at = (receiver->ask_at > from) ? (any_index)(receiver->ask_at - from) : (any_index)0U;
    for (i = 0U; i < receiver->to; i++) {
        receiver->buffer[i] = receiver->buffer[from + i];
    }
}

ANY_FUNCTION bool any_push(any_receiver *receiver, uint8_t byte, any_message *message)
{
    any_index length;
    bool again;

    receiver->counters.bytes++;
    if (((receiver->to + 1U) < receiver->ask_at) && (receiver->to < ANY_ROOM)) {
        /* No decision is possible yet, so only store the byte. */
        receiver->buffer[receiver->to] = byte;
        receiver->to++;
        return false;
    }
    if (receiver->from == receiver->to) {
        any_forget(receiver);
        if (!any_starts(byte)) {
            any_count_discarded(receiver, ANY_NO_SYNC, 1U);
            return false;
        }
    }
    if (receiver->to == ANY_ROOM) {
        any_move_to_front(receiver);
    }
    receiver->buffer[receiver->to] = byte;
    receiver->to++;
    length = any_next(receiver, false, &again);
    if (length == 0U) {
        return false;
    }
    return any_read(&receiver->buffer[receiver->from - length], length, message);
}

ANY_FUNCTION bool any_poll(any_receiver *receiver, any_message *message)
{
    any_index length;
    bool again;

    /* Each iteration except the last removes at least one byte from the pending bytes. */
    do {
        length = any_next(receiver, false, &again);
        if ((length > 0U) && any_read(&receiver->buffer[receiver->from - length], length, message)) {
            return true;
        }
    } while (again);
    return false;
}

/* Handles a line event after pending bytes that the classifier has found incomplete. If these bytes begin with a frame,
 * moves `from` past the frame and returns the frame's length. Otherwise discards the first byte and returns 0. */
static inline any_index any_end_first(any_receiver *receiver, any_event event)
{
    any_index number = 0U;
    const any_outcome outcome =
        any_classify_before(&receiver->buffer[receiver->from], (any_index)(receiver->to - receiver->from), event, &number);

    /* The line event ends the wait for more bytes. */
    receiver->ask_at = 0U;
    if (outcome == ANY_FRAME) {
        receiver->from = (any_index)(receiver->from + number);
        any_count_frame(receiver, number);
        return number;
    }
    receiver->from++;
    any_count_discarded(receiver, outcome, 1U);
    return 0U;
}

ANY_FUNCTION void any_line_event(any_receiver *receiver, any_event event,
    void (*received)(void *context, const any_message *message), void *context)
{
    any_message message;
    any_index length;
    bool has_waited = false;
    bool again;

    receiver->counters.events[event]++;
    while (receiver->from < receiver->to) {
        length = any_next(receiver, has_waited, &again);
        if (!again && (receiver->from < receiver->to)) {
            /* From this byte on, discarded bytes have the line event as their reason, or the reason that
             * `any_classify_before` gives. */
            has_waited = true;
            length = any_end_first(receiver, event);
        }
        if ((length > 0U) && (received != NULL)
            && any_read(&receiver->buffer[receiver->from - length], length, &message)) {
            received(context, &message);
        }
    }
    any_forget(receiver);
}
