/* Sets bytes to 0. */
static inline void PREFIX_clear(void *object, size_t size)
{
    uint8_t *byte = (uint8_t *)object;

    while (size > 0U) {
        *byte = 0U;
        byte++;
        size--;
    }
}

/* Copies bytes. */
static inline void PREFIX_copy(void *to, const void *from, size_t size)
{
    uint8_t *byte = (uint8_t *)to;
    const uint8_t *source = (const uint8_t *)from;

    while (size > 0U) {
        *byte = *source;
        byte++;
        source++;
        size--;
    }
}

/* Returns whether `size` bytes are equal. */
static inline bool PREFIX_same(const void *one, const void *other, size_t size)
{
    const uint8_t *byte = (const uint8_t *)one;
    const uint8_t *expected = (const uint8_t *)other;

    while (size > 0U) {
        if (*byte != *expected) {
            return false;
        }
        byte++;
        expected++;
        size--;
    }
    return true;
}

/* Reads a little-endian integer of two bytes. */
static inline uint16_t PREFIX_le16(const uint8_t *bytes)
{
    return (uint16_t)(((unsigned)bytes[1] << 8U) | bytes[0]);
}

/* Reads a big-endian integer of two bytes. */
static inline uint16_t PREFIX_be16(const uint8_t *bytes)
{
    return (uint16_t)(((unsigned)bytes[0] << 8U) | bytes[1]);
}

/* Reads a little-endian integer of three bytes. */
static inline uint32_t PREFIX_le24(const uint8_t *bytes)
{
    return ((uint32_t)bytes[2] << 16U) | ((uint32_t)bytes[1] << 8U) | bytes[0];
}

/* Reads a big-endian integer of three bytes. */
static inline uint32_t PREFIX_be24(const uint8_t *bytes)
{
    return ((uint32_t)bytes[0] << 16U) | ((uint32_t)bytes[1] << 8U) | bytes[2];
}

/* Reads a little-endian integer of four bytes. */
static inline uint32_t PREFIX_le32(const uint8_t *bytes)
{
    return ((uint32_t)bytes[3] << 24U) | ((uint32_t)bytes[2] << 16U) | ((uint32_t)bytes[1] << 8U) | bytes[0];
}

/* Reads a big-endian integer of four bytes. */
static inline uint32_t PREFIX_be32(const uint8_t *bytes)
{
    return ((uint32_t)bytes[0] << 24U) | ((uint32_t)bytes[1] << 16U) | ((uint32_t)bytes[2] << 8U) | bytes[3];
}

/* Reads a little-endian integer of eight bytes. */
static inline uint64_t PREFIX_le64(const uint8_t *bytes)
{
    uint64_t number = 0U;
    uint8_t i;

    for (i = 8U; i > 0U; i--) {
        number = (number << 8U) | bytes[i - 1U];
    }
    return number;
}

/* Reads a big-endian integer of eight bytes. */
static inline uint64_t PREFIX_be64(const uint8_t *bytes)
{
    uint64_t number = 0U;
    uint8_t i;

    for (i = 0U; i < 8U; i++) {
        number = (number << 8U) | bytes[i];
    }
    return number;
}

/* Sign-extends a number of `width` bits. */
static inline int32_t PREFIX_signed(uint32_t number, uint8_t width)
{
    const uint32_t sign = (uint32_t)1U << (width - 1U);

    return (int32_t)((number ^ sign) - sign);
}

/* Sign-extends a number of `width` bits. */
static inline int64_t PREFIX_signed64(uint64_t number, uint8_t width)
{
    const uint64_t sign = (uint64_t)1U << (width - 1U);

    return (int64_t)((number ^ sign) - sign);
}

/* Reads `width` bits, from bit `first` on. Bit 0 is the lowest bit of the first byte. */
static inline uint32_t PREFIX_bits(const uint8_t *bytes, uint16_t first, uint8_t width)
{
    const uint8_t *byte = &bytes[first / 8U];
    uint32_t bits = (uint32_t)*byte >> (first % 8U);
    uint8_t shift;

    for (shift = (uint8_t)(8U - first % 8U); shift < width; shift = (uint8_t)(shift + 8U)) {
        byte++;
        bits |= (uint32_t)*byte << shift;
    }
    return bits & (UINT32_MAX >> (32U - width));
}

/* Reads `width` bits, from bit `first` on. Bit 0 is the lowest bit of the first byte. */
static inline uint64_t PREFIX_bits64(const uint8_t *bytes, uint16_t first, uint8_t width)
{
    const uint8_t *byte = &bytes[first / 8U];
    uint64_t bits = (uint64_t)*byte >> (first % 8U);
    uint8_t shift;

    for (shift = (uint8_t)(8U - first % 8U); shift < width; shift = (uint8_t)(shift + 8U)) {
        byte++;
        bits |= (uint64_t)*byte << shift;
    }
    return bits & (UINT64_MAX >> (64U - width));
}

