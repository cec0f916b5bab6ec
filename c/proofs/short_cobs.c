#include "headers/short_cobs.h"
#define NAME short_cobs
#define UPPER SHORT_COBS
#include "packets.h"
