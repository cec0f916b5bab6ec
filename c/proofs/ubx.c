#include "../headers/ubx.h"
#define NAME ubx
#define UPPER UBX
#define MOST 64U
#define TURNS 66
#define SPACE 10U
#define ENCODE_TURNS 12
#define RUST_REASONS \
    {UBX_NO_SYNC, UBX_BROKEN_SYNC, NONE, UBX_TOO_LONG, NONE, UBX_CHECKSUM_MISMATCH, NONE, UBX_LINE_EVENT}
#define POINT POINT_TO(payload)
#include "buffered.h"
