// A motion platform with three servos. BIN frames on the serial port set the servos' positions. When frames stop, the
// failsafe moves the servos to the middle. The servos' signal wires are at pins 9, 10 and 11.
//
// This is no safety function: the platform needs a switch that cuts the servos' power.
//
// BIN has no checksum. After a lost byte, the receiver may take the end of a frame and the beginning of the next one
// for a frame, again and again until a pause. So this sketch reports pauses. It cannot report line errors and lost
// bytes, because Arduino's `Serial` does not show them.

#include <bin.h>
#include <failsafe.h>

// Some resets keep the RAM: the reset at the opening of the port, the reset button and the watchdog. `last` then still
// has the last output, so the servos stay there and do not jump to the middle. Each byte of `inverse` is the inverse of
// a byte of the output. After power-on, the RAM has random bytes, which do not match.
#if defined(MCUSR)
#include <avr/wdt.h>
#define KEPT __attribute__((section(".noinit")))
#else
#define KEPT
#endif
static struct {
    uint8_t output[FAILSAFE_AXES];
    uint8_t inverse[FAILSAFE_AXES];
} last KEPT;

// If the loop hangs for 250 ms, the watchdog resets the chip. The watchdog continues after the reset, with its shortest
// time. So the start-up code disables the watchdog, and `setup` enables it again. Boards without AVR have no watchdog
// here.
#if defined(MCUSR)
void disable_watchdog(void) __attribute__((naked, used, section(".init3")));
void disable_watchdog(void)
{
    MCUSR = 0;
    wdt_disable();
}
#define WATCHDOG_START() wdt_enable(WDTO_250MS)
#define WATCHDOG_FEED() wdt_reset()
#else
#define WATCHDOG_START()
#define WATCHDOG_FEED()
#endif

static const uint8_t SERVO_PINS[FAILSAFE_AXES] = {9, 10, 11};

// The silence that ends a frame, in milliseconds. It is longer than the pauses that a USB serial adapter inserts into a
// frame. The sketch notices every pause of 10 ms.
static const uint8_t IDLE_LINE = 5;

static bin_receiver receiver;
static uint32_t byte_time;
static failsafe platform;
static uint8_t servo;
static uint32_t servo_time;

// Each servo gets a pulse of 1 to 2 ms every 18 ms. During a pulse, the serial port stores the arriving bytes. Its
// interrupts would make a pulse of `delayMicroseconds` longer, so read the clock.
static void pulse(uint8_t pin, uint8_t position)
{
    const uint16_t width = 1000U + (position * 125U) / 32U;
    const uint32_t start = micros();

    digitalWrite(pin, HIGH);
    while (micros() - start < width) {
    }
    digitalWrite(pin, LOW);
}

static bool last_is_known(void)
{
    for (uint8_t i = 0; i < FAILSAFE_AXES; i++) {
        if (last.inverse[i] != (uint8_t)~last.output[i]) {
            return false;
        }
    }
    return true;
}

void setup()
{
    // The clock has 1000 ticks a second, and the output is read every 18 ticks. Park in the middle.
    static const failsafe_parameters parameters = {{128, 128, 128}, FAILSAFE_USUAL(1000, 18)};

    for (uint8_t i = 0; i < FAILSAFE_AXES; i++) {
        pinMode(SERVO_PINS[i], OUTPUT);
    }
    Serial.begin(115200);
    bin_init(&receiver);
    if (last_is_known()) {
        failsafe_resume(&platform, &parameters, millis(), last.output);
    } else {
        failsafe_init(&platform, &parameters, millis());
    }
    WATCHDOG_START();
}

void loop()
{
    WATCHDOG_FEED();
    // Report a pause only if no byte waits, because bytes wait during a pulse.
    if ((Serial.available() == 0) && (bin_pending(&receiver) > 0U) && (millis() - byte_time >= IDLE_LINE)) {
        bin_line_event(&receiver, BIN_IDLE_LINE);
    }
    while (Serial.available() > 0) {
        bin_message message;

        byte_time = millis();
        if (bin_push(&receiver, (uint8_t)Serial.read(), &message)) {
            const uint8_t demands[FAILSAFE_AXES] = {message.pitch, message.roll, message.yaw};

            failsafe_frame(&platform, demands);
        }
    }
    if (millis() - servo_time >= 6U) {
        servo_time = millis();
        if (servo == 0U) {
            failsafe_poll(&platform, servo_time, last.output);
            for (uint8_t i = 0; i < FAILSAFE_AXES; i++) {
                last.inverse[i] = (uint8_t)~last.output[i];
            }
        }
        pulse(SERVO_PINS[servo], last.output[servo]);
        servo = (uint8_t)((servo + 1U) % FAILSAFE_AXES);
    }
}
