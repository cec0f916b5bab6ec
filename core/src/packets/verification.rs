//! Theorem 14: the receiver of packets between delimiters.
//!
//! **14a: packets.** For SLIP, HDLC, COBS and breaks: a packet is delivered if and only if it stands between two
//! delimiters, the format accepts it, and no line event lies between the delimiters except a pause directly after the
//! first one. The proof follows the receiver through a stream of any length ([`between_delimiters`]). From any state, a
//! delimiter begins a packet, and a line event ends the packet, except a pause directly after the delimiter. Outside
//! packets nothing is delivered. After a delimiter, the receiver takes up to five bytes and another delimiter, and
//! delivers the packet between the two delimiters if the format accepts it, and otherwise nothing. The harness undoes
//! the stuffing with a function of its own, which sees all bytes between the delimiters at once.
//!
//! **14b: any format and any stuffing**, even if the format breaks its laws and the special bytes are equal. Nothing
//! panics, and each byte is in exactly one outcome or pending. Proof by induction over the receiver's calls, with the
//! invariant [`fits`]. `feed` and `next` only repeat the step of `push` ([`any_state`]).
//!
//! **14c: stuffing** can be undone. Unstuffing the output of [`Stuffing::stuff`] gives the packet. No delimiter is
//! between the first and the last byte of the stuffed packet ([`round_trip`]).
//!
//! **14d: DLE framing.** From any state, a receiver that takes a whole packet delivers this packet with its last byte,
//! unless it delivers an earlier packet that contains this packet. In the harnesses, each such earlier packet is too
//! long to be delivered ([`from_any_state`]).

mod any_state;
mod between_delimiters;
mod from_any_state;
mod round_trip;

use core::marker::PhantomData;

use super::PacketReceiver;
use crate::any_format::{any_up_to, any_verdict};
use crate::stuffing::Unstuffing;
use crate::{Classification, Codes, DiscardReason, Format, LineEvent, PacketFormat, Stuffing};

/// A way of stuffing that is known to the compiler, so that the proof need not follow the code for other ways.
trait Kind: Copy {
    const STUFFING: Stuffing;
}

macro_rules! kinds {
    ($($name:ident $stuffing:expr;)*) => { $(
        #[derive(Clone, Copy)]
        struct $name;

        impl Kind for $name {
            const STUFFING: Stuffing = $stuffing;
        }
    )* };
}
kinds! {
    Slip Stuffing::SLIP;
    Hdlc Stuffing::HDLC;
    Cobs Stuffing::Cobs;
    Dle Stuffing::DLE;
    Tsip Stuffing::Doubled { escape: 0x10, start: None, end: 0x03 };
    Break Stuffing::Break;
}

/// A format of packets that have at most `L - 1` bytes and end only with their delimiter.
#[derive(Clone, Copy)]
struct Accepting<K, const L: usize> {
    /// The accepted packets, as bits: bit `n` belongs to the packets whose XOR, modulo 8, is `n`.
    accepted: u8,
    kind: PhantomData<K>,
}

impl<K: Kind, const L: usize> Accepting<K, L> {
    fn any(_: K) -> Self {
        let accepted = kani::any();
        let kind = PhantomData;
        Self { accepted, kind }
    }

    fn accepts(self, packet: &[u8]) -> bool {
        let mut xor = 0;
        let mut at = 0;
        while at < packet.len() {
            xor ^= packet[at];
            at += 1;
        }
        self.accepted >> (xor % 8) & 1 == 1
    }
}

impl<K: Kind, const L: usize> Format for Accepting<K, L> {
    const LONGEST: usize = L;
    type Message<'a> = &'a [u8];

    fn classify(&self, bytes: &[u8]) -> Classification {
        if bytes.len() < L {
            Classification::Incomplete { at_least: L }
        } else {
            Classification::Rejected(DiscardReason::TooLong)
        }
    }

    fn classify_before(&self, bytes: &[u8], _: LineEvent) -> Classification {
        if self.accepts(bytes) {
            Classification::Frame(bytes.len())
        } else {
            Classification::Rejected(DiscardReason::ChecksumMismatch)
        }
    }

    fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
        frame
    }
}

