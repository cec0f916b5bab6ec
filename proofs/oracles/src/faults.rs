//! Target `faults`: sends frames over a line with known faults, and checks which of them are delivered.

use arbitrary::{Arbitrary, Unstructured};
use framelock::lecture::Lecture;
use framelock::motion::{Bin, BinCrc8, Setpoint, crc8};
use framelock::{Encode, FrameBytes, Receiver};
use framelock_proofs::reference;

use crate::outcome::Outcome;
use crate::parser::OfSetpoints;
use crate::rest;

/// The greatest number of bytes that a line carries. Frames beyond this limit are not sent.
const LONGEST: usize = 1024;

/// Frames on a line with faults.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct FaultyLine {
    /// True for frames of BIN-CRC8, false for frames of BIN.
    has_checksum: bool,
    steps: Vec<Step>,
}

/// One step. `at` is a position among the bytes that are already on the line, modulo the number of these bytes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Step {
    /// Sends a frame several times without pause.
    Send {
        payload: [u8; 4],
        times: u8,
    },
    Lose {
        at: u16,
    },
    /// Inverts these bits in each of `length` bytes. Here `at` is not taken modulo the number of bytes.
    Invert {
        at: u16,
        bits: u8,
        length: u8,
    },
    /// Inserts a byte that nobody sent.
    Insert {
        at: u16,
        byte: u8,
    },
    Duplicate {
        at: u16,
    },
    /// The UART detects a bad byte and reports a line event in its place.
    Event {
        at: u16,
    },
}

impl<'a> Arbitrary<'a> for FaultyLine {
    /// The lowest bit of the first byte determines the format.
    fn arbitrary(u: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        Ok(Self {
            has_checksum: u8::arbitrary(u)? % 2 == 1,
            steps: rest(u),
        })
    }
}

impl<'a> Arbitrary<'a> for Step {
    /// The first byte modulo 8 determines the step. The step's fields follow. Positions have two bytes, little-endian.
    /// The first byte divided by 8, plus 1, is the number of times that a frame is sent, or the number of bytes that a
    /// burst inverts.
    fn arbitrary(u: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        let first = u8::arbitrary(u)?;
        let number = first / 8 + 1;
        if first % 8 < 2 {
            return Ok(Self::Send {
                payload: u.arbitrary()?,
                times: number,
            });
        }
        let at = u.arbitrary()?;
        Ok(match first % 8 {
            2 => Self::Lose { at },
            what @ (3 | 6) => Self::Invert {
                at,
                bits: u.arbitrary()?,
                length: if what == 6 { number } else { 1 },
            },
            4 => Self::Insert {
                at,
                byte: u.arbitrary()?,
            },
            5 => Self::Duplicate { at },
            _ => Self::Event { at },
        })
    }
}

/// A byte that the receiver gets.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct Received {
    byte: u8,
    /// The number of the frame, the byte's index in the frame, and the byte's value when it was sent. `None` if nobody
    /// sent the byte.
    sent: Option<(usize, usize, u8)>,
    /// True if a line event comes before this byte.
    behind_event: bool,
}

impl FaultyLine {
    /// Returns the bytes that the receiver gets.
    fn received(&self) -> Vec<Received> {
        let mut line = Vec::new();
        let mut number = 0;
        for &step in &self.steps {
            match step {
                Step::Send { payload, times } => {
                    let frame = self.frame(payload);
                    for _ in 0..times {
                        if line.len() + frame.len() <= LONGEST {
                            line.extend(frame.iter().enumerate().map(|(place, &byte)| Received {
                                byte,
                                sent: Some((number, place, byte)),
                                behind_event: false,
                            }));
                            number += 1;
                        }
                    }
                }
                Step::Invert { at, bits, length } => {
                    for received in line.iter_mut().skip(at.into()).take(length.into()) {
                        received.byte ^= bits;
                    }
                }
                Step::Lose { at } => lose(&mut line, at, false),
                Step::Event { at } => lose(&mut line, at, true),
                Step::Insert { at, byte } => insert(&mut line, at, Some(byte)),
                Step::Duplicate { at } => insert(&mut line, at, None),
            }
        }
        line
    }

    fn frame(&self, [a, b, c, d]: [u8; 4]) -> Vec<u8> {
        if self.has_checksum {
            vec![b'A', b'B', a, b, c, d, crc8([a, b, c, d]), b'\r']
        } else {
            vec![b'A', b'B', a, b, c, d, b'\r']
        }
    }
}

