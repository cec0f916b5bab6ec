//! Target `faults`: frames as they were sent, what the line did to them, and what must arrive.

use arbitrary::{Arbitrary, Unstructured};
use framelock::lecture::Lecture;
use framelock::motion::{Bin, BinCrc8, Setpoint, crc8};
use framelock::{Encode, FrameBytes, Receiver};
use framelock_proofs::reference;

use crate::outcome::Outcome;
use crate::parser::OfSetpoints;
use crate::rest;

/// The most bytes that a line carries. What would be more is not sent.
const LONGEST: usize = 1024;

/// Frames on a line with faults.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct FaultyLine {
    /// The frames are BIN-CRC8's, else BIN's.
    has_checksum: bool,
    steps: Vec<Step>,
}

/// What happens next. `at` is a place in what the line carries so far, modulo its length.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Step {
    /// A frame is sent, several times without pause.
    Send {
        payload: [u8; 4],
        times: u8,
    },
    Lose {
        at: u16,
    },
    /// Inverts these bits of `length` bytes. Here `at` is not modulo the line's length.
    Invert {
        at: u16,
        bits: u8,
        length: u8,
    },
    /// A byte appears that nobody sent.
    Insert {
        at: u16,
        byte: u8,
    },
    Duplicate {
        at: u16,
    },
    /// The UART notices that the byte is bad: a line event in its place.
    Event {
        at: u16,
    },
}

impl<'a> Arbitrary<'a> for FaultyLine {
    /// The first byte's lowest bit says which format.
    fn arbitrary(u: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        Ok(Self {
            has_checksum: u8::arbitrary(u)? % 2 == 1,
            steps: rest(u),
        })
    }
}

impl<'a> Arbitrary<'a> for Step {
    /// The first byte modulo 8 says what it is; then come the fields, places as two bytes with the
    /// lower first. An eighth of the first byte, plus 1, is how often a frame is sent, or how many
    /// bytes a burst inverts.
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

/// A byte as it is received.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct Received {
    byte: u8,
    /// The number of the frame, the place in it and the byte that was sent; `None` if nobody sent it.
    sent: Option<(usize, usize, u8)>,
    /// A line event comes before it.
    behind_event: bool,
}

impl FaultyLine {
    /// What the receiver gets.
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

/// The byte, or else the one that is there once more.
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

/// * The frames committed are the reference's, for the receiver and the lecture's machine. None holds
///   bytes from both sides of a line event.
/// * A frame that arrives whole is delivered with its last byte; or else there was one commit with
///   an earlier byte of it, a CR of its payload (theorem 7).
/// * The first frame behind a line event, or at the start, is delivered.
/// * What was delivered, sent again, is delivered again.
/// * A BIN-CRC8 frame with one to three wrong bits in payload and checksum is not committed.
///
/// # Panics
/// If the line shows a bug.
pub fn faults(line: &FaultyLine) {
    let received = line.received();
    if line.has_checksum {
        let commits = commits::<Receiver<BinCrc8>, reference::BinCrc8>(&received);
        check::<BinCrc8>(&received, &commits);
    } else {
        commits::<Lecture, reference::Lecture>(&received);
        let commits = commits::<Receiver<Bin>, reference::Bin>(&received);
        check::<Bin>(&received, &commits);
    }
}

/// Commits, with the indices of their last bytes: those of the reference.
fn commits<P, F>(line: &[Received]) -> Vec<(usize, Setpoint)>
where
    P: OfSetpoints,
    F: reference::Format,
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

fn check<F>(line: &[Received], commits: &[(usize, Setpoint)])
where
    F: Encode<Message = Setpoint>,
{
    for &(_, setpoint) in commits {
        let mut again = Vec::new();
        let frame = F::encode(setpoint);
        Receiver::<F>::new().feed(frame.as_ref(), |found| again.extend(found.message()));
        assert_eq!(again, [setpoint], "sent again");
    }

    for (start, frame) in line.windows(F::Frame::LENGTH).enumerate() {
        let Some(wrong) = wrong_bits(frame) else {
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
        } else if F::CHECK.is_some() && all <= 3 && checked == all {
            assert_eq!(delivered, None, "{all} wrong bits at {start}: {frame:02X?}");
        }
    }
}

/// If these are a frame's bytes, each of them and nothing between: in each the number of wrong bits.
fn wrong_bits(frame: &[Received]) -> Option<Vec<u32>> {
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

/// A frame that arrived whole; `before` are the places of it at which there was a commit before its
/// last byte.
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

    /// The corpus is written in this layout.
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

    /// So that what must survive is checked, and not passed over.
    #[test]
    fn a_line_knows_what_became_of_what_was_sent() {
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
            .filter(|frame| wrong_bits(frame).is_some());
        assert_eq!(whole.count(), 2);
    }
}
