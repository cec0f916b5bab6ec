// A motion platform with three servos. BIN frames on the serial port set the servos' positions. When frames stop, the
// failsafe moves the servos to the middle. The servos' signal wires are at pins 9, 10 and 11.

#include <bin.h>
#include <failsafe.h>

static const uint8_t SERVO_PINS[FAILSAFE_AXES] = {9, 10, 11};

static bin_receiver receiver;
static failsafe platform;
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
    // The clock has 1000 ticks a second, and the output is read every 6 ticks. Park in the middle.
    static const failsafe_parameters parameters = {{128, 128, 128}, FAILSAFE_USUAL(1000, 6)};

    for (uint8_t i = 0; i < FAILSAFE_AXES; i++) {
        pinMode(SERVO_PINS[i], OUTPUT);
    }
    Serial.begin(115200);
    bin_init(&receiver);
    failsafe_init(&platform, &parameters, millis());
}

void loop()
{
    while (Serial.available() > 0) {
        bin_message message;

        if (bin_push(&receiver, (uint8_t)Serial.read(), &message)) {
            const uint8_t demands[FAILSAFE_AXES] = {message.pitch, message.roll, message.yaw};

            failsafe_frame(&platform, demands);
        }
    }
    if (millis() - servo_time >= 6U) {
        uint8_t output[FAILSAFE_AXES];

        servo_time = millis();
        failsafe_poll(&platform, servo_time, output);
        pulse(SERVO_PINS[servo], output[servo]);
        servo = (uint8_t)((servo + 1U) % FAILSAFE_AXES);
    }
}
