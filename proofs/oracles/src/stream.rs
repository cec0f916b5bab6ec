//! The stream in the inputs of the targets, except `failsafe` and `description`. It is cut into slices, with line
//! events between them.

use arbitrary::{Arbitrary, Unstructured};
use framelock::LineEvent;

use crate::rest;

/// The slices and line events that reach the parser, in order.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Stream(pub Vec<StreamStep>);

/// A slice, or a line event.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum StreamStep {
    /// These bytes arrive together, as one slice.
    Slice(Vec<u8>),
    /// The UART or a timer reports this line event.
    Event(LineEvent),
}

impl Stream {
    /// Returns the bytes before, between and after the line events, one vector for each part.
    pub(crate) fn stretches(&self) -> impl Iterator<Item = Vec<u8>> {
        let stretches = self.0.split(|step| matches!(step, StreamStep::Event(_)));
        stretches.map(bytes_of)
    }
}

impl StreamStep {
    pub(crate) fn bytes(&self) -> &[u8] {
        match self {
            Self::Slice(bytes) => bytes,
            Self::Event(_) => &[],
        }
    }
}

/// Returns the bytes of all slices in `steps`, concatenated. Line events have no bytes.
pub(crate) fn bytes_of(steps: &[StreamStep]) -> Vec<u8> {
    steps.iter().flat_map(StreamStep::bytes).copied().collect()
}

impl<'a> Arbitrary<'a> for Stream {
    fn arbitrary(u: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        Ok(Self(rest(u)))
    }
}

impl<'a> Arbitrary<'a> for StreamStep {
    /// The first byte modulo 8 determines the step:
    ///
    /// * 0 to 3: a slice. The next byte is its length.
    /// * 4: a slice of equal BIN frames. The first byte divided by 8 is the number of frames, and the next four bytes
    ///   are the payload of each frame.
    /// * 5: a slice of equal bytes. The next byte is the number of equal bytes, and the byte after it is their value.
    /// * 6 and 7: a line event. The first byte divided by 8 determines its kind.
    fn arbitrary(u: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        let first = u8::arbitrary(u)?;
        let eighth = usize::from(first / 8);
        Ok(match first % 8 {
            0..=3 => {
                let length = usize::from(u8::arbitrary(u)?).min(u.len());
                Self::Slice(u.bytes(length)?.to_vec())
            }
            4 => {
                let [a, b, c, d]: [u8; 4] = u.arbitrary()?;
                Self::Slice([b'A', b'B', a, b, c, d, b'\r'].repeat(eighth))
            }
            5 => {
                let [count, byte]: [u8; 2] = u.arbitrary()?;
                Self::Slice(vec![byte; count.into()])
            }
            _ => Self::Event(match eighth % 5 {
                0 => LineEvent::Framing,
                1 => LineEvent::Parity,
                2 => LineEvent::Overrun,
                3 => LineEvent::Break,
                _ => LineEvent::Idle,
            }),
        })
    }
}
