#include "../headers/six_axes_be.h"
#define NAME six_axes_be
#define UPPER SIX_AXES_BE
#define VALUES {message.axis[0], message.axis[1], message.axis[2], message.axis[3], message.axis[4], message.axis[5]}
#define RUST_REASONS \
    {SIX_AXES_BE_NO_SYNC, SIX_AXES_BE_BROKEN_SYNC, NONE, NONE, NONE, NONE, SIX_AXES_BE_WRONG_TERMINATOR, SIX_AXES_BE_LINE_EVENT}
#include "window.h"
