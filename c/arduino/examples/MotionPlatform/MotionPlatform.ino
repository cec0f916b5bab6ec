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

static const uint8_t SERVO_PINS[FAILSAFE_AXES] = {9, 10, 11};

// The silence that ends a frame, in milliseconds. It is longer than the pauses that a USB serial adapter inserts into a
// frame. The sketch notices every pause of 10 ms.
static const uint8_t IDLE_LINE = 5;

static bin_receiver receiver;
static uint32_t byte_time;
static failsafe platform;
static uint8_t output[FAILSAFE_AXES];
static uint8_t servo;
static uint32_t servo_time;

// Each servo gets a pulse of 1 to 2 ms every 18 ms. During a pulse, the serial port stores the arriving bytes.
static void pulse(uint8_t pin, uint8_t position)
{
    digitalWrite(pin, HIGH);
    delayMicroseconds(1000U + (position * 125U) / 32U);
    digitalWrite(pin, LOW);
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
    failsafe_init(&platform, &parameters, millis());
}

void loop()
{
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
            failsafe_poll(&platform, servo_time, output);
        }
        pulse(SERVO_PINS[servo], output[servo]);
        servo = (uint8_t)((servo + 1U) % FAILSAFE_AXES);
    }
}
