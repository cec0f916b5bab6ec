/* The part of the firmware that docs/protocol.md does not contain. Reads bytes from standard input, and prints the
 * setpoint after each byte. */
#include <stdio.h>
#include <stdint.h>

#include "page.c"

static int received;

uint8_t uart_read(void)
{
    return (uint8_t)received;
}

#ifdef FRAMELOCK
#define SETPOINT setpoint.pitch, setpoint.roll, setpoint.yaw
#else
#define start()
#define SETPOINT pitch, roll, yaw
#endif

int main(void)
{
    start();
    while ((received = getchar()) != EOF) {
        receive_interrupt();
        printf("%d %d %d\n", SETPOINT);
    }
    return 0;
}
