/* Lets a proof choose the messages that a header of MAVLink knows. On an AVR, a header reads its tables with the macros
 * of avr/pgmspace.h. The files for MAVLink define `__AVR__`, so they include this file instead. Its macros read, in
 * place of the header's messages, up to four messages that the proof chooses. So the proofs hold for any table of up to
 * four messages. */
#define PROGMEM
#define pgm_read_byte(entry) extra_at(entry)
#define pgm_read_word(entry) number_at(entry)

#define KNOWN 4U
/* In a shorter table the last entries have this number, which is greater than the number of any message. */
#define NO_MESSAGE UINT32_MAX
static struct {
    uint32_t number;
    uint8_t extra;
} known[KNOWN];

static uint8_t extra_at(const uint8_t *entry)
{
    const volatile uint8_t in_header = *entry; /* an access out of bounds is an error */
    const size_t index = __CPROVER_POINTER_OFFSET(entry);

    (void)in_header;
    return (index < KNOWN) ? known[index].extra : (uint8_t)0U;
}

static uint32_t number_at(const uint16_t *entry)
{
    const uint16_t in_header = *entry;
    const size_t index = __CPROVER_POINTER_OFFSET(entry) / sizeof *entry;

    /* The table of a CRC has 16 entries. */
    if (__CPROVER_OBJECT_SIZE(entry) == 16U * sizeof *entry) {
        return in_header;
    }
    return (index < KNOWN) ? known[index].number : NO_MESSAGE;
}

/* Sets an entry of the table. Only harnesses in Rust call this function. */
void c_know(uint8_t place, uint32_t number, uint8_t extra)
{
    known[place].number = number;
    known[place].extra = extra;
}
