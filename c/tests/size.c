/* Calls `init` and `push` of a receiver, so that a test can measure their code. COMPLETE adds `pending`, `line_event`
 * and, if the receiver has it, `poll`. ENCODE adds `encode`. The receiver and the message are only declared here,
 * because the test compiles this file without linking it. `receiver_size` states the size of a receiver. */
#include "receiver.h"

extern F(receiver) receiver;
extern F(message) message;
void start(void);
bool take(uint8_t byte);

void start(void)
{
    F(init)(&receiver);
}

bool take(uint8_t byte)
{
    return F(push)(&receiver, byte, &message);
}

#if defined(COMPLETE)
uint32_t pending(void);
void event(F(event) which);

uint32_t pending(void)
{
    return F(pending)(&receiver);
}

#if IS_WINDOW
void event(F(event) which)
{
    F(line_event)(&receiver, which);
}
#else
void received(void *context, const F(message) *values);

void event(F(event) which)
{
    F(line_event)(&receiver, which, received, NULL);
}

#if !IS_PACKETS
bool poll(void);

bool poll(void)
{
    return F(poll)(&receiver, &message);
}
#endif
#endif
#endif

#if defined(ENCODE)
size_t encode(uint8_t *frame, size_t room);

size_t encode(uint8_t *frame, size_t room)
{
    return F(encode)(&message, frame, room);
}
#endif

/* An array as large as the receiver, in a section of its own. The test reads this section's size. */
__attribute__((section(".size"))) const uint8_t receiver_size[sizeof(F(receiver))] = {0U};
