#include "../headers/sbus.h"
#define NAME sbus
#define UPPER SBUS
#define MOST 25U
#define TURNS 27
#define SPACE 25U
#define ENCODE_TURNS 40
#define RUST_REASONS \
    {SBUS_NO_SYNC, NONE, NONE, NONE, NONE, NONE, SBUS_WRONG_TERMINATOR, SBUS_LINE_EVENT}
#define POINT
#include "buffered.h"
