#include <stdint.h>
#define FAILSAFE_AXES 2
#define FAILSAFE_DEMAND uint16_t
/* The time wraps, as it should. */
#pragma CPROVER check push
#pragma CPROVER check disable "unsigned-overflow"
#include "../headers/failsafe.h"
#pragma CPROVER check pop
#include "failsafe.h"
