#include "../headers/modbus_rtu.h"
#define NAME modbus_rtu
#define UPPER MODBUS_RTU
#define MOST 8U
#define TURNS 10
#define SPACE 7U
#define ENCODE_TURNS 10
#define IS_SILENT
#define RUST_REASONS \
    {NONE, NONE, NONE, MODBUS_RTU_TOO_LONG, NONE, MODBUS_RTU_CHECKSUM_MISMATCH, NONE, MODBUS_RTU_LINE_EVENT}
#define POINT POINT_TO(data)
#include "buffered.h"
