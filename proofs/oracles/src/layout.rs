//! An interpreter of any layout, written from the documentation of [`Layout`] in plain loops.

use std::cmp::max;
use std::slice;

use framelock::Classification::{self, Frame, Incomplete, Rejected};
use framelock::{Counters, DiscardReason, Format, LineEvent};
use framelock_formats::layout::{
    Algorithm, ByteOrder, CheckedLayout, Checksum, Crc, Encoding, Layout, Length, LengthField,
    Number, Patterns,
};

use crate::framing::{Frames, as_the_reference};
use crate::outcome::Occurred;
use crate::stream::Stream;

/// The most bytes that a frame should have in [`layouts`]. The reference is slow with longer frames.
pub const LONGEST: usize = 128;

/// All line events, in the order of the enum.
pub const EVENTS: [LineEvent; 5] = [
    LineEvent::Framing,
    LineEvent::Parity,
    LineEvent::Overrun,
    LineEvent::Break,
    LineEvent::Idle,
];

/// Checks that receivers of a format report the same frames and discarded bytes as the reference, which uses the
/// [interpreter](interpret) of the format's layouts. Also checks that the format classifies the bytes at each position
/// as the interpreter does.
///
/// Counts the receivers' outcomes and states, and returns their counters.
///
/// # Panics
/// Panics if the stream shows a bug.
pub fn layouts<F: Format + Clone + 'static>(
    format: &F,
    layouts: &[CheckedLayout],
    stream: &Stream,
    occurred: &mut Occurred,
) -> Counters {
    let naive = Interpreted(layouts);
    for bytes in stream.stretches() {
        for from in 0..bytes.len() {
            let bytes = &bytes[from..];
            let bytes = &bytes[..bytes.len().min(format.longest())];
            let found = match format.classify(bytes) {
                Incomplete { .. } => Incomplete {
                    at_least: bytes.len() + 1,
                },
                other => other,
            };
            assert_eq!(found, naive.classify(bytes), "{bytes:02X?}, {layouts:?}");
            if matches!(found, Incomplete { .. }) {
                for event in EVENTS {
                    let [found, expected] = [
                        format.classify_before(bytes, event),
                        naive.classify_before(bytes, event),
                    ];
                    assert_eq!(found, expected, "{event:?}: {bytes:02X?}, {layouts:?}");
                }
            }
        }
    }
    let longest = format.longest();
    let format = || Frames(format.clone());
    as_the_reference(format, longest, &naive, stream, || 0, occurred)
}

/// The reference's format: frames of any of these layouts. The first layout that does not reject the bytes decides.
#[derive(Clone, Copy)]
pub(crate) struct Interpreted<'a>(pub(crate) &'a [CheckedLayout<'a>]);

impl Format for Interpreted<'_> {
    const LONGEST: usize = usize::MAX;
    type Message<'a> = ();

    fn longest(&self) -> usize {
        self.0
            .iter()
            .map(|layout| layout.most_bytes())
            .max()
            .expect("a layout")
    }

    /// If all layouts reject the bytes, returns the reason of the layout that found an error latest in the frame.
    fn classify(&self, bytes: &[u8]) -> Classification {
        let known = |layout: &CheckedLayout| &bytes[..bytes.len().min(layout.most_bytes())];
        let mut all = self.0.iter().map(|layout| interpret(layout, known(layout)));
        // If several layouts found their errors equally late, the first of these layouts decides.
        let first = all.next().expect("a layout");
        all.fold(first, |best, next| {
            if order(&next) > order(&best) {
                next
            } else {
                best
            }
        })
    }

    fn classify_before(&self, bytes: &[u8], event: LineEvent) -> Classification {
        let alone = self.0.iter().map(|layout| {
            if layout.length == Length::Silence {
                interpret_before(layout, bytes, event)
            } else {
                match Self(slice::from_ref(layout)).classify(bytes) {
                    Frame(length) => Frame(length),
                    _ => Rejected(DiscardReason::LineEvent),
                }
            }
        });
        let alone: Vec<_> = alone.collect();
        let frame = alone.iter().find(|one| matches!(one, Frame(_)));
        let late = alone.iter().find(|one| order(one) == 3);
        *frame
            .or(late)
            .unwrap_or(&Rejected(DiscardReason::LineEvent))
    }

    fn decode(&self, _: &[u8]) {}
}

