//! Target `faults`: frames as they were sent, what the line did to them, and what must survive.

use arbitrary::{Arbitrary, Unstructured};
use framelock::{Bin, BinCrc8, Format, Lecture, Parser, Receiver, Rescan, Setpoint, crc8};
use framelock_proofs::reference::{self, Policy};

use crate::expected::Expected;

/// As many bytes as an input's stream may have.
const LONGEST: usize = 1024;

/// A byte as it was received.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Received {
    byte: u8,
    /// Of which frame sent, at which place of it; `None` if nobody sent it.
    sent: Option<(usize, usize)>,
    /// The bits that differ from what was sent.
    wrong: u8,
    /// A line event was reported in front of it.
    behind_event: bool,
}

/// What is received of the frames sent, so far.
#[derive(Default)]
struct Line {
    has_checksum: bool,
    payloads: Vec<[u8; 4]>,
    received: Vec<Received>,
}

/// What happens next. Places are counted from the stream's beginning, modulo its length.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Step {
    /// A frame is sent so often, without pause.
    Send {
        payload: [u8; 4],
        times: u8,
    },
    Lose {
        at: u16,
    },
    /// Inverts the bits set in `wrong`.
    Substitute {
        at: u16,
        wrong: u8,
    },
    Insert {
        at: u16,
        byte: u8,
    },
    Duplicate {
        at: u16,
    },
    /// As [`Step::Substitute`], for so many bytes that follow each other.
    Burst {
        at: u16,
        wrong: u8,
        length: u8,
    },
    /// The byte was bad, which the UART noticed: it is not taken, and reported.
    Event {
        at: u16,
    },
}

impl<'a> Arbitrary<'a> for Step {
    /// One byte says what it is, by its remainder of 8, and then come the fields, places as two
    /// bytes with the lower first. An eighth of the first byte is how often a frame is sent beyond
    /// once, or a burst's length less one.
    fn arbitrary(u: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        let what = u8::arbitrary(u)?;
        let number = (what >> 3) + 1;
        Ok(match what % 8 {
            0 | 1 => Self::Send {
                payload: u.arbitrary()?,
                times: number,
            },
            2 => Self::Lose { at: u.arbitrary()? },
            3 => Self::Substitute {
                at: u.arbitrary()?,
                wrong: u.arbitrary()?,
            },
            4 => Self::Insert {
                at: u.arbitrary()?,
                byte: u.arbitrary()?,
            },
            5 => Self::Duplicate { at: u.arbitrary()? },
            6 => Self::Burst {
                at: u.arbitrary()?,
                wrong: u.arbitrary()?,
                length: number,
            },
            _ => Self::Event { at: u.arbitrary()? },
        })
    }
}

impl Line {
    fn frame(&self, [a, b, c, d]: [u8; 4]) -> Vec<u8> {
        if self.has_checksum {
            vec![b'A', b'B', a, b, c, d, crc8([a, b, c, d]), b'\r']
        } else {
            vec![b'A', b'B', a, b, c, d, b'\r']
        }
    }

    /// The index of that place.
    fn place(&self, at: u16) -> Option<usize> {
        usize::from(at).checked_rem(self.received.len())
    }

    fn step(&mut self, step: Step) {
        match step {
            Step::Send { payload, times } => {
                let frame = self.frame(payload);
                for _ in 0..times {
                    if self.received.len() + frame.len() > LONGEST {
                        return;
                    }
                    let number = self.payloads.len();
                    self.payloads.push(payload);
                    let bytes = frame.iter().enumerate();
                    self.received.extend(bytes.map(|(place, &byte)| Received {
                        byte,
                        sent: Some((number, place)),
                        wrong: 0,
                        behind_event: false,
                    }));
                }
            }
            Step::Lose { at } => {
                self.lose(at);
            }
            Step::Substitute { at, wrong } => self.spoil(at, wrong, 1),
            Step::Burst { at, wrong, length } => self.spoil(at, wrong, length),
            Step::Insert { at, byte } => self.insert(self.place(at).unwrap_or(0), byte),
            Step::Duplicate { at } => {
                if let Some(place) = self.place(at)
                    && let Some(received) = self.received.get(place)
                {
                    self.insert(place, received.byte);
                }
            }
            Step::Event { at } => {
                if let Some(place) = self.lose(at)
                    && let Some(next) = self.received.get_mut(place)
                {
                    next.behind_event = true;
                }
            }
        }
    }

