#include "../headers/ibus.h"
#define NAME ibus
#define UPPER IBUS
#define MOST 32U
#define TURNS 34
#define SPACE 32U
#define ENCODE_TURNS 34
#define RUST_REASONS \
    {IBUS_NO_SYNC, IBUS_BROKEN_SYNC, NONE, NONE, NONE, IBUS_CHECKSUM_MISMATCH, NONE, IBUS_LINE_EVENT}
#define POINT
#include "buffered.h"
