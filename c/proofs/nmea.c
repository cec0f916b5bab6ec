#include "../headers/nmea.h"
#define NAME nmea
#define UPPER NMEA
#define MOST 24U
#define TURNS 26
#define SPACE 9U
#define ENCODE_TURNS 11
#define RUST_REASONS \
    {NMEA_NO_SYNC, NONE, NMEA_BAD_HEADER, NONE, NONE, NMEA_CHECKSUM_MISMATCH, NMEA_WRONG_TERMINATOR, NMEA_LINE_EVENT}
#define POINT POINT_TO(sentence)
#include "buffered.h"
