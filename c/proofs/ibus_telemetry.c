#include "../headers/ibus_telemetry.h"
#define NAME ibus_telemetry
#define UPPER IBUS_TELEMETRY
#define MOST 8U
#define TURNS 10
#define SPACE 8U
#define ENCODE_TURNS 40
#define RUST_REASONS \
    {IBUS_TELEMETRY_NO_SYNC, NONE, NONE, NONE, NONE, IBUS_TELEMETRY_CHECKSUM_MISMATCH, NONE, IBUS_TELEMETRY_LINE_EVENT}
#define POINT POINT_TO(payload)
#include "buffered.h"