fn lose(line: &mut Vec<Received>, at: u16, is_event: bool) {
    if let Some(place) = usize::from(at).checked_rem(line.len()) {
        let lost = line.remove(place);
        if let Some(next) = line.get_mut(place) {
            next.behind_event |= lost.behind_event | is_event;
        }
    }
}

/// Inserts the byte, or a copy of the byte at this position if `byte` is `None`.
fn insert(line: &mut Vec<Received>, at: u16, byte: Option<u8>) {
    let place = usize::from(at).checked_rem(line.len()).unwrap_or(0);
    let byte = byte.or(line.get(place).map(|received| received.byte));
    if line.len() < LONGEST
        && let Some(byte) = byte
    {
        let inserted = Received {
            byte,
            ..Received::default()
        };
        line.insert(place, inserted);
    }
}

/// Checks these properties:
///
/// * The receiver and the lecture's machine deliver the same frames as their references. No delivered frame contains
///   bytes from both sides of a line event.
/// * The receiver delivers each frame that arrives intact, with the frame's last byte. The only exception is a frame in
///   which exactly one other delivered frame ended, with a CR after the sync (theorem 7).
/// * The receiver delivers an intact frame that is the first one after a line event or at the start.
/// * If a delivered setpoint is sent again to a new receiver, it is delivered again.
/// * A BIN-CRC8 frame with one to three wrong bits in payload and checksum is not delivered.
///
/// Returns the numbers of three sorts of frames: intact and delivered, intact but with the end of another delivered
/// frame in them, and with one to three wrong bits in payload and checksum.
///
/// # Panics
/// Panics if the line shows a bug.
pub fn faults(line: &FaultyLine) -> [usize; 3] {
    let received = line.received();
    if line.has_checksum {
        let commits = commits::<Receiver<BinCrc8>, reference::BinCrc8>(&received);
        check::<BinCrc8>(&received, &commits)
    } else {
        commits::<Lecture, reference::Lecture>(&received);
        let commits = commits::<Receiver<Bin>, reference::Bin>(&received);
        check::<Bin>(&received, &commits)
    }
}

/// Checks that the machine delivers the same setpoints as the reference. Returns each setpoint with the index of its
/// frame's last byte.
fn commits<P, F>(line: &[Received]) -> Vec<(usize, Setpoint)>
where
    P: OfSetpoints,
    F: reference::NaiveFormat,
{
    let mut parser = P::default();
    let mut commits = Vec::new();
    let mut expected = Vec::new();
    let mut from = 0;
    for stretch in line.chunk_by(|_, next| !next.behind_event) {
        let bytes: Vec<u8> = stretch.iter().map(|received| received.byte).collect();
        parser.reset();
        let mut end = from;
        parser.feed(&bytes, |found| {
            end += found.bytes();
            commits.extend(found.message().map(|setpoint| (end - 1, setpoint)));
        });
        let frames = Outcome::expected::<F>(&bytes).frames();
        expected.extend(
            frames
                .iter()
                .map(|&(index, setpoint)| (from + index, setpoint)),
        );
        from += bytes.len();
    }
    assert_eq!(commits, expected, "{line:02X?}");
    commits
}

fn check<F>(line: &[Received], commits: &[(usize, Setpoint)]) -> [usize; 3]
where
    F: Encode<Message = Setpoint>,
{
    let [mut whole, mut interrupted, mut wrong_bits] = [0; 3];
    for &(_, setpoint) in commits {
        let mut again = Vec::new();
        let frame = F::encode(setpoint);
        Receiver::<F>::new().feed(frame.as_ref(), |found| again.extend(found.message()));
        assert_eq!(again, [setpoint], "sent again");
    }

    for (start, frame) in line.windows(F::Frame::LENGTH).enumerate() {
        let Some(wrong) = wrong_bits_of(frame) else {
            continue;
        };
        let end = start + frame.len() - 1;
        let delivered = commits.iter().find(|&&(index, _)| index == end);
        let all: u32 = wrong.iter().sum();
        let checked: u32 = wrong.iter().skip(2).take(5).sum();
        if all == 0 {
            let within = commits
                .iter()
                .filter(|(index, _)| (start..end).contains(index));
            let before: Vec<usize> = within.map(|(index, _)| index - start).collect();
            let delivered = delivered.map(|&(_, setpoint)| setpoint);
            check_whole(frame, start == 0, &before, delivered);
            *if before.is_empty() {
                &mut whole
            } else {
                &mut interrupted
            } += 1;
        } else if F::CHECK.is_some() && all <= 3 && checked == all {
            assert_eq!(delivered, None, "{all} wrong bits at {start}: {frame:02X?}");
            wrong_bits += 1;
        }
    }
    [whole, interrupted, wrong_bits]
}