/// Returns a greater number for a reason that is found later in the frame, and the greatest number for a frame and for
/// incomplete bytes.
fn order(classification: &Classification) -> u8 {
    match classification {
        Rejected(DiscardReason::NoSync) => 0,
        Rejected(DiscardReason::BrokenSync) => 1,
        Rejected(DiscardReason::ChecksumMismatch | DiscardReason::WrongTerminator) => 3,
        Rejected(_) => 2,
        _ => 4,
    }
}

/// Classifies the beginning of `bytes`, which contain at least one byte, and at most as many as a receiver must hold.
pub fn interpret(layout: &Layout, bytes: &[u8]) -> Classification {
    match classify(layout, bytes, false) {
        Ok(Some(length)) => Frame(length),
        Ok(None) => Incomplete {
            at_least: bytes.len() + 1,
        },
        Err(why) => Rejected(why),
    }
}

/// Classifies the beginning of `bytes`, which a line event follows.
pub fn interpret_before(layout: &Layout, bytes: &[u8], event: LineEvent) -> Classification {
    let is_silence = event == LineEvent::Idle || event == LineEvent::Break;
    match classify(layout, bytes, is_silence) {
        Ok(Some(length)) => Frame(length),
        Ok(None) => Rejected(DiscardReason::LineEvent),
        Err(why) => Rejected(why),
    }
}

/// Returns the length of the frame at the beginning of the bytes, or `None` if more bytes are needed. If `is_over`,
/// silence follows the bytes.
fn classify(layout: &Layout, bytes: &[u8], is_over: bool) -> Result<Option<usize>, DiscardReason> {
    let sync = layout.sync;
    let syncs = || sync.bytes.chunks(max(sync.length, 1));
    if sync.length > 0 && !syncs().any(|sync| agree(sync, bytes)) {
        return Err(if syncs().any(|sync| sync[0] == bytes[0]) {
            DiscardReason::BrokenSync
        } else {
            DiscardReason::NoSync
        });
    }

    let (mut header, mut limit, mut extra, mut trailer) = (max(sync.length, 1), None, None, 0);
    if let Length::Field(field) = layout.length {
        header = max(header, field.number.at + field.number.bytes);
    }
    if let Some(messages) = layout.messages {
        header = max(header, messages.number.at + messages.number.bytes);
    }
    if let Some(trailer) = layout.trailer {
        header = max(header, trailer.at + 1);
    }
    if bytes.len() < header {
        return Ok(None);
    }
    for bits in layout.fixed {
        if let Ok(at) = usize::try_from(bits.at)
            && at < header
            && bytes[at] & bits.mask != bits.value
        {
            return Err(DiscardReason::BadHeader);
        }
    }
    if let Some(messages) = layout.messages {
        let sent = number(&messages.number, bytes);
        let mut known = messages.known.iter();
        let message = known.find(|known| u64::from(known.number) == sent);
        let message = message.ok_or(DiscardReason::UnknownMessage)?;
        limit = Some(u64::from(message.longest_payload));
        extra = message.extra;
    }
    if let Some(announced) = layout.trailer
        && bytes[announced.at] & announced.mask > 0
    {
        trailer = announced.bytes;
    }

    // `end` is the frame's length without the trailer. Negative offsets count back from `counted`.
    let (end, counted) = match layout.length {
        Length::Fixed => (layout.longest, layout.longest),
        Length::Field(field) => {
            let sent = stated(&field, bytes);
            if limit.is_some_and(|limit| sent > limit) {
                return Err(DiscardReason::TooLong);
            }
            let length = i128::from(sent) * i128::from(field.factor) + i128::from(field.plus);
            let length = usize::try_from(length).map_err(|_| DiscardReason::BadHeader)?;
            if length < layout.shortest || length + trailer < header {
                return Err(DiscardReason::BadHeader);
            }
            if length + trailer > layout.longest {
                return Err(DiscardReason::TooLong);
            }
            (length, length)
        }
        Length::Silence if bytes.len() > layout.longest => return Err(DiscardReason::TooLong),
        Length::Silence if !is_over || bytes.len() < layout.shortest => return Ok(None),
        Length::Silence => (bytes.len(), bytes.len()),
        Length::Delimiter => match delimiter(layout, bytes)? {
            Some((content, width)) => (
                content + width + layout.behind,
                content + layout.terminator.length + layout.behind,
            ),
            None if bytes.len() == layout.longest => return Err(DiscardReason::WrongTerminator),
            None => return Ok(None),
        },
        length => panic!("unknown: {length:?}"),
    };
    if counted < layout.shortest {
        return Err(DiscardReason::BadHeader);
    }
    if end + trailer > layout.longest {
        return Err(DiscardReason::TooLong);
    }
    if bytes.len() < end + trailer {
        return Ok(None);
    }

    let frame = &bytes[..end];
    let terminator = layout.terminator;
    if terminator.length > 0 && !matches!(layout.length, Length::Delimiter) {
        let mut terminators = terminator.bytes.chunks(terminator.length);
        if !terminators.any(|terminator| frame.ends_with(terminator)) {
            return Err(DiscardReason::WrongTerminator);
        }
    }
    let mut fixed = layout.fixed.iter();
    if !fixed.all(|bits| frame[place(bits.at, counted)] & bits.mask == bits.value) {
        return Err(DiscardReason::WrongTerminator);
    }
    if let Some(checksum) = layout.checksum
        && !is_right(&checksum, frame, counted, extra)
    {
        return Err(DiscardReason::ChecksumMismatch);
    }
    Ok(Some(end + trailer))
}

