/* Runs an ELF file on simavr's ATmega328P, the chip of an Arduino Uno. Reads lines from standard input. Each line has
 * two numbers: a gap in microseconds, and the event after the gap, which is a byte on the serial line, RESET or END.
 * Prints each change of pins 9 to 13: the time in microseconds, the pin and the value. The value of pin 9 is the
 * brightness if the pin is a PWM output. */
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <stdio.h>
#include <string.h>

enum { RESET = 256, END = 257 };
enum { PORTB = 0x25, TCCR1A = 0x80, OCR1AL = 0x88, COM1A1 = 0x80 };
enum { CYCLES_PER_MICROSECOND = 16, FIRST_PIN = 8, FROM = 1, TO = 6 };

static void show_changes(const avr_t *avr)
{
    static int values[TO];

    for (int bit = FROM; bit < TO; bit++) {
        const int is_pwm = bit == 1 && (avr->data[TCCR1A] & COM1A1) != 0;
        const int value = is_pwm ? avr->data[OCR1AL] : (avr->data[PORTB] >> bit) & 1;

        if (value != values[bit]) {
            values[bit] = value;
            printf("%lu %d %d\n", (unsigned long)(avr->cycle / CYCLES_PER_MICROSECOND), FIRST_PIN + bit, value);
        }
    }
}

int main(int count, char **arguments)
{
    elf_firmware_t firmware = {0};
    avr_t *avr = avr_make_mcu_by_name("atmega328p");
    unsigned long gap;
    uint64_t time = 0;
    int event;
    uint32_t flags = 0;

    if (count != 2 || avr == NULL || elf_read_firmware(arguments[1], &firmware) != 0) {
        return 1;
    }
    avr_init(avr);
    firmware.frequency = CYCLES_PER_MICROSECOND * 1000000;
    avr_load_firmware(avr, &firmware);
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    while (scanf("%lu %d", &gap, &event) == 2) {
        time += gap * CYCLES_PER_MICROSECOND;
        while (avr->cycle < time) {
            const int state = avr_run(avr);

            if (state == cpu_Done || state == cpu_Crashed) {
                return 2;
            }
            show_changes(avr);
        }
        if (event == END) {
            return 0;
        }
        if (event == RESET) {
            avr_reset(avr);
            show_changes(avr);
        } else {
            avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT), (uint32_t)event);
        }
    }
    return 3;
}
