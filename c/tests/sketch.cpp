/* A model of an Arduino board, which runs the sketch at the path SKETCH. Reads the bytes on the serial line from
 * standard input: a gap of 32 bits in microseconds, little-endian, and the byte that follows the gap. A last gap has no
 * byte. Each iteration of the loop takes 20 microseconds. Prints each change of a pin: the time in microseconds, the
 * pin, and the value. */
#include <cstdint>
#include <cstdio>
#include <cstdlib>

static const uint8_t LOW = 0;
static const uint8_t HIGH = 1;
static const uint8_t OUTPUT = 1;
static const uint8_t LED_BUILTIN = 13;

static uint32_t board_time;

/* The serial port. Like Arduino's, it keeps 63 bytes, and drops further bytes without a word. */
static class {
public:
    void begin(uint32_t)
    {
        next();
    }

    int available()
    {
        while (has_byte && (int32_t)(board_time - time) >= 0) {
            if (count < 63) {
                kept[(first + count) % 63] = byte;
                count++;
            }
            next();
        }
        return count;
    }

    int read()
    {
        const uint8_t oldest = kept[first];

        if (available() == 0) {
            abort();
        }
        first = (first + 1) % 63;
        count--;
        return oldest;
    }

    bool is_over() const
    {
        return !has_byte && (int32_t)(board_time - time) >= 0;
    }

private:
    /* Reads the next gap and byte. */
    void next()
    {
        uint8_t gap[4] = {};

        if (fread(gap, 1, 4, stdin) != 4) {
            abort();
        }
        time += gap[0] + ((uint32_t)gap[1] << 8U) + ((uint32_t)gap[2] << 16U) + ((uint32_t)gap[3] << 24U);
        has_byte = fread(&byte, 1, 1, stdin) == 1;
    }

    uint8_t kept[63] = {};
    int first = 0;
    int count = 0;
    uint32_t time = 0; /* the time of the next byte, or of the end */
    bool has_byte = false;
    uint8_t byte = 0;
} Serial;

static uint32_t millis()
{
    return board_time / 1000U;
}

static void delayMicroseconds(uint32_t time)
{
    board_time += time;
}

static void pinMode(uint8_t, uint8_t)
{
}

static void analogWrite(uint8_t pin, int value)
{
    static int values[14];

    if (values[pin] != value) {
        values[pin] = value;
        printf("%lu %d %d\n", (unsigned long)board_time, pin, value);
    }
}

static void digitalWrite(uint8_t pin, uint8_t value)
{
    analogWrite(pin, value);
}

/* A sketch need not use all functions. */
void use_all();
void use_all()
{
    delayMicroseconds(0);
    digitalWrite(0, LOW);
    pinMode(0, OUTPUT);
    analogWrite(LED_BUILTIN, HIGH);
}

#include SKETCH

int main()
{
    setup();
    while (!Serial.is_over()) {
        loop();
        board_time += 20U;
    }
    return 0;
}
