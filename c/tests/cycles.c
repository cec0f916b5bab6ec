/* Measures the cycles of `push` for each byte of the input. On the emulated nRF52840, the test counts the cycles from
 * `take_byte` to `taken`. On simavr's ATmega328P, the program counts the cycles. It prints the average and the maximum
 * of the cycles for a byte, and the number of frames. */
#include "receiver.h"

#include "chip.h"

static F(receiver) receiver;
static F(message) message;

void take_byte(uint8_t byte);
void taken(void);

static volatile uint16_t frames;

__attribute__((noinline)) void take_byte(uint8_t byte)
{
    if (F(push)(&receiver, byte, &message)) {
        frames++;
    }
}

__attribute__((noinline)) void taken(void)
{
    __asm__ volatile("nop");
}

void run(void)
{
#if defined(__AVR__)
    uint32_t all = 0U;
    uint32_t count = 0U;
    uint16_t most = 0U;

    TCCR1B = 1U; /* counts each cycle */
#endif
    F(init)(&receiver);
    while (has_more()) {
        const uint8_t byte = next_byte();
#if defined(__AVR__)
        const uint16_t before = TCNT1;
        uint16_t cycles;

        take_byte(byte);
        cycles = (uint16_t)(TCNT1 - before);
        all += cycles;
        count++;
        most = (cycles > most) ? cycles : most;
#else
        take_byte(byte);
        taken();
#endif
    }
#if defined(__AVR__)
    say(all / count);
    say(most);
#endif
    say(frames);
}
