/* A number of so many bytes, the lowest first. */
static inline uint64_t PREFIX_le(const uint8_t *frame, size_t at, size_t count)
{
    uint64_t number = 0;
    while (count > 0) {
        count--;
        number = number << 8 | frame[at + count];
    }
    return number;
}

/* A number of so many bytes, the highest first. */
static inline uint64_t PREFIX_be(const uint8_t *frame, size_t at, size_t count)
{
    uint64_t number = 0;
    for (size_t i = 0; i < count; i++) {
        number = number << 8 | frame[at + i];
    }
    return number;
}

/* A number of so many bits that has a sign. */
static inline int64_t PREFIX_signed(uint64_t number, unsigned width)
{
    const uint64_t sign = (uint64_t)1 << (width - 1);
    return (int64_t)((number ^ sign) - sign);
}

/* So many bits, the first being this one, counted from the lowest of the first byte. */
static inline uint64_t PREFIX_bits(const uint8_t *frame, size_t first, size_t width)
{
    uint64_t bits = (uint64_t)frame[first / 8] >> first % 8;
    for (size_t place = 8 - first % 8; place < width; place += 8) {
        bits |= (uint64_t)frame[(first + place) / 8] << place;
    }
    return bits & UINT64_MAX >> (64 - width);
}

/* A number with a point, from its bits. */
static inline float PREFIX_float(uint64_t bits)
{
    const uint32_t all = (uint32_t)bits;
    float number;
    memcpy(&number, &all, sizeof number);
    return number;
}

/* The bits of a number with a point. */
static inline uint64_t PREFIX_bits_of(float number)
{
    uint32_t bits;
    memcpy(&bits, &number, sizeof bits);
    return bits;
}

/* Writes a number of so many bytes, the lowest first, where zeros are. */
static inline void PREFIX_put_le(uint8_t *frame, size_t at, size_t count, uint64_t number)
{
    for (size_t i = 0; i < count; i++) {
        frame[at + i] |= (uint8_t)(number >> 8 * i);
    }
}

/* Writes a number of so many bytes, the highest first, where zeros are. */
static inline void PREFIX_put_be(uint8_t *frame, size_t at, size_t count, uint64_t number)
{
    for (size_t i = 0; i < count; i++) {
        frame[at + i] |= (uint8_t)(number >> 8 * (count - 1 - i));
    }
}

/* Writes so many bits, where zeros are. */
static inline void PREFIX_put_bits(uint8_t *frame, size_t first, size_t width, uint64_t bits)
{
    for (size_t i = 0; i < width; i++) {
        frame[(first + i) / 8] |= (uint8_t)((bits >> i & 1) << (first + i) % 8);
    }
}

/* Writes bytes, where zeros are. */
static inline void PREFIX_put(uint8_t *frame, size_t at, const uint8_t *bytes, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        frame[at + i] |= bytes[i];
    }
}