/// Returns the position and the length of the first terminator after the sync; `None` if more bytes are needed.
fn delimiter<'a>(
    layout: &Layout<'a>,
    bytes: &[u8],
) -> Result<Option<(usize, usize)>, DiscardReason> {
    let [other, another] = layout.other_terminators;
    let of = |patterns: Patterns<'a>| patterns.bytes.chunks(patterns.length.max(1));
    let all = || of(layout.terminator).chain(of(other)).chain(of(another));
    let is_content = |byte: u8| {
        let mut ranges = layout.content.iter();
        ranges.any(|&(first, last)| (first..=last).contains(&byte))
    };
    for at in layout.sync.length..bytes.len() {
        let rest = &bytes[at..];
        if let Some(found) = all().find(|terminator| rest.starts_with(terminator)) {
            return Ok(Some((at, found.len())));
        }
        if !layout.content.is_empty() && !is_content(bytes[at]) {
            let may_follow = all().any(|terminator| agree(terminator, rest));
            return if may_follow {
                Ok(None)
            } else {
                Err(DiscardReason::WrongTerminator)
            };
        }
    }
    Ok(None)
}

/// Returns true if the bytes are the beginning of the pattern, or begin with it.
fn agree(pattern: &[u8], bytes: &[u8]) -> bool {
    pattern
        .iter()
        .zip(bytes)
        .all(|(wanted, byte)| wanted == byte)
}

/// Returns the value of a length field.
fn stated(field: &LengthField, bytes: &[u8]) -> u64 {
    let mask = u64::from(field.mask);
    let lowest_bit = mask & mask.wrapping_neg();
    (number(&field.number, bytes) & mask) / lowest_bit
}

fn number(number: &Number, bytes: &[u8]) -> u64 {
    value(&bytes[number.at..number.at + number.bytes], number.order)
}

fn value(bytes: &[u8], order: ByteOrder) -> u64 {
    let mut value = 0;
    for place in 0..bytes.len() {
        value = value * 256
            + u64::from(match order {
                ByteOrder::Big => bytes[place],
                ByteOrder::Little => bytes[bytes.len() - 1 - place],
            });
    }
    value
}

