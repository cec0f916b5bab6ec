/* The functions that docs/c-library.md leaves to the firmware of a platform. Each step is a byte; 0xFF stands for a
 * framing error. A step takes a millisecond, and a timer interrupt follows it. */
#include "steps.h"

bool start(void);
void uart_interrupt(void);
void timer_interrupt(void);

static uint32_t now;
static uint8_t byte;

bool uart_has_error(void)
{
    return byte == 0xFF;
}

uint8_t uart_read(void)
{
    return byte;
}

uint32_t milliseconds(void)
{
    return now;
}

void drive(framelock_setpoint output)
{
    say_number(output.pitch);
    say(' ');
    say_number(output.roll);
    say(' ');
    say_number(output.yaw);
    say('\n');
}

bool take(uint8_t *steps, size_t length)
{
    if (!start()) {
        return false;
    }
    for (size_t at = 0; at < length; at++, now++) {
        byte = steps[at];
        uart_interrupt();
        timer_interrupt();
    }
    return true;
}
