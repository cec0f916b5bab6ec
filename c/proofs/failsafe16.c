#include <stdint.h>
#define FAILSAFE_AXES 2
#define FAILSAFE_DEMAND uint16_t
/* The clock may wrap, so unsigned overflow is not an error here. */
#pragma CPROVER check push
#pragma CPROVER check disable "unsigned-overflow"
#include "../headers/failsafe.h"
#pragma CPROVER check pop
#include "failsafe.h"
