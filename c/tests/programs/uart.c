/* What docs/c.md leaves to the firmware: bytes from standard input, where 0xFF stands for a framing error. Each
 * takes a millisecond, and then there is a timer interrupt. */
#include <stdio.h>

#include "framelock.h"

bool start(void);
void uart_interrupt(void);
void timer_interrupt(void);

static uint32_t now;
static int byte;

bool uart_has_error(void)
{
    return byte == 0xFF;
}

uint8_t uart_read(void)
{
    return (uint8_t)byte;
}

uint32_t milliseconds(void)
{
    return now;
}

void drive(framelock_setpoint output)
{
    printf("%d %d %d\n", output.pitch, output.roll, output.yaw);
}

int main(void)
{
    if (!start()) {
        return 1;
    }
    for (; (byte = getchar()) != EOF; now++) {
        uart_interrupt();
        timer_interrupt();
    }
    return 0;
}
