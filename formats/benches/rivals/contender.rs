//! framelock's receivers and those of other crates, in one list.

use std::hint::black_box;
use std::ops::Range;
use std::sync::LazyLock;
use std::time::{Duration, Instant};

use framelock::{
    BufferedReceiver, FixedFormat, Format, Found, Frame, PacketFormat, PacketReceiver, Parser,
    Receiver,
};
use framelock_formats::AnyOf;
use framelock_formats::layout::CheckedLayout;
use framelock_proofs::reference;
use framelock_rivals_adapters::Contender;
use regex::bytes::Regex;
use winnow::combinator::{alt, preceded, terminated};
use winnow::error::{EmptyError, ErrMode};
use winnow::token::{any, literal, take};
use winnow::{Parser as _, Partial};

/// A delivered frame: its key, and the number of bytes that the receiver had processed when it delivered the frame.
pub(crate) struct Delivered {
    pub(crate) key: Vec<u8>,
    pub(crate) taken: usize,
}

/// A naive reference: returns the positions of the frames in a stream.
pub(crate) type Reference = Box<dyn Fn(&[u8]) -> Vec<Range<usize>>>;

/// A contender behind boxed functions, so that one list holds all contenders. `deliver` and `time` take a stream and a
/// number of bytes. They pass the stream to the contender in pieces of this number of bytes.
pub(crate) struct Entry {
    pub(crate) name: &'static str,
    /// The programs of `on-chip` with this receiver. Each entry has the text to append to the protocol's feature, such
    /// as `-cobs` or `,line`, and a name for the tables. The list is empty if the receiver does not run on the chip.
    pub(crate) on_chip: Vec<(String, &'static str)>,
    /// Returns the frames that the contender finds in a stream.
    pub(crate) deliver: Box<dyn Fn(&[u8], usize) -> Vec<Delivered>>,
    /// Returns the time that the contender takes for a stream.
    pub(crate) time: Box<dyn Fn(&[u8], usize) -> Duration>,
    /// The reference for framelock's own receiver; `None` for other crates.
    pub(crate) reference: Option<Reference>,
}

impl Entry {
    /// Creates an entry. `see` reads a message, and `key` extracts from it the same key that the protocol's `key`
    /// extracts from the frame.
    fn new<C: Contender + 'static>(
        name: &'static str,
        new: impl Fn() -> C + Copy + 'static,
        see: impl Fn(C::Message<'_>) + Copy + 'static,
        key: impl Fn(C::Message<'_>) -> Vec<u8> + Copy + 'static,
    ) -> Self {
        Self {
            name,
            on_chip: Vec::new(),
            deliver: Box::new(move |stream, piece| {
                let mut delivered = Vec::new();
                hand_over(new(), stream, piece, |taken, message| {
                    let key = key(message);
                    delivered.push(Delivered { key, taken });
                });
                delivered
            }),
            time: Box::new(move |stream, piece| {
                let begin = Instant::now();
                hand_over(new(), black_box(stream), piece, |_, message| see(message));
                begin.elapsed()
            }),
            reference: None,
        }
    }

    /// Creates the entry of another crate, which also runs on the chip.
    pub(crate) fn rival<C: Contender + Default + 'static>(
        name: &'static str,
        key: impl Fn(C::Message<'_>) -> Vec<u8> + Copy + 'static,
    ) -> Self {
        Self {
            on_chip: vec![(format!("-{name}"), name)],
            ..Self::on_pc::<C>(name, key)
        }
    }

    /// Creates the entry of a receiver that runs only on the PC.
    pub(crate) fn on_pc<C: Contender + Default + 'static>(
        name: &'static str,
        key: impl Fn(C::Message<'_>) -> Vec<u8> + Copy + 'static,
    ) -> Self {
        let see = |message: C::Message<'_>| {
            black_box(&message);
        };
        Self::new(name, C::default, see, key)
    }
}

/// A framelock receiver.
#[derive(Default)]
pub(crate) struct Framelock<P>(P);

impl<P: Parser + 'static> Contender for Framelock<P> {
    type Message<'a> = P::Message<'a>;

    #[inline]
    fn feed(&mut self, bytes: &[u8], mut found: impl FnMut(P::Message<'_>)) {
        self.0.feed(bytes, |what| {
            if let Found::Frame { message, .. } = what {
                found(message);
            }
        });
    }

    #[inline]
    fn push(&mut self, byte: u8, mut found: impl FnMut(P::Message<'_>)) {
        if let Some(message) = self.0.push(byte) {
            found(message);
        }
    }
}

/// Returns the entry of framelock's receiver of a format. The buffer has `N` bytes, twice the length of
/// the longest frame.
pub(crate) fn buffered<const N: usize, F: Format + Copy + 'static>(
    format: F,
    key: impl Fn(F::Message<'_>) -> Vec<u8> + Copy + 'static,
) -> Entry {
    framelock(
        move || BufferedReceiver::<F, [u8; N]>::new(format),
        |frame: Frame<'_, F>| {
            black_box(&frame.message());
        },
        move |frame: Frame<'_, F>| key(frame.message()),
        reference(format),
    )
}

/// Returns the entry of framelock's receiver of a format of fixed length. The reference uses the format's layout.
pub(crate) fn fixed<F: FixedFormat>(
    layout: &'static [CheckedLayout<'static>; 1],
    key: impl Fn(F::Message) -> Vec<u8> + Copy + 'static,
) -> Entry {
    let see = |message: F::Message| {
        black_box(&message);
    };
    framelock(Receiver::<F>::new, see, key, reference(AnyOf(layout)))
}

