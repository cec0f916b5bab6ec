/* The functions that docs/c-library.md leaves to firmware that receives frames of a layout: CRSF, or with MOTOR those of
 * a motor. Steps: 'b' and a byte: the byte is received. 'e' and a byte: the byte has an error. 'i': the line is idle.
 * 's' and a number: a limit is sent. */
#include "steps.h"

bool start(void);
void uart_interrupt(void);
void idle_line_interrupt(void);

static bool has_error;
static uint8_t byte;

bool uart_has_error(void)
{
    return has_error;
}

uint8_t uart_read(void)
{
    return byte;
}

static void say_line(const uint8_t *bytes, size_t length)
{
    say_bytes(bytes, length);
    say('\n');
}

#ifdef MOTOR
bool limit_current(uint8_t amperes);

void measured(int16_t position, uint16_t current, int8_t temperature)
{
    const uint8_t bytes[] = {(uint8_t)((uint16_t)position >> 8), (uint8_t)position, (uint8_t)(current >> 8),
                             (uint8_t)current, (uint8_t)temperature};
    say_line(bytes, sizeof bytes);
}

void uart_write(const uint8_t *bytes, size_t length)
{
    say_line(bytes, length);
}
#else
#define limit_current(amperes) ((void)(amperes), true)

void set_channels(const uint8_t packed[22])
{
    say_line(packed, 22);
}
#endif

bool take(uint8_t *steps, size_t length)
{
    if (!start()) {
        return false;
    }
    for (size_t at = 0; at < length; at++) {
        if (steps[at] == 'i') {
            idle_line_interrupt();
        } else if (steps[at] == 's') {
            if (!limit_current(steps[++at])) {
                return false;
            }
        } else {
            has_error = steps[at] == 'e';
            byte = steps[++at];
            uart_interrupt();
        }
    }
    return true;
}