impl<K: Kind, const L: usize> PacketFormat for Accepting<K, L> {
    fn stuffing(&self) -> Stuffing {
        K::STUFFING
    }
}

/// A format whose answers are arbitrary, and may break every law.
#[derive(Clone, Copy)]
struct Lawless<const L: usize>(Stuffing);

impl<const L: usize> Format for Lawless<L> {
    const LONGEST: usize = L;
    type Message<'a> = &'a [u8];

    fn classify(&self, bytes: &[u8]) -> Classification {
        assert!(!bytes.is_empty() && bytes.len() <= L);
        any_verdict()
    }

    fn classify_before(&self, bytes: &[u8], event: LineEvent) -> Classification {
        assert!(event == LineEvent::Idle);
        self.classify(bytes)
    }

    fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
        frame
    }
}

impl<const L: usize> PacketFormat for Lawless<L> {
    fn stuffing(&self) -> Stuffing {
        self.0
    }
}

/// Returns any codes that are a pair.
fn any_pair() -> Codes {
    Codes::Pair {
        delimiter: kani::any(),
        escape: kani::any(),
    }
}

/// Returns any stuffing with escape sequences that uses these codes.
fn any_escape(codes: Codes) -> Stuffing {
    Stuffing::Escape {
        delimiter: kani::any(),
        escape: kani::any(),
        codes,
    }
}

/// Returns any DLE framing with this start code.
fn any_doubled(start: Option<u8>) -> Stuffing {
    Stuffing::Doubled {
        escape: kani::any(),
        start,
        end: kani::any(),
    }
}

/// A receiver that borrows its buffer. The prover follows writes to the buffer faster if the buffer is not part of the
/// receiver.
type Receiver<'b, F, const L: usize> = PacketReceiver<F, &'b mut [u8; L]>;

/// Returns a receiver in any state that [fits]. The buffer holds any bytes.
fn any_receiver<F: PacketFormat, const L: usize>(
    format: F,
    buffer: &mut [u8; L],
) -> Receiver<'_, F, L> {
    let receiver = receiver_in(format, buffer, kani::any(), any_up_to(L), kani::any());
    kani::assume(fits(&receiver));
    receiver
}

/// Returns a receiver in any state with these values, which need not [fit](fits). If a value is constant, the prover
/// need not follow the code for other values.
fn receiver_in<F: PacketFormat, const L: usize>(
    format: F,
    buffer: &mut [u8; L],
    is_open: bool,
    length: usize,
    missing: u8,
) -> Receiver<'_, F, L> {
    *buffer = kani::any();
    let is_doubled = matches!(format.stuffing(), Stuffing::Doubled { .. });
    PacketReceiver {
        format,
        buffer,
        length,
        ask_at: if is_doubled { usize::MAX } else { kani::any() },
        pending: usize::from(kani::any::<u8>()),
        is_open,
        unstuffing: Unstuffing {
            missing,
            has_zero: kani::any(),
        },
    }
}

/// Returns whether the invariant holds. Outside a packet only an escape byte of DLE framing is pending. Inside a packet
/// at least the delimiter, unless it is a break, and one byte for each byte of the packet are pending. In DLE framing,
/// the exact number of pending bytes follows from the packet and from whether an escape byte came last.
fn fits<F: PacketFormat, const L: usize>(receiver: &Receiver<'_, F, L>) -> bool {
    let (length, pending) = (receiver.length, receiver.pending);
    let stuffing = receiver.format.stuffing();
    let Stuffing::Doubled { escape, start, .. } = stuffing else {
        let delimiters = usize::from(stuffing.delimiter().is_some());
        let is_placed = pending >= length + delimiters;
        return length <= L
            && if receiver.is_open {
                is_placed
            } else {
                pending == 0
            };
    };
    if !receiver.is_open {
        return pending <= 1;
    }
    let missing = receiver.unstuffing.missing;
    let mut expected = 1 + usize::from(start.is_some()) + usize::from(missing);
    let mut at = 0;
    while at < L {
        if at < length {
            expected += 1 + usize::from(receiver.buffer[at] == escape);
        }
        at += 1;
    }
    length <= L
        && missing <= 1
        && receiver.ask_at == usize::MAX
        && pending == expected
        && (start.is_some() || length > 0 && receiver.buffer[0] != escape)
}
