#define __AVR__
#include "../headers/mavlink1.h"
#define NAME mavlink1
#define UPPER MAVLINK1
#define MOST 32U
#define TURNS 34
#define RUST_REASONS \
    {MAVLINK1_NO_SYNC, NONE, NONE, NONE, MAVLINK1_UNKNOWN_MESSAGE, MAVLINK1_CHECKSUM_MISMATCH, NONE, MAVLINK1_LINE_EVENT}
#include "buffered.h"
