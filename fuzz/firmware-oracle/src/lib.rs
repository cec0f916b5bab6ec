//! Target `firmware`: the release images in the emulator, against the reference.
//!
//! As the other targets' functions it knows nothing of the fuzzer. It is a crate of its own since it
//! needs the images: `FRAMELOCK_IMAGES` says in which folder they are, and `cargo xtask fuzz` builds
//! them.

use arbitrary::{Arbitrary, Unstructured};
use framelock_emulator::{Assumptions, LineSymbol, MICROSECOND};
use framelock_firmware_tests::{Firmware, GAP, Setpoint, reference};
use framelock_proofs::reference::{Bin, Format as _, Policy};

/// Silence that the firmware takes for no gap, and silence that it does: 5 ms lie between them.
const LONGEST_PAUSE: u64 = 4_500 * MICROSECOND;
/// How long handlers may be held off without loss.
const HOLD_OFF: u64 = 250 * MICROSECOND;
/// As many symbols as an input may have: a board is emulated for milliseconds, not seconds.
const MOST_SYMBOLS: usize = 512;

/// What happens on the line or to the processor.
#[derive(Clone, PartialEq, Eq, Debug)]
enum Step {
    Bytes(Vec<u8>),
    /// Silence for so many cycles, too short for a gap.
    Pause(u64),
    /// Silence that ends the frame under way.
    Gap,
    /// A byte without stop bit, which is not delivered.
    BadStop(u8),
    /// The line is low for so many bits, more than a byte has.
    Break(u32),
    /// All handlers are held off for so many cycles from now on.
    HoldOff(u64),
}

impl<'a> Arbitrary<'a> for Step {
    /// One byte says what it is, by its remainder of 8, with its eighth for a number. 0 and 1: so
    /// many bytes, which follow. 2: so many frames and one more, with the payload that follows. 3: a
    /// pause, as long as the next byte says. 4: a gap. 5: a bad stop bit, behind the next byte. 6: a
    /// break. 7: handlers are held off for as long as the next byte says.
    fn arbitrary(u: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        let what = u8::arbitrary(u)?;
        let number = usize::from(what >> 3);
        Ok(match what % 8 {
            0 | 1 => Self::Bytes(u.bytes(number.min(u.len()))?.to_vec()),
            2 => {
                let [a, b, c, d]: [u8; 4] = u.arbitrary()?;
                Self::Bytes([b'A', b'B', a, b, c, d, b'\r'].repeat(number + 1))
            }
            3 => Self::Pause(LONGEST_PAUSE * u64::from(u8::arbitrary(u)?) / 255),
            4 => Self::Gap,
            5 => Self::BadStop(u.arbitrary()?),
            6 => Self::Break(11 + u32::from(what >> 3)),
            _ => Self::HoldOff(HOLD_OFF * u64::from(u8::arbitrary(u)?) / 255),
        })
    }
}

/// The first byte of the input says which image, and what is assumed where the product specification
/// leaves it open; the second, how far the sender's baud rate is off, up to two per cent; the others
/// are `Step`s. The bytes delivered are those sent with a stop bit, and what the firmware does with
/// them is:
///
/// * what is put in force are frames that were delivered, in order, none across an error or a gap;
/// * if it has taken every byte, it is all that the reference sees;
/// * without an error on the line it has taken every byte, and no handler is late. (After an error
///   the UARTE is started anew when the line falls silent; what comes just then is not heard.)
/// * every byte is in one place.
///
/// # Panics
/// If one of these does not hold, if the firmware does what no firmware should, or without images.
pub fn firmware(data: &[u8]) {
    let mut u = Unstructured::new(data);
    let [which, skew]: [u8; 2] = u.arbitrary().unwrap_or_default();
    let mut steps = Vec::new();
    while !u.is_empty()
        && let Ok(step) = u.arbitrary()
    {
        steps.push(step);
    }
    let (image, baud, policy) = match which % 3 {
        0 => ("megabaud", 1_000_000_u64, Policy::Rescan),
        1 => ("default", 115_200, Policy::Rescan),
        _ => ("discard", 115_200, Policy::Discard),
    };
    let mut firmware = Firmware::booted(image);
    let is_counted = which & 0x80 != 0;
    firmware.board.assume(Assumptions {
        ready_on_framing_error: is_counted,
        ready_on_overrun: is_counted,
        ..Assumptions::default()
    });
    // 98 to 102 per cent.
    let millibaud = baud * (98_000 + u64::from(skew) * 4_000 / 255) / 100;
    firmware.board.line(|line| line.set_millibaud(millibaud));
    let sent = send(&mut firmware, &steps);
    check(&mut firmware, policy, &sent, &steps);
}

