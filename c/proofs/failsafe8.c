#include <stdint.h>
#define FAILSAFE_AXES 2
/* The time wraps, as it should. */
#pragma CPROVER check push
#pragma CPROVER check disable "unsigned-overflow"
#include "../headers/failsafe.h"
#pragma CPROVER check pop
#include "failsafe.h"
