#define __AVR__
#include "../headers/mavlink2.h"
#define NAME mavlink2
#define UPPER MAVLINK2
#define MOST 32U
#define TURNS 34
#define RUST_REASONS \
    {MAVLINK2_NO_SYNC, NONE, MAVLINK2_BAD_HEADER, NONE, MAVLINK2_UNKNOWN_MESSAGE, MAVLINK2_CHECKSUM_MISMATCH, NONE, MAVLINK2_LINE_EVENT}
#include "buffered.h"
