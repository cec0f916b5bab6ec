#![allow(clippy::unwrap_used, reason = "a panic fails the test")]

use super::*;

/// Receives a line that consists of pieces. Each piece is a level and its duration, in the sender's bits.
fn heard(pieces: &[(bool, f64)], bit: f64, phase: u64) -> Vec<Heard> {
    let mut uart = Uart::default();
    let mut bits = 0.0;
    uart.advance(true, phase);
    for &(level, length) in pieces {
        bits += length;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "small"
        )]
        let until = phase + (bits * bit) as u64;
        uart.advance(level, until);
    }
    uart.heard.into()
}

fn character(byte: u8) -> Vec<(bool, f64)> {
    let mut pieces = vec![(false, 1.0)];
    pieces.extend((0..8).map(|bit| (byte >> bit & 1 == 1, 1.0)));
    pieces.push((true, 1.0));
    pieces
}

#[expect(clippy::cast_precision_loss, reason = "small")]
const ONE: f64 = BIT as f64;

fn bytes(heard: &[Heard]) -> Vec<u8> {
    heard
        .iter()
        .filter_map(|heard| match heard {
            Heard::Byte { byte, .. } => Some(*byte),
            Heard::FramingError => None,
        })
        .collect()
}

#[test]
fn every_byte_is_read_as_it_was_sent() {
    let mut pieces = Vec::new();
    for byte in 0..=u8::MAX {
        pieces.extend(character(byte));
    }
    let sent: Vec<u8> = (0..=u8::MAX).collect();
    for phase in [0, 1, TICK / 2, TICK - 1] {
        for error in [-0.05, -0.02, 0.0, 0.02, 0.038] {
            let all = heard(&pieces, ONE / (1.0 + error), phase);
            assert_eq!(bytes(&all), sent, "{error}");
            assert_eq!(all.len(), 256);
        }
    }
}

/// A pause follows each byte. The receiver sees the start bit's edge up to one tick late, and two of the three samples
/// of a bit must lie in that bit. A fast sender first violates this condition in its last data bit, if its speed
/// exceeds 144 / 137 of the receiver's, which is 5.1 % too fast. A slow sender first violates the condition in its stop
/// bit, if its speed is below 144 / 152 of the receiver's, which is 5.3 % too slow.
#[test]
fn beyond_five_per_cent_bytes_are_misread() {
    let read = |error: f64| {
        let mut pieces = Vec::new();
        for byte in [0x55, 0x00, 0x55, 0x00] {
            pieces.extend(character(byte));
            pieces.push((true, 2.0));
        }
        bytes(&heard(&pieces, ONE / (1.0 + error), TICK / 2))
    };
    for error in [-0.052, 0.05] {
        assert_eq!(read(error), [0x55, 0x00, 0x55, 0x00], "{error}");
    }
    for error in [-0.06, 0.06] {
        assert_ne!(read(error), [0x55, 0x00, 0x55, 0x00], "{error}");
    }
}

/// The receiver decides the stop bit at the 154th tick of a character, and looks for the next start bit only then. So
/// the receiver falls behind if a sender without pauses exceeds 160 / 154 of the receiver's speed, which is 3.9 % too
/// fast.
#[test]
fn without_a_pause_a_sender_must_not_be_four_per_cent_fast() {
    let pieces = character(0x0F).repeat(100);
    assert_eq!(bytes(&heard(&pieces, ONE / 1.038, 0)), [0x0F; 100]);
    assert_ne!(bytes(&heard(&pieces, ONE / 1.045, 0)), [0x0F; 100]);
}

#[test]
fn two_of_three_samples_decide() {
    // A spike over one sample of a bit changes nothing; a spike over two samples inverts the bit.
    let spike = |ticks: f64| {
        let mut pieces = vec![(false, 1.0), (true, 4.0)];
        pieces.extend([(true, 7.0 / 16.0), (false, ticks / 16.0)]);
        pieces.push((true, 5.0 - (7.0 + ticks) / 16.0));
        bytes(&heard(&pieces, ONE, 0))
    };
    assert_eq!(spike(1.0), [0xFF]);
    assert_eq!(spike(2.0), [0xEF]);
}

#[test]
fn a_start_bit_that_is_too_short_is_ignored() {
    let mut pieces = vec![(true, 3.0), (false, 0.45), (true, 2.0)];
    pieces.extend(character(0x41));
    assert_eq!(bytes(&heard(&pieces, ONE, 0)), [0x41]);
}

#[test]
fn a_byte_without_stop_bit_is_not_stored() {
    let mut pieces = character(0x41);
    pieces.last_mut().unwrap().0 = false;
    pieces.push((true, 1.0));
    pieces.extend(character(0x42));
    let all = heard(&pieces, ONE, 0);
    assert!(
        matches!(
            all[..],
            [Heard::FramingError, Heard::Byte { byte: 0x42, .. }]
        ),
        "{all:?}"
    );
}

/// However long the line stays low, that is one framing error, and the next byte is read.
#[test]
fn a_line_that_stays_low_is_one_framing_error() {
    for bits in [9.8, 10.2, 15.0, 100.0] {
        let mut pieces = vec![(true, 1.0), (false, bits), (true, 1.0)];
        pieces.extend(character(0x43));
        let all = heard(&pieces, ONE, 0);
        assert!(
            matches!(
                all[..],
                [Heard::FramingError, Heard::Byte { byte: 0x43, .. }]
            ),
            "{bits}: {all:?}"
        );
    }
}
