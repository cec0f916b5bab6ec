#include "../headers/bin_crc8.h"
#define NAME bin_crc8
#define UPPER BIN_CRC8
#define VALUES {message.pitch, message.roll, message.yaw}
#define RUST_REASONS \
    {BIN_CRC8_NO_SYNC, BIN_CRC8_BROKEN_SYNC, NONE, NONE, NONE, BIN_CRC8_CHECKSUM_MISMATCH, BIN_CRC8_WRONG_TERMINATOR, BIN_CRC8_LINE_EVENT}
#include "window.h"
