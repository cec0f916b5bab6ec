//! Tests that the headers of `MAVLink` know the same messages as the Rust formats, with the same extra byte of the CRC.
//! The program looks up every number of 24 bits, or of 8 bits for `MAVLink` 1. Proofs in `c/proofs` cover the look-up
//! in tables of up to four messages, and the rest of the classification.

use std::fmt::Write as _;

use framelock_formats::mavlink::ARDUPILOTMEGA;

use crate::compilers::GCC;

/// Writes the number and the extra byte of each message that a header knows.
const PROGRAM: &str = r#"
#include <stdio.h>
#include "mavlink.h"
#include "mavlink1.h"
#include "mavlink2.h"

#define MESSAGES(name, upper, numbers) \
    for (number = 0U; number < (numbers); number++) { \
        const uint16_t found = name##_find(number); \
        if (found != upper##_MESSAGES) { \
            printf("%lu %u\n", (unsigned long)number, (unsigned)name##_extra(found)); \
        } \
    }

int main(void)
{
    uint32_t number;

    MESSAGES(mavlink1, MAVLINK1, 0x100U)
    MESSAGES(mavlink_mavlink1, MAVLINK_MAVLINK1, 0x100U)
    MESSAGES(mavlink2, MAVLINK2, 0x1000000U)
    MESSAGES(mavlink_mavlink2, MAVLINK_MAVLINK2, 0x1000000U)
    return 0;
}
"#;

#[test]
fn mavlink_headers_know_the_same_messages() {
    let mut expected = String::new();
    for numbers in [0x100, 0x100, 0x100_0000, 0x100_0000] {
        for message in ARDUPILOTMEGA.iter().filter(|it| it.number < numbers) {
            let extra = message.extra.unwrap();
            writeln!(expected, "{} {extra}", message.number).unwrap();
        }
    }
    let program = GCC.program("messages.c", &[("messages.c", PROGRAM)], &["-O2"]);
    assert!(program.run(&[]) == expected, "the messages differ");
}