/// What was delivered: the stretches between errors and gaps.
struct Sent {
    stretches: Vec<Vec<u8>>,
    has_errors: bool,
}

fn send(firmware: &mut Firmware, steps: &[Step]) -> Sent {
    let mut sent = Sent {
        stretches: vec![Vec::new()],
        has_errors: false,
    };
    let mut symbols = 0;
    for step in steps {
        // The line is sent ahead of time: what comes next is behind all that was sent.
        match step {
            Step::Bytes(bytes) => {
                firmware.board.send(bytes);
                if let Some(stretch) = sent.stretches.last_mut() {
                    stretch.extend(bytes);
                }
                symbols += bytes.len();
            }
            Step::Pause(cycles) => wait(firmware, *cycles),
            Step::Gap => {
                wait(firmware, GAP);
                sent.stretches.push(Vec::new());
            }
            Step::BadStop(byte) => sent.error(firmware, LineSymbol::BadStop(*byte)),
            Step::Break(bits) => sent.error(firmware, LineSymbol::Break(*bits)),
            Step::HoldOff(cycles) => {
                let now = firmware.board.now();
                firmware.board.hold_off(now, *cycles);
                // The next one no sooner than the handlers have run.
                firmware.run_for(2 * HOLD_OFF);
            }
        }
        symbols += 1;
        if symbols >= MOST_SYMBOLS {
            break;
        }
    }
    wait(firmware, GAP);
    sent
}

impl Sent {
    fn error(&mut self, firmware: &mut Firmware, symbol: LineSymbol) {
        firmware.board.send_symbols(&[symbol]);
        self.has_errors = true;
        self.stretches.push(Vec::new());
    }
}

/// Lets all that was sent arrive, and then so many cycles pass.
fn wait(firmware: &mut Firmware, cycles: u64) {
    firmware.send_and_wait(&[], 0);
    firmware.run_for(cycles);
}

fn check(firmware: &mut Firmware, policy: Policy, sent: &Sent, steps: &[Step]) {
    let commits = firmware.commits();
    let possible: Vec<Setpoint> = sent
        .stretches
        .iter()
        .flat_map(|bytes| frames(bytes))
        .collect();
    let mut rest = possible.iter();
    assert!(
        commits
            .iter()
            .all(|commit| rest.any(|frame| frame == commit)),
        "{commits:02X?} of {possible:02X?}: {steps:02X?}"
    );

    let delivered: usize = sent.stretches.iter().map(Vec::len).sum();
    let nothing_is_lost =
        firmware.losses() == (0, 0) && firmware.counter("bytes") as usize == delivered;
    assert!(nothing_is_lost || sent.has_errors, "{steps:02X?}");
    if nothing_is_lost {
        let streams = sent.stretches.iter();
        let expected: Vec<Setpoint> = streams.flat_map(|bytes| reference(bytes, policy)).collect();
        assert_eq!(commits, expected, "{steps:02X?}");
    }

    let discarded = [
        "no_sync",
        "broken_sync",
        "check",
        "terminator",
        "line_event",
    ];
    let discarded: u32 = discarded.iter().map(|name| firmware.counter(name)).sum();
    let placed = 7 * firmware.counter("frames") + discarded + firmware.counter("pending");
    assert_eq!(firmware.counter("bytes"), placed, "{steps:02X?}");
    assert_eq!(firmware.board.resets(), [], "{steps:02X?}");
}

/// Every frame that lies in those bytes, also where two overlap.
fn frames(bytes: &[u8]) -> impl Iterator<Item = Setpoint> {
    bytes
        .windows(Bin::LENGTH)
        .filter_map(|window| match window {
            &[_, _, _, pitch, roll, yaw, _] if Bin::fails_at(window).is_none() => {
                Some([pitch, roll, yaw])
            }
            _ => None,
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The seeds are written in this layout.
    #[test]
    fn bytes_are_read_as_steps() {
        let mut u = Unstructured::new(b"\x10AB\x0Awxyz\x03\xFF\x04\x05q\x0E\x07\xFF");
        let mut steps = Vec::<Step>::new();
        while !u.is_empty() {
            steps.push(u.arbitrary().expect("enough"));
        }
        assert_eq!(
            steps,
            [
                Step::Bytes(b"AB".to_vec()),
                Step::Bytes(b"ABwxyz\rABwxyz\r".to_vec()),
                Step::Pause(LONGEST_PAUSE),
                Step::Gap,
                Step::BadStop(b'q'),
                Step::Break(12),
                Step::HoldOff(HOLD_OFF),
            ]
        );
    }
}
