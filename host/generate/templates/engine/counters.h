/* A line event, which the UART or a timer detects. */
typedef enum {
    ANY_FRAMING_ERROR,
    ANY_PARITY_ERROR,
    ANY_OVERRUN,
    ANY_BREAK,
    ANY_IDLE_LINE,
    ANY_EVENTS /* the number of events */
} any_event;

/* Counters. They wrap at 2^32. */
typedef struct {
    uint32_t bytes; /* received bytes */
    uint32_t frames; /* delivered frames */
    uint32_t frame_bytes; /* bytes in delivered frames */
    uint32_t resynchronisations; /* delivered frames that follow discarded bytes */
    uint32_t discarded[ANY_REASONS]; /* discarded bytes, by reason */
    uint32_t events[ANY_EVENTS]; /* line events */
} any_counters;
