#include "headers/short_slip.h"
#define NAME short_slip
#define UPPER SHORT_SLIP
#include "packets.h"
