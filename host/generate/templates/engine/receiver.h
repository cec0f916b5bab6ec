/* A receiver. Read `counters`; the other members are private. */
typedef struct {
    any_counters counters;
    any_index from; /* the pending bytes are buffer[from] to buffer[to - 1] */
    any_index to;
    any_index ask_at; /* the next decision is possible when `to` reaches this index */
    bool is_lost; /* bytes were discarded since the last frame */
    uint8_t buffer[ANY_ROOM];
} any_receiver;