/// Returns the entry of framelock's receiver of packets. Its buffer has `N` bytes. The message is the packet.
pub(crate) fn packets<const N: usize, F>(format: F, reference: Reference) -> Entry
where
    F: PacketFormat + for<'a> Format<Message<'a> = &'a [u8]> + Copy + 'static,
{
    framelock(
        move || PacketReceiver::<F, [u8; N]>::new(format),
        |frame: Frame<'_, F>| {
            black_box(&frame.message());
        },
        move |frame: Frame<'_, F>| frame.message().to_vec(),
        reference,
    )
}

fn framelock<P: Parser + 'static>(
    new: impl Fn() -> P + Copy + 'static,
    see: impl Fn(P::Message<'_>) + Copy + 'static,
    key: impl Fn(P::Message<'_>) -> Vec<u8> + Copy + 'static,
    reference: Reference,
) -> Entry {
    let (alone, in_line) = ("framelock", "framelock, `Line`");
    Entry {
        on_chip: vec![(String::new(), alone), (",line".to_owned(), in_line)],
        reference: Some(reference),
        ..Entry::new::<Framelock<P>>(alone, move || Framelock(new()), see, key)
    }
}

fn reference<F: Format + Copy + 'static>(format: F) -> Reference {
    Box::new(move |stream| {
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
    })
}

/// Passes a stream to a contender. The two loops are separate functions, so that the compiler may keep the contender in
/// registers in `by_byte`.
fn hand_over<C: Contender>(
    contender: C,
    stream: &[u8],
    piece: usize,
    found: impl FnMut(usize, C::Message<'_>),
) {
    if piece == 1 {
        by_byte(contender, stream, found);
    } else {
        in_pieces(contender, stream, piece, found);
    }
}

#[inline(never)]
fn by_byte<C: Contender>(
    mut contender: C,
    stream: &[u8],
    mut found: impl FnMut(usize, C::Message<'_>),
) {
    for (taken, &byte) in stream.iter().enumerate() {
        contender.push(byte, |message| found(taken + 1, message));
    }
}

#[inline(never)]
fn in_pieces<C: Contender>(
    mut contender: C,
    stream: &[u8],
    piece: usize,
    mut found: impl FnMut(usize, C::Message<'_>),
) {
    let mut taken = 0;
    for bytes in stream.chunks(piece) {
        taken += bytes.len();
        contender.feed(bytes, |message| found(taken, message));
    }
}

/// Finds BIN frames with a regular expression. Keeps the bytes at the end that may begin a frame.
#[derive(Default)]
pub(crate) struct RegularExpression(Vec<u8>);

impl Contender for RegularExpression {
    type Message<'a> = &'a [u8];

    fn feed(&mut self, bytes: &[u8], mut found: impl FnMut(&[u8])) {
        static FRAME: LazyLock<Regex> =
            LazyLock::new(|| Regex::new(r"(?s-u)AB.{4}\r").expect("a valid expression"));
        self.0.extend(bytes);
        let mut end = self.0.len().saturating_sub(6);
        for frame in FRAME.find_iter(&self.0) {
            end = end.max(frame.end());
            found(&frame.as_bytes()[3..6]);
        }
        self.0.drain(..end);
    }
}

/// Finds BIN frames with a parser combinator for streams, which in each step takes a frame or skips one byte. Keeps the
/// incomplete frame at the end.
#[derive(Default)]
pub(crate) struct Combinator(Vec<u8>);

impl Contender for Combinator {
    type Message<'a> = &'a [u8];

    fn feed(&mut self, bytes: &[u8], mut found: impl FnMut(&[u8])) {
        type Stream<'a> = Partial<&'a [u8]>;
        type Error = ErrMode<EmptyError>;
        fn frame<'a>(stream: &mut Stream<'a>) -> Result<&'a [u8], Error> {
            let payload = preceded(any, take(3_usize));
            preceded(literal(b"AB"), terminated(payload, literal(b'\r'))).parse_next(stream)
        }
        fn frame_or_byte<'a>(stream: &mut Stream<'a>) -> Result<Option<&'a [u8]>, Error> {
            alt((frame.map(Some), any.value(None))).parse_next(stream)
        }
        self.0.extend(bytes);
        let mut stream = Partial::new(&self.0[..]);
        let mut left = stream.len();
        // The loop ends at an incomplete frame.
        while let Ok(outcome) = frame_or_byte(&mut stream) {
            outcome.map(&mut found);
            left = stream.len();
        }
        let end = self.0.len() - left;
        self.0.drain(..end);
    }
}
