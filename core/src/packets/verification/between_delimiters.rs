//! 14a: the receiver delivers each accepted packet between two delimiters, and nothing else.

use super::{Accepting, Break, Cobs, Hdlc, Kind, Slip, any_receiver};
use crate::any_format::{any_line_event, any_up_to, part};
use crate::stuffing::Unstuffing;
use crate::{Codes, LineEvent, Stuffing};

/// One more than the number of bytes in the longest packet.
const LONGEST: usize = 4;

/// The greatest number of bytes between two delimiters in these harnesses.
pub(super) const BETWEEN: usize = 5;

type Receiver<'b, K> = super::Receiver<'b, Accepting<K, LONGEST>, LONGEST>;

/// Returns whether a packet has just begun.
fn is_fresh<K: Kind>(receiver: &Receiver<'_, K>) -> bool {
    receiver.is_open && receiver.length == 0 && receiver.unstuffing == Unstuffing::NEW
}

/// From any state, a delimiter begins a packet.
fn delimiter_begins<K: Kind>(kind: K) {
    let stuffing = K::STUFFING;
    let mut buffer = [0; LONGEST];
    let mut receiver = any_receiver(Accepting::any(kind), &mut buffer);
    match stuffing.delimiter() {
        Some(delimiter) => drop(receiver.push(delimiter).is_some()),
        None => receiver.line_event(LineEvent::Break, |_| ()),
    }
    assert!(is_fresh(&receiver));
    kani::cover!(true, "a packet begins");
}

/// From any state, a line event that is no delimiter delivers nothing. It ends the packet, except if it is a pause
/// directly after the delimiter.
fn event_ends<K: Kind>(kind: K) {
    let stuffing = K::STUFFING;
    let mut buffer = [0; LONGEST];
    let mut receiver = any_receiver(Accepting::any(kind), &mut buffer);
    let event = any_line_event();
    kani::assume(stuffing != Stuffing::Break || event != LineEvent::Break);
    let (was_fresh, before) = (is_fresh(&receiver), receiver.pending());
    receiver.line_event(event, |one| assert!(one.message().is_none()));
    let is_kept = was_fresh && event == LineEvent::Idle;
    assert!(receiver.is_open == is_kept);
    assert!(!is_kept || is_fresh(&receiver) && receiver.pending() == before);
    kani::cover!(
        was_fresh && !receiver.is_open,
        "another event after the delimiter"
    );
}

/// Outside packets nothing is delivered, and only a delimiter begins a packet.
fn nothing_is_outside<K: Kind>(kind: K) {
    let stuffing = K::STUFFING;
    let mut buffer = [0; LONGEST];
    let mut receiver: Receiver<_> = any_receiver(Accepting::any(kind), &mut buffer);
    kani::assume(!receiver.is_open);
    let byte = kani::any();
    assert!(receiver.push(byte).is_none());
    assert!(receiver.is_open == (stuffing.delimiter() == Some(byte)));
    kani::cover!(!receiver.is_open, "a byte outside packets");
}

/// Unstuffed bytes.
#[derive(Clone, Copy)]
pub(super) struct Packet {
    pub(super) bytes: [u8; BETWEEN],
    pub(super) length: usize,
}

impl Packet {
    const EMPTY: Self = Self {
        bytes: [0; BETWEEN],
        length: 0,
    };

    fn push(&mut self, byte: u8) {
        self.bytes[self.length] = byte;
        self.length += 1;
    }
}

/// Undoes the stuffing of all bytes between two delimiters. Returns `None` if the stuffing is wrong.
pub(super) fn unstuffed(stuffing: Stuffing, bytes: &[u8]) -> Option<Packet> {
    let mut packet = Packet::EMPTY;
    // The index of the next code of COBS, or of the byte after an escape sequence.
    let mut next = 0;
    let mut at = 0;
    while at < bytes.len() {
        let byte = bytes[at];
        match stuffing {
            Stuffing::Cobs if at >= next => {
                if at > 0 {
                    packet.push(0);
                }
                next = at + usize::from(byte);
            }
            Stuffing::Escape { escape, .. } if at >= next && byte == escape => next = at + 2,
            Stuffing::Escape {
                delimiter,
                escape,
                codes,
            } if at < next => packet.push(match codes {
                Codes::Xor(with) => byte ^ with,
                Codes::Pair {
                    delimiter: code, ..
                } if byte == code => delimiter,
                Codes::Pair { escape: code, .. } if byte == code => escape,
                Codes::Pair { .. } => return None,
            }),
            _ => packet.push(byte),
        }
        at += 1;
    }
    (next <= bytes.len()).then_some(packet)
}

/// After a delimiter, the receiver takes any bytes and another delimiter. It delivers the packet between them if the
/// format accepts the packet, and otherwise nothing.
fn packet_is_delivered<K: Kind>(kind: K) {
    let stuffing = K::STUFFING;
    let format = Accepting::any(kind);
    let mut buffer = [0; LONGEST];
    let mut receiver = Receiver::<K>::with_buffer(format, &mut buffer).unwrap();
    receiver.open();
    let (bytes, length): ([u8; BETWEEN], usize) = (kani::any(), any_up_to(BETWEEN));
    let mut at = 0;
    while at < BETWEEN {
        if at < length {
            kani::assume(stuffing.delimiter() != Some(bytes[at]));
            assert!(receiver.push(bytes[at]).is_none());
        }
        at += 1;
    }
    let packet = unstuffed(stuffing, part(&bytes, 0, length)).unwrap_or(Packet::EMPTY);
    let is_frame = (1..LONGEST).contains(&packet.length)
        && format.accepts(part(&packet.bytes, 0, packet.length));
    let place = any_up_to(LONGEST);
    let is_right = |frame: &[u8]| {
        frame.len() == packet.length
            && (place >= frame.len() || frame[place] == packet.bytes[place])
    };
    if let Some(delimiter) = stuffing.delimiter() {
        let frame = receiver.push(delimiter);
        assert!(frame.is_some() == is_frame);
        assert!(frame.is_none_or(|frame| is_right(frame.bytes())));
    } else {
        let mut frames = 0;
        receiver.line_event(LineEvent::Break, |one| {
            if let Some(frame) = one.message() {
                assert!(is_right(frame.bytes()));
                frames += 1;
            }
        });
        assert!(frames == usize::from(is_frame));
    }
    kani::cover!(
        is_frame && packet.length + 1 == LONGEST,
        "the longest packet"
    );
    kani::cover!(packet.length == LONGEST, "a packet that is too long");
    kani::cover!(packet.length == 0, "wrong stuffing, or an empty packet");
}

macro_rules! for_stuffings {
    ($($module:ident $proof:ident)*) => { $(
        mod $module {
            use super::*;

            #[kani::proof]
            #[kani::unwind(7)]
            fn of_slip() {
                $proof(Slip);
            }

            #[kani::proof]
            #[kani::unwind(7)]
            fn of_hdlc() {
                $proof(Hdlc);
            }

            #[kani::proof]
            #[kani::unwind(7)]
            fn of_cobs() {
                $proof(Cobs);
            }

            #[kani::proof]
            #[kani::unwind(7)]
            fn of_break() {
                $proof(Break);
            }
        }
    )* };
}
for_stuffings!(
    begin delimiter_begins
    end event_ends
    outside nothing_is_outside
    packet packet_is_delivered
);