    fn lose(&mut self, at: u16) -> Option<usize> {
        let place = self.place(at)?;
        let lost = self.received.remove(place);
        // What was reported in front of it is in front of the next.
        if let Some(next) = self.received.get_mut(place) {
            next.behind_event |= lost.behind_event;
        }
        Some(place)
    }

    fn spoil(&mut self, at: u16, wrong: u8, length: u8) {
        let hit = self.received.iter_mut().skip(at.into());
        for received in hit.take(length.into()) {
            received.byte ^= wrong;
            received.wrong ^= wrong;
        }
    }

    fn insert(&mut self, place: usize, byte: u8) {
        if self.received.len() < LONGEST {
            self.received.insert(
                place,
                Received {
                    byte,
                    sent: None,
                    wrong: 0,
                    behind_event: false,
                },
            );
        }
    }
}

/// The first byte of the input says which format, the others are `Step`s.
///
/// * The frames committed are the reference's, for the receiver and the lecture's machine: nothing
///   appears that was not on the line.
/// * A frame that arrives whole is delivered with its last byte; or else there was one commit with
///   an earlier byte of it, a CR of its payload (the theorem of resynchronisation).
/// * The first frame behind a line event, or at the start, is delivered.
/// * No committed frame holds bytes from both sides of a line event.
/// * What was delivered, sent again, is delivered again.
/// * A BIN-CRC8 frame with one to three wrong bits in payload and checksum is not committed.
///
/// # Panics
/// If one of these does not hold.
pub fn faults(data: &[u8]) {
    let mut u = Unstructured::new(data);
    let which: u8 = u.arbitrary().unwrap_or_default();
    let mut line = Line {
        has_checksum: which % 2 == 1,
        ..Line::default()
    };
    let mut steps = Vec::new();
    while !u.is_empty()
        && let Ok(step) = u.arbitrary()
    {
        line.step(step);
        steps.push(step);
    }
    if line.has_checksum {
        check::<BinCrc8, reference::BinCrc8>(&line, &steps);
    } else {
        check::<Bin, reference::Bin>(&line, &steps);
        let commits = receive(Lecture::new(), &line);
        let expected = expected::<reference::Bin>(&line, Policy::Discard);
        assert_eq!(commits, expected, "the lecture's machine: {steps:02X?}");
    }
}

/// Commits, with the indices of their last bytes. A parser is reset by a line event.
fn receive<P: Parser>(mut parser: P, line: &Line) -> Vec<(usize, P::Message)> {
    let mut commits = Vec::new();
    for (index, received) in line.received.iter().enumerate() {
        if received.behind_event {
            parser.reset();
        }
        commits.extend(parser.push(received.byte).map(|message| (index, message)));
    }
    commits
}

/// The reference's: each stretch between line events is a stream of its own, so no frame reaches
/// across one.
fn expected<F: reference::Format>(line: &Line, policy: Policy) -> Vec<(usize, Setpoint)> {
    let mut commits = Vec::new();
    let mut from = 0;
    for stretch in line.received.chunk_by(|_, next| !next.behind_event) {
        let bytes: Vec<u8> = stretch.iter().map(|received| received.byte).collect();
        let frames = Expected::of::<F>(&bytes, policy).frames;
        commits.extend(
            frames
                .iter()
                .map(|&(index, setpoint)| (from + index, setpoint)),
        );
        from += bytes.len();
    }
    commits
}

