/* Runs a program on a chip. The program reads steps and writes numbers. On simavr's ATmega328P, the steps are an array
 * in flash, which the test writes to steps.h, and the UART sends the numbers. On the emulated nRF52840, the test writes
 * the steps into RAM when the program reaches `begin`, and reads the last number when the program reaches `end`. */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The program. */
void run(void);

#if defined(__AVR__)
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/sleep.h>

#include "steps.h"

static uint16_t at;

static inline bool has_more(void)
{
    return at < sizeof STEPS;
}

static inline uint8_t next_byte(void)
{
    return pgm_read_byte(&STEPS[at++]);
}

static void send(uint8_t byte)
{
    while ((UCSR0A & (1U << UDRE0)) == 0U) {
    }
    UDR0 = byte;
}

static void say(uint32_t number)
{
    uint8_t shift;

    for (shift = 32U; shift > 0U; shift = (uint8_t)(shift - 4U)) {
        send((uint8_t)"0123456789abcdef"[(number >> (shift - 4U)) & 15U]);
    }
    send('\n');
}

int main(void)
{
    UCSR0B = 1U << TXEN0;
    run();
    cli();
    sleep_enable();
    sleep_cpu();
    return 0;
}
#else
extern uint32_t _bss_start, _bss_end, _data_start, _data_end, _data_in_flash;
void reset(void);
void begin(void);
void end(void);
void *memset(void *to, int byte, size_t count);
void *memcpy(void *to, const void *from, size_t count);

uint8_t STEPS[160 << 10];
volatile uint32_t LENGTH;
volatile uint32_t SAID;

static uint32_t at;

static inline bool has_more(void)
{
    return at < LENGTH;
}

static inline uint8_t next_byte(void)
{
    return STEPS[at++];
}

static inline void say(uint32_t number)
{
    SAID = number;
}

__attribute__((noinline)) void begin(void)
{
    __asm__ volatile("nop");
}

__attribute__((noinline)) void end(void)
{
    for (;;) {
        __asm__ volatile("nop");
    }
}

/* The compiler may insert calls to these functions, and there is no C library. */
void *memset(void *to, int byte, size_t count)
{
    uint8_t *place = (uint8_t *)to;

    while (count > 0U) {
        *place++ = (uint8_t)byte;
        count--;
        __asm__ volatile("");
    }
    return to;
}

void *memcpy(void *to, const void *from, size_t count)
{
    uint8_t *place = (uint8_t *)to;
    const uint8_t *source = (const uint8_t *)from;

    while (count > 0U) {
        *place++ = *source++;
        count--;
        __asm__ volatile("");
    }
    return to;
}

void reset(void)
{
    const uint32_t *from = &_data_in_flash;
    uint32_t *to;

    for (to = &_data_start; to < &_data_end; to++) {
        *to = *from++;
    }
    for (to = &_bss_start; to < &_bss_end; to++) {
        *to = 0U;
    }
    begin();
    run();
    end();
}
#endif
