ANY_FUNCTION void any_init(any_receiver *receiver)
{
    any_clear(receiver, sizeof *receiver);
}

static inline void any_count_discarded(any_receiver *receiver, any_outcome reason, any_index count)
{
    receiver->counters.discarded[reason] += count;
    receiver->is_lost = true;
}

static inline void any_count_frame(any_receiver *receiver, any_index length)
{
    receiver->counters.frames++;
    receiver->counters.frame_bytes += length;
    if (receiver->is_lost) {
        receiver->is_lost = false;
        receiver->counters.resynchronisations++;
    }
}
