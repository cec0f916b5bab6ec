#![allow(clippy::unwrap_used, reason = "a panic fails the test")]

use super::*;

/// Receives a line that a text describes: hexadecimal characters, `-` for a bit of pause, or a level (`0` or `1`) with
/// its duration in bits, such as `0*0.45`. A character that `!` precedes has a low stop bit. The sender's clock is
/// faster than the receiver's by `error`, and its first bit begins at `phase`.
fn received(line: &str, error: f64, phase: u64) -> Vec<Heard> {
    let mut uart = Uart::default();
    uart.advance(true, phase);
    let mut bits = 0.0;
    let mut hold = |level: bool, length: f64| {
        bits += length;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "small"
        )]
        let until = phase + (bits * BIT as f64 / (1.0 + error)) as u64;
        uart.advance(level, until);
    };
    for word in line.split(' ') {
        if let Some((level, length)) = word.split_once('*') {
            hold(level == "1", length.parse().unwrap());
        } else if word == "-" {
            hold(true, 1.0);
        } else {
            let byte = u8::from_str_radix(word.trim_start_matches('!'), 16).unwrap();
            hold(false, 1.0);
            (0..8).for_each(|bit| hold(byte >> bit & 1 == 1, 1.0));
            hold(!word.starts_with('!'), 1.0);
        }
    }
    uart.heard.into()
}

/// Returns the bytes, and -1 for each framing error.
fn heard(line: &str, error: f64, phase: u64) -> Vec<i16> {
    let all = received(line, error, phase).into_iter();
    let heard = all.map(|heard| match heard {
        Heard::Byte { byte, .. } => byte.into(),
        Heard::FramingError => -1,
    });
    heard.collect()
}

#[test]
fn every_byte_is_read_as_it_was_sent() {
    let line: Vec<String> = (0..=u8::MAX).map(|byte| format!("{byte:02X}")).collect();
    let sent: Vec<i16> = (0..=u8::MAX).map(i16::from).collect();
    for phase in [0, 1, TICK / 2, TICK - 1] {
        for error in [-0.05, -0.02, 0.0, 0.02, 0.038] {
            assert_eq!(heard(&line.join(" "), error, phase), sent, "{error}");
        }
    }
}

/// A pause follows each byte. The receiver sees the start bit's edge up to one tick late, and two of the three samples
/// of a bit must lie in that bit. A fast sender first violates this condition in its last data bit, if its speed
/// exceeds 144 / 137 of the receiver's, which is 5.1 % too fast. A slow sender first violates the condition in its stop
/// bit, if its speed is below 144 / 152 of the receiver's, which is 5.3 % too slow.
#[test]
fn beyond_five_per_cent_bytes_are_misread() {
    for (error, is_read) in [(-0.06, false), (-0.052, true), (0.05, true), (0.06, false)] {
        let heard = heard("55 - - 00 - - 55 - - 00 - -", error, TICK / 2);
        assert_eq!(heard == [0x55, 0, 0x55, 0], is_read, "{error}");
    }
}

/// The receiver decides the stop bit at the 154th tick of a character, and looks for the next start bit only then. So
/// the receiver falls behind if a sender without pauses exceeds 160 / 154 of the receiver's speed, which is 3.9 % too
/// fast.
#[test]
fn without_a_pause_a_sender_must_not_be_four_per_cent_fast() {
    for (error, is_read) in [(0.038, true), (0.045, false)] {
        let heard = heard(&["0F"; 100].join(" "), error, 0);
        assert_eq!(heard == [0x0F; 100], is_read, "{error}");
    }
}

#[test]
fn noise_and_missing_stop_bits() {
    for (line, expected) in [
        // A spike over one sample of a bit changes nothing; a spike over two samples inverts the bit.
        ("0*1 1*4.4375 0*0.0625 1*4.5", &[0xFF][..]),
        ("0*1 1*4.4375 0*0.125 1*4.4375", &[0xEF]),
        // A start bit that is too short is ignored.
        ("1*3 0*0.45 1*2 41", &[0x41]),
        // A byte without a stop bit is not stored.
        ("!41 - 42", &[-1, 0x42]),
        // A low line is one framing error, however long it stays low. The next byte is read.
        ("- 0*9.8 - 43", &[-1, 0x43]),
        ("- 0*10.2 - 43", &[-1, 0x43]),
        ("- 0*15 - 43", &[-1, 0x43]),
        ("- 0*100 - 43", &[-1, 0x43]),
    ] {
        assert_eq!(heard(line, 0.0, 0), expected, "{line}");
    }
}
