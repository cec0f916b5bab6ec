#define SLIP_LONGEST 4U
#include "../headers/slip.h"
#define NAME slip
#define UPPER SLIP
#include "packets.h"