/// Returns the index of the byte at an offset.
pub(crate) fn place(offset: i16, counted: usize) -> usize {
    if offset < 0 {
        counted - usize::from(offset.unsigned_abs())
    } else {
        usize::from(offset.unsigned_abs())
    }
}

fn is_right(checksum: &Checksum, frame: &[u8], counted: usize, extra: Option<u8>) -> bool {
    let at = place(checksum.at, counted);
    let stored = match checksum.encoding {
        Encoding::Little => value(&frame[at..at + checksum.bytes], ByteOrder::Little),
        Encoding::Big => value(&frame[at..at + checksum.bytes], ByteOrder::Big),
        Encoding::Hex => {
            let digits = &frame[at..at + 2 * checksum.bytes];
            match std::str::from_utf8(digits).map(|digits| u64::from_str_radix(digits, 16)) {
                Ok(Ok(stored)) if digits.iter().all(u8::is_ascii_hexdigit) => stored,
                _ => return false,
            }
        }
        encoding => panic!("unknown: {encoding:?}"),
    };
    // If the checksum covers nothing, `to` is one less than `from`, so this range is empty.
    let covered = place(checksum.from, counted)..=place(checksum.to, counted);
    let mut covered = frame[covered].to_vec();
    if checksum.over_hex_digits {
        let digits = std::str::from_utf8(&covered).unwrap_or("?");
        let pairs = (0..digits.len())
            .step_by(2)
            .map(|at| digits.get(at..at + 2));
        let decoded = pairs.map(|pair| u8::from_str_radix(pair?, 16).ok());
        match decoded.collect::<Option<Vec<u8>>>() {
            Some(decoded) if !digits.contains('+') => covered = decoded,
            _ => return false,
        }
    }
    covered.extend(extra);
    let bits = (1 << (8 * checksum.bytes)) - 1;
    let initial = u64::from(checksum.initial);
    let order = match checksum.encoding {
        Encoding::Little => ByteOrder::Little,
        _ => ByteOrder::Big,
    };
    let words = covered.chunks(2).map(|word| match *word {
        [first] => value(&[first, 0], order),
        _ => value(word, order),
    });
    let bytes = covered.iter().map(|&byte| u64::from(byte));
    let computed = match checksum.algorithm {
        Algorithm::Crc(crc) => remainder(&crc, &covered),
        Algorithm::Sum => initial + bytes.sum::<u64>(),
        Algorithm::CarrySum => bytes.fold(initial, |sum, byte| {
            let sum = sum + byte;
            sum % (bits + 1) + sum / (bits + 1)
        }),
        Algorithm::SumWords => initial + words.sum::<u64>(),
        Algorithm::Xor => bytes.fold(initial, |xor, byte| xor ^ byte),
        Algorithm::XorWords => words.fold(initial, |xor, word| xor ^ word),
        Algorithm::Fletcher => {
            let (mut low, mut high) = (0, 0);
            for byte in covered {
                low = (low + u64::from(byte)) % 256;
                high = (high + low) % 256;
            }
            low + 256 * high
        }
        algorithm => panic!("unknown: {algorithm:?}"),
    };
    stored == (computed ^ u64::from(checksum.xor_out)) & bits
}

/// Computes a CRC bit by bit, as catalogues of CRCs define it.
fn remainder(crc: &Crc, bytes: &[u8]) -> u64 {
    let (width, mut register) = (crc.width, u64::from(crc.initial));
    for &byte in bytes {
        let byte = if crc.reflected_in {
            byte.reverse_bits()
        } else {
            byte
        };
        for bit in (0..8).rev() {
            let is_odd = (register >> (width - 1) ^ u64::from(byte) >> bit) & 1 == 1;
            register = register << 1 & ((1 << width) - 1);
            if is_odd {
                register ^= u64::from(crc.polynomial);
            }
        }
    }
    if crc.reflected_out {
        register = register.reverse_bits() >> (64 - width);
    }
    register ^ u64::from(crc.xor_out)
}
