#include "../headers/rtcm.h"
#define NAME rtcm
#define UPPER RTCM
#define MOST 32U
#define TURNS 34
#define SPACE 8U
#define ENCODE_TURNS 10
#define RUST_REASONS \
    {RTCM_NO_SYNC, NONE, RTCM_BAD_HEADER, NONE, NONE, RTCM_CHECKSUM_MISMATCH, NONE, RTCM_LINE_EVENT}
#define POINT POINT_TO(payload)
#include "buffered.h"
