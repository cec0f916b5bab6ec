//! The interface of the receivers that are compared, and framelock's receiver.

use std::hint::black_box;
use std::ops::Range;
use std::time::{Duration, Instant};

use framelock::{BufferedReceiver, Format, Found};
use framelock_proofs::reference;

/// A receiver of a protocol's frames. For another crate, an adapter implements this trait. The adapter uses the crate
/// as the crate's documentation shows, and adds nothing.
pub(crate) trait Contender {
    /// The data that the receiver returns to its user.
    type Message<'a>;

    /// Takes the next bytes of the stream, and calls `found` for each frame.
    fn feed(&mut self, bytes: &[u8], found: impl FnMut(Self::Message<'_>));

    /// Takes a single byte.
    #[inline]
    fn push(&mut self, byte: u8, found: impl FnMut(Self::Message<'_>)) {
        self.feed(&[byte], found);
    }
}

/// framelock's receiver.
struct Framelock<F, const N: usize>(BufferedReceiver<F, [u8; N]>);

impl<F: Format, const N: usize> Contender for Framelock<F, N> {
    type Message<'a> = F::Message<'a>;

    #[inline]
    fn feed(&mut self, bytes: &[u8], mut found: impl FnMut(F::Message<'_>)) {
        self.0.feed(bytes, |what| {
            if let Found::Frame { message, .. } = what {
                found(message.message());
            }
        });
    }

    #[inline]
    fn push(&mut self, byte: u8, mut found: impl FnMut(F::Message<'_>)) {
        if let Some(frame) = self.0.push(byte) {
            found(frame.message());
        }
    }
}

/// The way in which a receiver gets the stream.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Cut {
    Bytes,
    /// Chunks of 64 bytes, a common size for half of a DMA buffer.
    ChunksOf64,
}

/// A delivered frame: its key, and the number of bytes that the receiver had processed when it delivered the frame.
pub(crate) struct Delivered {
    pub(crate) key: Vec<u8>,
    pub(crate) taken: usize,
}

/// A contender as a trait object, so that one list holds all contenders.
pub(crate) struct Entry {
    pub(crate) name: &'static str,
    /// Returns the frames that the contender finds in a stream.
    pub(crate) deliver: Box<dyn Fn(&[u8], Cut) -> Vec<Delivered>>,
    /// Returns the time that the contender takes for a stream.
    pub(crate) time: Box<dyn Fn(&[u8], Cut) -> Duration>,
    /// Returns the frames that the reference finds in a stream. Only framelock's own entries have this function.
    pub(crate) reference: Option<Box<dyn Fn(&[u8]) -> Vec<Range<usize>>>>,
}

impl Entry {
    /// Creates the entry of another crate. `key` extracts from one of the crate's messages the same key that the
    /// protocol's `key` extracts from the frame.
    pub(crate) fn rival<C: Contender + 'static>(
        name: &'static str,
        new: impl Fn() -> C + Copy + 'static,
        key: impl Fn(C::Message<'_>) -> Vec<u8> + Copy + 'static,
    ) -> Self {
        Self {
            name,
            deliver: Box::new(move |stream, cut| {
                let mut delivered = Vec::new();
                hand_over(&mut new(), stream, cut, |taken, message| {
                    let key = key(message);
                    delivered.push(Delivered { key, taken });
                });
                delivered
            }),
            time: Box::new(move |stream, cut| {
                let begin = Instant::now();
                hand_over(&mut new(), black_box(stream), cut, |_, message| {
                    black_box(&message);
                });
                begin.elapsed()
            }),
            reference: None,
        }
    }

    /// Creates the entry of framelock's receiver with this format. `N`, the size of the buffer in bytes, is twice the
    /// length of the longest frame.
    pub(crate) fn ours<const N: usize, F: Format + Copy + 'static>(
        name: &'static str,
        format: F,
        key: impl Fn(F::Message<'_>) -> Vec<u8> + Copy + 'static,
    ) -> Self {
        let new = move || Framelock(BufferedReceiver::<F, [u8; N]>::new(format));
        let frames = move |stream: &[u8]| {
            let mut frames = Vec::new();
            reference::framed(&format, stream, None, |found| {
                if let Found::Frame {
                    length, message, ..
                } = found
                {
                    frames.push(message..message + length);
                }
            });
            frames
        };
        Self {
            reference: Some(Box::new(frames)),
            ..Self::rival(name, new, move |message: F::Message<'_>| key(message))
        }
    }
}

#[inline]
fn hand_over<C: Contender>(
    contender: &mut C,
    stream: &[u8],
    cut: Cut,
    mut found: impl FnMut(usize, C::Message<'_>),
) {
    let mut taken = 0;
    match cut {
        Cut::Bytes => {
            for &byte in stream {
                taken += 1;
                contender.push(byte, |message| found(taken, message));
            }
        }
        Cut::ChunksOf64 => {
            for chunk in stream.chunks(64) {
                taken += chunk.len();
                contender.feed(chunk, |message| found(taken, message));
            }
        }
    }
}