/// Returns the number of wrong bits in each byte, if the bytes are all bytes of one frame with
/// nothing between them.
fn wrong_bits_of(frame: &[Received]) -> Option<Vec<u32>> {
    let (number, ..) = frame.first()?.sent?;
    let places = frame.iter().enumerate();
    let wrong = places.map(|(place, received)| match received.sent {
        Some((of, at, sent)) if (of, at) == (number, place) => {
            let is_behind_event = place > 0 && received.behind_event;
            (!is_behind_event).then_some((received.byte ^ sent).count_ones())
        }
        _ => None,
    });
    wrong.collect()
}

/// Checks a frame that arrived intact. Other delivered frames may have ended inside this frame. `before` contains the
/// positions of their last bytes in this frame, except this frame's last position.
fn check_whole(
    frame: &[Received],
    is_at_start: bool,
    before: &[usize],
    delivered: Option<Setpoint>,
) {
    let byte = |place: usize| frame.get(place).map(|received| received.byte);
    match *before {
        [] => {
            let sent = [byte(3), byte(4), byte(5)].map(Option::unwrap_or_default);
            assert_eq!(delivered, Some(sent.into()), "{frame:02X?}");
        }
        [place] => {
            let is_payload = place >= 2 && byte(place) == Some(b'\r');
            assert!(is_payload, "a commit at {place} of {frame:02X?}");
            assert_eq!(delivered, None, "{frame:02X?}");
            let is_first = is_at_start || frame.first().is_some_and(|byte| byte.behind_event);
            assert!(!is_first, "a commit within the first frame: {frame:02X?}");
        }
        _ => panic!("several commits within {frame:02X?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The files of the corpus have this layout.
    #[test]
    fn bytes_are_read_as_steps() {
        let bytes = b"\x01\x10wxyz\x02\x05\x00\x03\x06\x00\x80\x04\x07\x01q\x05\x02\x00\x1E\x01\x00\xFF\x07\x09\x00";
        let line = FaultyLine::arbitrary_take_rest(Unstructured::new(bytes)).expect("enough");
        assert!(line.has_checksum);
        assert_eq!(
            line.steps,
            [
                Step::Send {
                    payload: *b"wxyz",
                    times: 3
                },
                Step::Lose { at: 5 },
                Step::Invert {
                    at: 6,
                    bits: 0x80,
                    length: 1
                },
                Step::Insert {
                    at: 0x107,
                    byte: b'q'
                },
                Step::Duplicate { at: 2 },
                Step::Invert {
                    at: 1,
                    bits: 0xFF,
                    length: 4
                },
                Step::Event { at: 9 },
            ]
        );
    }

    /// Checks that the line records its faults correctly. If the line did not do so, the checks of intact frames could
    /// be skipped unnoticed.
    #[test]
    fn the_line_records_what_happened_to_each_byte() {
        let line = FaultyLine {
            has_checksum: false,
            steps: vec![
                Step::Send {
                    payload: *b"wxyz",
                    times: 3,
                },
                Step::Event { at: 8 },
                Step::Insert { at: 7, byte: 0 },
            ],
        };
        let received = line.received();
        let places: Vec<_> = received
            .iter()
            .map(|received| received.sent.map(|(number, place, _)| (number, place)))
            .collect();
        assert_eq!(
            places.get(6..10),
            Some(&[Some((0, 6)), None, Some((1, 0)), Some((1, 2))][..])
        );
        let behind: Vec<_> = received.iter().map(|r| r.behind_event).collect();
        assert_eq!(behind.iter().position(|&behind| behind), Some(9));
        assert_eq!(received.len(), 21);
        let whole = received
            .windows(7)
            .filter(|frame| wrong_bits_of(frame).is_some());
        assert_eq!(whole.count(), 2);
    }
}
