// A CRSF receiver. Channel 1 sets the brightness of an LED at pin 9. When frames stop, this LED goes out. The board's
// own LED is on while frames arrive.
//
// Set the radio receiver to 115200 baud. The UART of a board with 16 MHz cannot receive 420000 baud.
//
// Arduino's `Serial` does not show line errors and lost bytes, so this sketch can report only pauses.

#include <crsf.h>

static const uint8_t LED_PIN = 9;
static const uint8_t CHANNELS = 0x16;

// The bytes of sixteen channels. Some senders append a byte, and the protocol demands that receivers ignore it.
static const uint8_t CHANNELS_LENGTH = 22;

static crsf_receiver receiver;
static uint32_t byte_time;
static uint32_t frame_time;

static void received(void *, const crsf_message *message)
{
    if ((message->type != CHANNELS) || (message->payload_length < CHANNELS_LENGTH)) {
        return;
    }
    // Channel 1 is the lowest 11 bits of the payload.
    const uint16_t channel = (uint16_t)(message->payload[0] | ((message->payload[1] & 7U) << 8U));

    frame_time = millis();
    analogWrite(LED_PIN, (int)(channel >> 3U));
}

void setup()
{
    pinMode(LED_PIN, OUTPUT);
    pinMode(LED_BUILTIN, OUTPUT);
    Serial.begin(115200);
    crsf_init(&receiver);
}

void loop()
{
    while (Serial.available() > 0) {
        crsf_message message;

        byte_time = millis();
        if (crsf_push(&receiver, (uint8_t)Serial.read(), &message)) {
            received(NULL, &message);
        }
    }
    // Senders pause between frames. A pause within a frame means that bytes were lost.
    if ((crsf_pending(&receiver) > 0U) && (millis() - byte_time >= 3U)) {
        crsf_line_event(&receiver, CRSF_IDLE_LINE, received, NULL);
    }
    const bool has_signal = (frame_time > 0U) && (millis() - frame_time < 500U);

    digitalWrite(LED_BUILTIN, has_signal ? HIGH : LOW);
    if (!has_signal) {
        analogWrite(LED_PIN, 0);
    }
}
