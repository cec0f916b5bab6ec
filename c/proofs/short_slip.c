#include "headers/short_slip.h"
#define NAME short_slip
#define UPPER SHORT_SLIP
#define IS_POSSIBLE true
#include "packets.h"