/* Returns the floating-point number with these bits. */
static inline float PREFIX_float(uint32_t bits)
{
    float number;

    PREFIX_copy(&number, &bits, sizeof number);
    return number;
}

/* Returns the bits of a floating-point number. */
static inline uint32_t PREFIX_bits_of(float number)
{
    uint32_t bits;

    PREFIX_copy(&bits, &number, sizeof bits);
    return bits;
}

/* Writes a little-endian integer of `count` bytes. Bits that are already 1 stay 1. */
static inline void PREFIX_put_le(uint8_t *bytes, uint8_t count, uint32_t number)
{
    uint8_t i;

    for (i = 0U; i < count; i++) {
        bytes[i] = (uint8_t)(bytes[i] | (number & 0xFFU));
        number >>= 8U;
    }
}

/* Writes a big-endian integer of `count` bytes. Bits that are already 1 stay 1. */
static inline void PREFIX_put_be(uint8_t *bytes, uint8_t count, uint32_t number)
{
    uint8_t i;

    for (i = count; i > 0U; i--) {
        bytes[i - 1U] = (uint8_t)(bytes[i - 1U] | (number & 0xFFU));
        number >>= 8U;
    }
}

/* Writes a little-endian integer of `count` bytes. Bits that are already 1 stay 1. */
static inline void PREFIX_put_le64(uint8_t *bytes, uint8_t count, uint64_t number)
{
    uint8_t i;

    for (i = 0U; i < count; i++) {
        bytes[i] = (uint8_t)(bytes[i] | (number & 0xFFU));
        number >>= 8U;
    }
}

/* Writes a big-endian integer of `count` bytes. Bits that are already 1 stay 1. */
static inline void PREFIX_put_be64(uint8_t *bytes, uint8_t count, uint64_t number)
{
    uint8_t i;

    for (i = count; i > 0U; i--) {
        bytes[i - 1U] = (uint8_t)(bytes[i - 1U] | (number & 0xFFU));
        number >>= 8U;
    }
}

/* Writes the lowest `width` bits of a number, from bit `first` on. Bit 0 is the lowest bit of the first byte. Bits that
 * are already 1 stay 1. */
static inline void PREFIX_put_bits(uint8_t *bytes, uint16_t first, uint8_t width, uint32_t number)
{
    uint8_t i;

    for (i = 0U; i < width; i++) {
        const uint16_t place = (uint16_t)(first + i);

        if (((number >> i) & 1U) != 0U) {
            bytes[place / 8U] = (uint8_t)(bytes[place / 8U] | (1U << (place % 8U)));
        }
    }
}

/* Writes the lowest `width` bits of a number, from bit `first` on. Bit 0 is the lowest bit of the first byte. Bits that
 * are already 1 stay 1. */
static inline void PREFIX_put_bits64(uint8_t *bytes, uint16_t first, uint8_t width, uint64_t number)
{
    uint8_t i;

    for (i = 0U; i < width; i++) {
        const uint16_t place = (uint16_t)(first + i);

        if (((number >> i) & 1U) != 0U) {
            bytes[place / 8U] = (uint8_t)(bytes[place / 8U] | (1U << (place % 8U)));
        }
    }
}

/* Writes bytes. Bits that are already 1 stay 1. */
static inline void PREFIX_put(uint8_t *to, const uint8_t *bytes, size_t count)
{
    size_t i;

    for (i = 0U; i < count; i++) {
        to[i] = (uint8_t)(to[i] | bytes[i]);
    }
}

/* Returns the value of a hexadecimal digit, or 16 for any other character. */
static inline uint8_t PREFIX_digit(uint8_t digit)
{
    if ((digit >= 0x30U) && (digit <= 0x39U)) {
        return (uint8_t)(digit - 0x30U);
    }
    digit = (uint8_t)(digit | 0x20U); /* lower case */
    if ((digit >= 0x61U) && (digit <= 0x66U)) {
        return (uint8_t)(digit - 0x57U);
    }
    return 16U;
}

/* Writes a number in hexadecimal digits. */
static inline void PREFIX_put_hex(uint8_t *to, uint32_t number, uint8_t bits)
{
    while (bits > 0U) {
        uint8_t digit;

        bits = (uint8_t)(bits - 4U);
        digit = (uint8_t)((number >> bits) & 0x0FU);
        *to = (uint8_t)((digit < 10U) ? (0x30U + digit) : (0x37U + digit));
        to++;
    }
}
