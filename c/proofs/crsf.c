#include "../headers/crsf.h"
#define NAME crsf
#define UPPER CRSF
#define MOST 64U
#define TURNS 66
#define SPACE 7U
#define ENCODE_TURNS 10
#define RUST_REASONS \
    {CRSF_NO_SYNC, NONE, CRSF_BAD_HEADER, CRSF_TOO_LONG, NONE, CRSF_CHECKSUM_MISMATCH, NONE, CRSF_LINE_EVENT}
#define POINT POINT_TO(payload)
#include "buffered.h"
