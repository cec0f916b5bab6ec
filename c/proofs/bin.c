#include "../headers/bin.h"
#define NAME bin
#define UPPER BIN
#define VALUES {message.pitch, message.roll, message.yaw}
#define RUST_REASONS \
    {BIN_NO_SYNC, BIN_BROKEN_SYNC, NONE, NONE, NONE, NONE, BIN_WRONG_TERMINATOR, BIN_LINE_EVENT}
#include "window.h"
