#define __AVR__
#include "../headers/mavlink.h"
#define NAME mavlink
#define UPPER MAVLINK
#define MOST 32U
#define TURNS 34
#define RUST_REASONS \
    {MAVLINK_NO_SYNC, NONE, MAVLINK_BAD_HEADER, NONE, MAVLINK_UNKNOWN_MESSAGE, MAVLINK_CHECKSUM_MISMATCH, NONE, MAVLINK_LINE_EVENT}
#include "buffered.h"
