ANY_FUNCTION uint32_t any_pending(const any_receiver *receiver)
{
    return receiver->count;
}

ANY_FUNCTION bool any_push(any_receiver *receiver, uint8_t byte, any_message *message)
{
    any_outcome outcome = ANY_INCOMPLETE;
    any_index number = 0U;
    any_index start = 0U;
    any_index i;

    receiver->counters.bytes++;
    receiver->held[receiver->count] = byte;
    receiver->count++;
    /* Discard bytes until the remaining bytes can begin a frame. */
    while (start < receiver->count) {
        outcome = any_classify(&receiver->held[start], (any_index)(receiver->count - start), 0U, &number);
        if (outcome >= ANY_FRAME) {
            break;
        }
        any_count_discarded(receiver, outcome, 1U);
        start++;
    }
    if (outcome == ANY_FRAME) {
        /* All frames have the same length, so this frame consists of all pending bytes. */
        any_count_frame(receiver, ANY_LONGEST);
        receiver->count = 0U;
        return any_read(receiver->held, ANY_LONGEST, message);
    }
    if (start > 0U) {
        /* Move the remaining bytes to the front. */
        receiver->count = (any_index)(receiver->count - start);
        for (i = 0U; i < receiver->count; i++) {
            receiver->held[i] = receiver->held[start + i];
        }
    }
    return false;
}

ANY_FUNCTION void any_line_event(any_receiver *receiver, any_event event)
{
    receiver->counters.events[event]++;
    if (receiver->count > 0U) {
        any_count_discarded(receiver, ANY_LINE_EVENT, receiver->count);
        receiver->count = 0U;
    }
}
