#define COBS_LONGEST 4U
#include "../headers/cobs.h"
#define NAME cobs
#define UPPER COBS
#include "packets.h"
