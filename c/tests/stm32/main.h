/* Stands for the header that STM32CubeMX writes: the parts of the HAL and the LL drivers that the program uses. */
#ifndef MAIN_H
#define MAIN_H

#include <stdint.h>

#ifdef USART_CR3_DDRE
#define DMA_STOPS_AT_ERROR
#endif

/* The simulated hardware. */
uint32_t dma_counter(void);
uint32_t uart_flag(void);
void uart_clear(void);
void uart_flush(void);
void uart_request(void);

#ifdef USE_HAL_DRIVER
typedef enum { HAL_OK, HAL_ERROR, HAL_BUSY, HAL_TIMEOUT } HAL_StatusTypeDef;
typedef enum { HAL_DMA_STATE_READY = 1, HAL_DMA_STATE_BUSY, HAL_DMA_STATE_ABORT = 4 } HAL_DMA_StateTypeDef;
typedef enum { HAL_UART_STATE_READY = 0x20, HAL_UART_STATE_BUSY_TX, HAL_UART_STATE_BUSY_RX } HAL_UART_StateTypeDef;

typedef struct {
    volatile HAL_DMA_StateTypeDef State;
} DMA_HandleTypeDef;

typedef struct {
    DMA_HandleTypeDef *hdmarx;
    volatile HAL_UART_StateTypeDef gState;
    volatile HAL_UART_StateTypeDef RxState;
} UART_HandleTypeDef;

#define __HAL_DMA_GET_COUNTER(handle) dma_counter()
#define __HAL_UART_SEND_REQ(handle, request) uart_flush()
HAL_StatusTypeDef HAL_UARTEx_ReceiveToIdle_DMA(UART_HandleTypeDef *huart, uint8_t *data, uint16_t size);
HAL_StatusTypeDef HAL_UART_Transmit_DMA(UART_HandleTypeDef *huart, const uint8_t *data, uint16_t size);
void HAL_UARTEx_RxEventCallback(UART_HandleTypeDef *huart, uint16_t size);
void HAL_UART_ErrorCallback(UART_HandleTypeDef *huart);
#else
#define LL_DMA_GetDataLength(dma, channel) dma_counter()
#define LL_USART_IsActiveFlag_FE(usart) uart_flag()
#define LL_USART_IsActiveFlag_NE(usart) 0U
#define LL_USART_IsActiveFlag_PE(usart) 0U
#define LL_USART_IsActiveFlag_ORE(usart) 0U
#define LL_USART_ClearFlag_FE(usart) uart_clear()
#define LL_USART_ClearFlag_NE(usart) (void)0
#define LL_USART_ClearFlag_PE(usart) (void)0
#define LL_USART_ClearFlag_ORE(usart) (void)0
#define LL_USART_RequestRxDataFlush(usart) uart_flush()
#define LL_USART_EnableIT_ERROR(usart) (void)0
#define LL_USART_EnableDMAReq_RX(usart) uart_request()
void USART1_IRQHandler(void);
#endif

#endif
