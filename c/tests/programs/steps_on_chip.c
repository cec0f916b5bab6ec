/* The steps and the program's output are in RAM, where the test writes and reads them. The start-up code only
 * initialises variables. */
#include "steps.h"

extern uint32_t _bss_start, _bss_end, _data_start, _data_end, _data_in_flash;
void reset(void);
void begin(void);
void end(void);

uint8_t STEPS[24 << 10];
volatile uint32_t LENGTH;
char SAID[160 << 10];
volatile uint32_t SAID_LENGTH;
volatile uint32_t IS_RECEIVING;

void say(char character)
{
    if (SAID_LENGTH < sizeof SAID) {
        SAID[SAID_LENGTH] = character;
    }
    SAID_LENGTH = SAID_LENGTH + 1;
}

/* The test writes the steps when the program reaches this function. */
__attribute__((noinline)) void begin(void)
{
    __asm__ volatile("nop");
}

/* The test reads the output when the program reaches this function. */
__attribute__((noinline)) void end(void)
{
    for (;;) {
        __asm__ volatile("nop");
    }
}

void reset(void)
{
    const uint32_t *from = &_data_in_flash;
    for (uint32_t *to = &_data_start; to < &_data_end;) {
        *to++ = *from++;
    }
    for (uint32_t *to = &_bss_start; to < &_bss_end;) {
        *to++ = 0;
    }
    begin();
    IS_RECEIVING = take(STEPS, LENGTH);
    end();
}
