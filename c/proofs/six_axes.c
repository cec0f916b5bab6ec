#include "../headers/six_axes.h"
#define NAME six_axes
#define UPPER SIX_AXES
#define VALUES {message.axis[0], message.axis[1], message.axis[2], message.axis[3], message.axis[4], message.axis[5]}
#define RUST_REASONS \
    {SIX_AXES_NO_SYNC, SIX_AXES_BROKEN_SYNC, NONE, NONE, NONE, NONE, SIX_AXES_WRONG_TERMINATOR, SIX_AXES_LINE_EVENT}
#include "window.h"