fn check<F, R>(line: &Line, steps: &[Step])
where
    F: Format<Message = Setpoint>,
    R: reference::Format,
{
    let commits = receive(Receiver::<F, Rescan>::new(), line);
    let seen = expected::<R>(line, Policy::Rescan);
    assert_eq!(commits, seen, "{steps:02X?}");
    for &(_, setpoint) in &commits {
        let sent_again = F::encode(setpoint);
        let mut receiver = Receiver::<F, Rescan>::new();
        let commits = sent_again.as_ref().iter().map(|&byte| receiver.push(byte));
        assert_eq!(commits.last(), Some(Some(setpoint)), "{steps:02X?}");
    }

    for (start, window) in line.received.windows(R::LENGTH).enumerate() {
        let Some((number, 0)) = window.first().and_then(|first| first.sent) else {
            continue;
        };
        let is_together = window.iter().enumerate().all(|(place, received)| {
            received.sent == Some((number, place)) && (place == 0 || !received.behind_event)
        });
        if !is_together {
            continue;
        }
        let end = start + R::LENGTH - 1;
        let within: Vec<usize> = commits
            .iter()
            .map(|&(index, _)| index)
            .filter(|index| (start..end).contains(index))
            .collect();
        let delivered = commits.iter().find(|&&(index, _)| index == end);

        let wrong_bits = |place: usize, received: &Received| {
            let is_checked = F::CHECK_KNOWN_AT < F::SHAPE.length() && (2..7).contains(&place);
            let bits = received.wrong.count_ones();
            // Elsewhere than where the checksum looks, any error is too much.
            if is_checked || bits == 0 { bits } else { 99 }
        };
        let bits: u32 = window
            .iter()
            .enumerate()
            .map(|(place, received)| wrong_bits(place, received))
            .sum();
        if (1..=3).contains(&bits) {
            assert_eq!(
                delivered, None,
                "{bits} wrong bits in frame {number}: {steps:02X?}"
            );
        }
        if bits != 0 {
            continue;
        }

        let [_, pitch, roll, yaw] = line.payloads.get(number).copied().unwrap_or_default();
        let setpoint = Setpoint { pitch, roll, yaw };
        match within.as_slice() {
            [] => assert_eq!(
                delivered,
                Some(&(end, setpoint)),
                "frame {number}, whole at {start}: {steps:02X?}"
            ),
            [index] => {
                assert_eq!(delivered, None, "frame {number}: {steps:02X?}");
                let last = line.received.get(*index).map(|received| received.byte);
                let is_payload = *index >= start + 2;
                assert!(
                    is_payload && last == Some(b'\r'),
                    "frame {number}: {steps:02X?}"
                );
            }
            _ => panic!("several commits within frame {number}: {steps:02X?}"),
        }
        let is_first = start == 0 || window.first().is_some_and(|first| first.behind_event);
        assert!(
            !is_first || within.is_empty(),
            "frame {number} is the first: {steps:02X?}"
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The seeds are written in this layout.
    #[test]
    fn bytes_are_read_as_steps() {
        let bytes = b"\x10wxyz\x02\x05\x00\x03\x06\x00\x80\x04\x07\x01q\x05\x02\x00\x1E\x01\x00\xFF\x07\x09\x00";
        let mut u = Unstructured::new(bytes);
        let mut steps = Vec::<Step>::new();
        while !u.is_empty() {
            steps.push(u.arbitrary().expect("enough"));
        }
        assert_eq!(
            steps,
            [
                Step::Send {
                    payload: *b"wxyz",
                    times: 3
                },
                Step::Lose { at: 5 },
                Step::Substitute { at: 6, wrong: 0x80 },
                Step::Insert {
                    at: 0x107,
                    byte: b'q'
                },
                Step::Duplicate { at: 2 },
                Step::Burst {
                    at: 1,
                    wrong: 0xFF,
                    length: 4
                },
                Step::Event { at: 9 },
            ]
        );
    }

    /// So that what must survive is asked for, and not passed over.
    #[test]
    fn a_line_knows_what_became_of_what_was_sent() {
        let mut line = Line::default();
        line.step(Step::Send {
            payload: *b"wxyz",
            times: 3,
        });
        line.step(Step::Event { at: 8 });
        line.step(Step::Insert { at: 7, byte: 0 });
        let places: Vec<_> = line.received.iter().map(|received| received.sent).collect();
        assert_eq!(
            places.get(6..10),
            Some(&[Some((0, 6)), None, Some((1, 0)), Some((1, 2))][..])
        );
        let behind: Vec<_> = line.received.iter().map(|r| r.behind_event).collect();
        assert_eq!(behind.iter().position(|&behind| behind), Some(9));
        assert_eq!(line.received.len(), 21);
    }
}
