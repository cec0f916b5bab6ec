/* The part of the firmware that the programs in docs/c.md do not contain. Reads steps of two bytes from standard input.
 * The comments below list the steps of each program. Prints what the program does, and at the end the numbers of
 * frames, bytes and resynchronisations. */
#include <stdio.h>
#include <stdlib.h>

#include "page.c"

static void say(const uint8_t *bytes, uint32_t count)
{
    uint32_t i;

    for (i = 0U; i < count; i++) {
        printf("%02X", bytes[i]);
    }
    printf("\n");
}

/* Reads the next step. Returns false if there are no more steps. */
static bool next(int *kind, uint8_t *number)
{
    *kind = getchar();
    *number = (uint8_t)getchar();
    return *kind != EOF;
}

#if defined(INTERRUPT) || defined(RING)
static uint32_t now;
static uint8_t in_uart;
static bool is_wrong;

bool uart_has_error(void)
{
    return is_wrong;
}

uint8_t uart_read(void)
{
    return in_uart;
}
#endif

#if defined(INTERRUPT)
static bool is_disabled;
static int waiting = -1; /* the byte that the next interrupt brings while `control` runs */

/* Interrupts `control` with the waiting byte, unless the interrupts are disabled. */
static void interrupt_control(void)
{
    if ((waiting >= 0) && !is_disabled) {
        in_uart = (uint8_t)waiting;
        is_wrong = false;
        waiting = -1;
        uart_interrupt();
    }
}

uint32_t milliseconds(void)
{
    if (is_disabled) {
        abort();
    }
    interrupt_control();
    return now;
}

uint32_t interrupts_disable(void)
{
    const uint32_t state = is_disabled ? 1U : 0U;

    is_disabled = true;
    return state;
}

void interrupts_restore(uint32_t state)
{
    is_disabled = state != 0U;
}

void drive(const uint8_t *output)
{
    say(output, FAILSAFE_AXES);
}

/* Steps: {0, byte} is a received byte, {1, 0} is a byte with an error, and {1, n} with n > 0 advances the clock by n
 * milliseconds and calls `control`. {2, byte} is a byte that arrives during the next call of `control`, after this call
 * has emptied the mailbox. */
static void run(void)
{
    int kind;
    uint8_t number;

    if (!start()) {
        abort();
    }
    while (next(&kind, &number)) {
        if (kind == 2) {
            waiting = number;
        } else if ((kind == 1) && (number > 0U)) {
            now += number;
            control();
        } else {
            in_uart = number;
            is_wrong = kind == 1;
            uart_interrupt();
        }
    }
}
#elif defined(RING)
uint32_t milliseconds(void)
{
    return now;
}

void use_sentence(const uint8_t *sentence, uint16_t length)
{
    say(sentence, length);
}

/* Steps: {0, byte} is a received byte, {2, byte} is a byte with an error, and {1, n} is an iteration of the main loop
 * after n milliseconds. */
static void run(void)
{
    int kind;
    uint8_t number;

    start();
    while (next(&kind, &number)) {
        if (kind == 1) {
            now += number;
            main_loop();
        } else {
            in_uart = number;
            is_wrong = kind == 2;
            uart_interrupt();
        }
    }
}
#else
static void finish(void);

/* Steps: {0, byte} is a received byte, {2, number} is a line event, and {1, any} is a pause. */
bool queue_take(uint16_t *entry, uint32_t wait)
{
    int kind;
    uint8_t number;

    (void)wait;
    if (!next(&kind, &number)) {
        finish();
    }
    *entry = (uint16_t)(number + ((kind == 2) ? IS_EVENT : 0U));
    return kind != 1;
}

void use_message(uint32_t number, const uint8_t *payload, uint16_t length)
{
    printf("%lu ", (unsigned long)number);
    say(payload, length);
}

static void run(void)
{
    receive_task();
}
#endif

static void finish(void)
{
    printf("%lu frames in %lu bytes, %lu resynchronisations\n", (unsigned long)receiver.counters.frames,
        (unsigned long)receiver.counters.bytes, (unsigned long)receiver.counters.resynchronisations);
    exit(0);
}

int main(void)
{
    run();
    finish();
    return 0;
}
