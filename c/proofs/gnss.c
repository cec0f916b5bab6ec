#include "../headers/gnss.h"
#define NAME gnss
#define UPPER GNSS
#define MOST 24U
#define TURNS 26
#define RUST_REASONS \
    {GNSS_NO_SYNC, GNSS_BROKEN_SYNC, GNSS_BAD_HEADER, GNSS_TOO_LONG, NONE, GNSS_CHECKSUM_MISMATCH, GNSS_WRONG_TERMINATOR, GNSS_LINE_EVENT}
#include "buffered.h"
