#include "crsf.h"
#include "main.h" /* from STM32CubeMX: the headers of the HAL, or of the LL drivers, for your chip */

/* At 420 000 baud, a byte takes 24 microseconds, so the buffer lasts 6 ms. */
#define DMA_SIZE 256U

/* The longest time between two calls of `receive`: half of the time that the buffer lasts. */
#define LATEST_MICROSECONDS 3000U

/* The silence that ends a frame. It is longer than any pause inside a frame, plus the time of a byte. */
#define PAUSE_MICROSECONDS 1000U

/* You write these functions. `microseconds` returns the count of a free-running hardware timer of 32 bits.
 * `set_channels` uses the sixteen channels of 11 bits. */
uint32_t microseconds(void);
void set_channels(const uint8_t *packed);

static volatile uint8_t dma_buffer[DMA_SIZE]; /* the DMA's mode is circular */
static crsf_receiver receiver;
static uint16_t taken; /* the index of the first byte that the receiver has not got */
static uint32_t called; /* the time of the last call of `receive` */
static uint32_t changed; /* the time when the DMA's position was last seen to have changed */

/* After an error, the number of corrupted bytes in front of the DMA's position. */
#if defined(DMA_STOPS_AT_ERROR) && !defined(USE_HAL_DRIVER)
#define CORRUPTED 0U /* you have called LL_USART_EnableDMADeactOnRxErr, so the DMA stops before the corrupted byte */
#else
#define CORRUPTED 1U
#endif

#ifdef USE_HAL_DRIVER
extern UART_HandleTypeDef huart1;

static uint16_t dma_position(void)
{
    return (uint16_t)((DMA_SIZE - __HAL_DMA_GET_COUNTER(huart1.hdmarx)) % DMA_SIZE);
}

/* At an error, the HAL ends the reception and stops the DMA. */
static bool uart_has_error(void)
{
    return huart1.RxState == HAL_UART_STATE_READY;
}

/* Starts the reception. If the DMA has not stopped yet or the HAL is busy, the next call of `receive` tries again. */
static void uart_start(void)
{
    if (huart1.hdmarx->State != HAL_DMA_STATE_READY) {
        return;
    }
#ifdef USART_CR3_DDRE
    __HAL_UART_SEND_REQ(&huart1, UART_RXDATA_FLUSH_REQUEST); /* drops a byte that arrived since the error */
#endif
    if (HAL_UARTEx_ReceiveToIdle_DMA(&huart1, (uint8_t *)dma_buffer, DMA_SIZE) == HAL_OK) {
        taken = 0U;
    }
}
#else
static uint16_t dma_position(void)
{
    return (uint16_t)((DMA_SIZE - LL_DMA_GetDataLength(DMA1, LL_DMA_CHANNEL_5)) % DMA_SIZE);
}

static bool uart_has_error(void)
{
    return (LL_USART_IsActiveFlag_FE(USART1) != 0U) || (LL_USART_IsActiveFlag_NE(USART1) != 0U)
        || (LL_USART_IsActiveFlag_PE(USART1) != 0U) || (LL_USART_IsActiveFlag_ORE(USART1) != 0U);
}

/* Starts the reception, or continues it after an error. The DMA's address, length and channel are already set. */
static void uart_start(void)
{
#ifdef DMA_STOPS_AT_ERROR
    LL_USART_RequestRxDataFlush(USART1); /* drops the corrupted byte */
#endif
    LL_USART_ClearFlag_FE(USART1);
    LL_USART_ClearFlag_NE(USART1);
    LL_USART_ClearFlag_PE(USART1);
    LL_USART_ClearFlag_ORE(USART1);
    LL_USART_EnableIT_ERROR(USART1);
    LL_USART_EnableDMAReq_RX(USART1);
}
#endif

void start(void)
{
    crsf_init(&receiver);
    taken = 0U;
    uart_start();
    called = microseconds();
    changed = called;
}

static void received(void *context, const crsf_message *message)
{
    (void)context;
    /* Some senders append a byte to the channels, and the protocol demands that receivers ignore it. */
    if ((message->type == 0x16U) && (message->payload_length >= 22U)) {
        set_channels(message->payload);
    }
}

/* Call this function from a timer's interrupt every millisecond. */
void receive(void)
{
    const bool has_error = uart_has_error();
    const uint32_t before = microseconds();
    const uint16_t position = dma_position(); /* read once: bytes that arrive from now on wait for the next call */
    const uint32_t after = microseconds();
    uint16_t intact = (uint16_t)((position + DMA_SIZE - taken) % DMA_SIZE);
    crsf_message message;

    if (has_error && (intact > 0U)) {
        intact = (uint16_t)(intact - CORRUPTED);
    }
    if ((after - called) > LATEST_MICROSECONDS) {
        changed = after;
        crsf_line_event(&receiver, CRSF_OVERRUN, received, NULL); /* the DMA may have overwritten bytes */
    } else if (taken != position) {
        changed = after;
        for (; intact > 0U; intact--) {
            if (crsf_push(&receiver, dma_buffer[taken], &message)) {
                received(NULL, &message);
            }
            taken = (uint16_t)((taken + 1U) % DMA_SIZE);
        }
    } else if (((before - changed) >= PAUSE_MICROSECONDS) && (crsf_pending(&receiver) > 0U)) {
        crsf_line_event(&receiver, CRSF_IDLE_LINE, received, NULL);
    }
    taken = position;
    called = before;
    if (has_error) {
        crsf_line_event(&receiver, CRSF_FRAMING_ERROR, received, NULL);
        uart_start();
    }
}

#ifdef USE_HAL_DRIVER
/* The line is idle, or the DMA is at the middle or the end of the buffer. `size` is not needed. */
void HAL_UARTEx_RxEventCallback(UART_HandleTypeDef *huart, uint16_t size)
{
    (void)size;
    if (huart == &huart1) {
        receive();
    }
}

void HAL_UART_ErrorCallback(UART_HandleTypeDef *huart)
{
    if (huart == &huart1) {
        receive();
    }
}

/* Sends a frame. Returns false if no frame has these values, or if the DMA still reads the last frame. */
bool reply(const crsf_message *message)
{
    static uint8_t frame[CRSF_LONGEST]; /* unchanged until the DMA has read it */
    size_t length;

    if (huart1.gState != HAL_UART_STATE_READY) {
        return false;
    }
    length = crsf_encode(message, frame, sizeof frame);
    return (length > 0U) && (HAL_UART_Transmit_DMA(&huart1, frame, (uint16_t)length) == HAL_OK);
}
#else
/* Only the error interrupt is enabled. */
void USART1_IRQHandler(void)
{
    receive();
}
#endif
