#include "../headers/ibus_any.h"
#define NAME ibus_any
#define UPPER IBUS_ANY
#define MOST 32U
#define TURNS 34
#define SPACE 32U
#define ENCODE_TURNS 34
#define RUST_REASONS \
    {IBUS_ANY_NO_SYNC, NONE, NONE, NONE, NONE, IBUS_ANY_CHECKSUM_MISMATCH, NONE, IBUS_ANY_LINE_EVENT}
#define POINT
#include "buffered.h"
