/* Simulates a UART and its DMA, byte by byte, for c/examples/stm32_dma.c. Reads steps of two bytes from standard input.
 * Prints channels, pauses, overruns and wrong checksums. With USART_CR3_DDRE, the chip stops the DMA at an error. */
#include <stdio.h>
#include <stdlib.h>

#include "../examples/stm32_dma.c"

#define BYTE_MICROSECONDS 24U

static uint32_t now = 0xFFFFFF00U; /* the clock soon wraps */
static uint32_t position;
static bool is_running; /* whether the UART requests transfers of the DMA */
static bool has_flag; /* the UART's error flag */
static int in_uart = -1; /* the byte that the DMA has not fetched */
static unsigned steps; /* the number of steps that happen during the next call of `receive` */
static unsigned accesses; /* the number of accesses to the hardware before these steps */

static void fetch(void)
{
#ifdef USART_CR3_DDRE
    const bool is_masked = has_flag;
#else
    const bool is_masked = false;
#endif

    if (is_running && !is_masked && (in_uart >= 0)) {
        dma_buffer[position] = (uint8_t)in_uart;
        position = (position + 1U) % DMA_SIZE;
        in_uart = -1;
    }
}

/* Takes a step in which time passes: a byte, a corrupted byte, or silence for `number` byte times. */
static void pass(int kind, uint8_t number)
{
    if (kind == 's') {
        now += number * BYTE_MICROSECONDS;
        return;
    }
    now += BYTE_MICROSECONDS;
    has_flag = has_flag || (kind == 'c');
    if (in_uart < 0) {
        in_uart = number;
    }
    fetch();
}

/* Takes the steps that happen after this access to the hardware. */
static void preempt(void)
{
    accesses--;
    for (; (accesses == 0U) && (steps > 0U); steps--) {
        const int kind = getchar();

        pass(kind, (uint8_t)getchar());
    }
}

uint32_t microseconds(void)
{
    const uint32_t time = now;

    preempt();
    return time;
}

/* Returns the number of transfers until the end of the buffer. At the beginning of the buffer, alternately
 * returns DMA_SIZE and 0, because the program must accept both. */
uint32_t dma_counter(void)
{
    static bool is_zero;
    const uint32_t count = DMA_SIZE - position;

    is_zero = !is_zero;
    preempt();
    return is_zero ? (count % DMA_SIZE) : count;
}

uint32_t uart_flag(void)
{
    return has_flag ? 1U : 0U;
}

void uart_clear(void)
{
    has_flag = false;
    fetch();
}

void uart_flush(void)
{
    in_uart = -1;
}

void uart_request(void)
{
    is_running = true;
}

void set_channels(const uint8_t *packed)
{
    uint32_t i;

    for (i = 0U; i < 22U; i++) {
        printf("%02X", packed[i]);
    }
    printf("\n");
}

#ifdef USE_HAL_DRIVER
static DMA_HandleTypeDef dma = {HAL_DMA_STATE_READY};
UART_HandleTypeDef huart1 = {&dma, HAL_UART_STATE_READY, HAL_UART_STATE_READY};
static bool is_locked;
static const uint8_t *sent;

HAL_StatusTypeDef HAL_UARTEx_ReceiveToIdle_DMA(UART_HandleTypeDef *huart, uint8_t *data, uint16_t size)
{
    if ((dma.State == HAL_DMA_STATE_ABORT) || (data != (uint8_t *)dma_buffer) || (size != DMA_SIZE)) {
        abort();
    }
    if (is_locked) {
        is_locked = false;
        return HAL_BUSY;
    }
#ifndef USART_CR3_DDRE
    in_uart = -1;
#endif
    huart->RxState = HAL_UART_STATE_BUSY_RX;
    dma.State = HAL_DMA_STATE_BUSY;
    position = 0U;
    is_running = true;
    uart_clear();
    return HAL_OK;
}

HAL_StatusTypeDef HAL_UART_Transmit_DMA(UART_HandleTypeDef *huart, const uint8_t *data, uint16_t size)
{
    (void)size;
    huart->gState = HAL_UART_STATE_BUSY_TX;
    sent = data;
    return HAL_OK;
}

/* The HAL clears the flags before it stops the DMA, so the DMA fetches the corrupted byte. On some chips, the DMA stops
 * a while later, and a timer's interrupt may come before it has stopped. */
static void error_interrupt(void)
{
    if (is_running) {
        uart_clear();
        is_running = false;
        huart1.RxState = HAL_UART_STATE_READY;
        dma.State = HAL_DMA_STATE_ABORT;
        receive();
        dma.State = HAL_DMA_STATE_READY;
        HAL_UART_ErrorCallback(&huart1);
    }
}

/* Sends two replies. `reply` must refuse the second one until the first has been sent. */
static void check_reply(void)
{
    static const uint8_t payload[2] = {1, 2};
    const crsf_message message = {0xC8U, 0x14U, payload, 2U};
    const crsf_message other = {0xC8U, 0x15U, payload, 2U};
    const bool has_begun = reply(&message);
    const bool has_waited = !reply(&other) && (sent[2] == 0x14U);

    huart1.gState = HAL_UART_STATE_READY;
    if (!has_begun || !has_waited || !reply(&other) || (sent[2] != 0x15U)) {
        abort();
    }
}
#endif

int main(void)
{
    int kind;

#ifdef USE_HAL_DRIVER
    check_reply();
#endif
    while ((kind = getchar()) != EOF) {
        const uint8_t number = (uint8_t)getchar();
        const crsf_counters before = receiver.counters;

        switch (kind) {
        case 'n': /* a new stream */
            position = 0U;
            has_flag = false;
#ifdef USE_HAL_DRIVER
            huart1.RxState = HAL_UART_STATE_READY;
            dma.State = HAL_DMA_STATE_READY;
#endif
            start();
            printf("start\n");
            continue;
        case 'p': /* `steps` and `accesses`: the next step is a call, and the steps after it happen during this call */
            steps = number / 4U;
            accesses = number % 4U;
            break;
        case 't': /* the timer's interrupt */
            receive();
            break;
#ifdef USE_HAL_DRIVER
        case 'l':
            is_locked = true;
            break;
        case 'i': /* the interrupt for an idle line, or for the middle or the end of the buffer */
            HAL_UARTEx_RxEventCallback(&huart1, DMA_SIZE);
            break;
#else
        case 'l': /* the HAL is locked at the next call */
            break;
        case 'i':
            receive();
            break;
#endif
        case 'e':
            if (has_flag) {
#ifdef USE_HAL_DRIVER
                error_interrupt();
#else
                USART1_IRQHandler();
#endif
            }
            break;
        default:
            pass(kind, number);
            break;
        }
        if (receiver.counters.events[CRSF_IDLE_LINE] != before.events[CRSF_IDLE_LINE]) {
            printf("pause %lu\n", (unsigned long)receiver.counters.bytes);
        }
        if (receiver.counters.events[CRSF_OVERRUN] != before.events[CRSF_OVERRUN]) {
            printf("overrun\n");
        }
        if (receiver.counters.discarded[CRSF_CHECKSUM_MISMATCH] != before.discarded[CRSF_CHECKSUM_MISMATCH]) {
            printf("mismatch\n");
        }
    }
    return 0;
}
