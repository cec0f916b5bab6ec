//! Makes frames of any layout.

use std::iter::repeat_with;

use framelock::{Classification::Frame, LineEvent};
use framelock_formats::layout::{
    ByteOrder, CheckedLayout, Encoding, Layout, Length, Messages, Patterns,
};
use rand::Rng;
use rand::seq::IndexedRandom as _;

use crate::layout::{interpret_before, place};

/// Fills a frame with the content, and lets the layout seal the frame. Replaces bytes that the layout does not allow as
/// content. `choose` chooses a number below its argument. It chooses among several syncs, messages, terminators and
/// bits of a trailer, and chooses the bytes that are not in the content.
///
/// # Errors
/// If the layout cannot seal the bytes, returns them. They are almost a frame.
///
/// # Panics
/// Panics if the layout's `seal` and the [interpreter](crate::interpret) disagree about whether the sealed bytes are a
/// frame, or if `seal` changes bits that the layout does not determine.
pub fn frame(
    layout: &CheckedLayout,
    content: &[u8],
    mut choose: impl FnMut(usize) -> usize,
) -> Result<Vec<u8>, Vec<u8>> {
    let sync = any(layout.sync, &mut choose);
    let end = any(layout.terminator, &mut choose);
    let message = layout.messages.map(|Messages { number, known }| {
        let known = known[choose(known.len())].number;
        let bytes = match number.order {
            ByteOrder::Little => known.to_le_bytes()[..number.bytes].to_vec(),
            ByteOrder::Big => known.to_be_bytes()[4 - number.bytes..].to_vec(),
        };
        (number.at, bytes)
    });
    // If the layout has a trailer, two of three frames carry it. One bit announces the trailer.
    let announced = layout.trailer.filter(|_| choose(3) > 0);
    let bit = announced.map_or(0, |trailer| {
        let bits = (0..8).map(|bit| 1 << bit);
        let bits: Vec<u8> = bits.filter(|bit| bit & trailer.mask != 0).collect();
        bits[choose(bits.len())]
    });
    let trailer = announced.map_or(0, |trailer| trailer.bytes);

    let checksum = layout.checksum.filter(|checksum| checksum.at < 0);
    let tail = end.len() + layout.behind + checksum.map_or(0, |checksum| checksum.encoded_bytes());
    let wanted = (layout.header() + content.len() + tail).max(layout.shortest);
    let length = match layout.length {
        Length::Fixed => layout.longest,
        // The next length that the field can state.
        Length::Field(field) => {
            let (plus, factor) = (i128::from(field.plus), i128::from(field.factor));
            let is_stated = |length: &usize| (*length as i128 - plus) % factor == 0;
            (wanted..=layout.longest).find(is_stated).unwrap_or(wanted)
        }
        _ => wanted,
    };
    let length = length.min(layout.longest - trailer);
    let header = (0..layout.header()).map(|_| byte(&mut choose));
    let mut frame: Vec<u8> = header.chain(content.iter().copied()).collect();
    frame.extend(repeat_with(|| byte(&mut choose)).take(layout.longest));
    frame.truncate(length + trailer);
    let allowed: Vec<u8> = (0..=u8::MAX)
        .filter(|&byte| is_content(layout, byte))
        .collect();
    for byte in &mut frame {
        if !is_content(layout, *byte) {
            *byte = allowed[usize::from(*byte) % allowed.len()];
        }
    }
    write(&mut frame, 0, sync);
    if let Some((at, number)) = &message {
        write(&mut frame, *at, number);
    }
    if let Some(trailer) = layout.trailer {
        frame[trailer.at] = frame[trailer.at] & !trailer.mask | bit;
    }
    let end_at = length.saturating_sub(end.len() + layout.behind);
    write(&mut frame, end_at, end);
    if let Some(checksum) = layout.checksum.filter(|checksum| checksum.over_hex_digits) {
        for byte in &mut frame[place(checksum.from, length)..=place(checksum.to, length)] {
            *byte = b"0123456789abcDEF"[usize::from(*byte % 16)];
        }
    }

    let before = frame.clone();
    let is_sealed = layout.seal(&mut frame);
    let is_frame = is_whole(layout, &frame);
    assert_eq!(is_sealed, is_frame, "{layout:?}: {frame:02X?}");
    if !is_sealed {
        return Err(frame);
    }
    let counted = layout.counted_length(&frame[..length]);
    for (at, (before, after)) in before.iter().zip(&frame).enumerate() {
        let others = !determined(layout, at, counted);
        assert_eq!(
            before & others,
            after & others,
            "byte {at}, {layout:?}: {frame:02X?}"
        );
    }

    if let Some(checksum) = layout.checksum
        && checksum.encoding == Encoding::Hex
        && choose(2) == 1
    {
        let mut other = frame.clone();
        other[place(checksum.at, counted)..][..checksum.encoded_bytes()].make_ascii_lowercase();
        // A lower-case digit may be a terminator. Then the bytes are no longer this frame.
        if is_whole(layout, &other) {
            frame = other;
        }
    }
    let others = other_terminators(layout);
    if !others.is_empty() && choose(2) == 1 {
        let other = others[choose(others.len())];
        if end_at + other.len() <= layout.longest {
            frame.truncate(end_at);
            frame.extend(other);
        }
    }
    Ok(frame)
}

/// Makes a frame with a random content, which often contains bytes of a sync or of a terminator.
///
/// # Errors
/// As for [`frame`].
pub fn random_frame(layout: &CheckedLayout, random: &mut impl Rng) -> Result<Vec<u8>, Vec<u8>> {
    let known = [layout.sync.bytes, layout.terminator.bytes].concat();
    let count = random.random_range(0..=layout.longest.min(60));
    let content = (0..count).map(|_| match known.choose(random) {
        Some(&byte) if random.random_ratio(1, 4) => byte,
        _ => random.random(),
    });
    let content: Vec<u8> = content.collect();
    frame(layout, &content, |count| random.random_range(0..count))
}

/// Returns the layout's terminators except those of its field `terminator`.
pub fn other_terminators<'a>(layout: &Layout<'a>) -> Vec<&'a [u8]> {
    let own = layout.terminator.each().count();
    layout.terminators().skip(own).collect()
}

/// Returns true if the bytes are a frame when silence follows them.
fn is_whole(layout: &Layout, bytes: &[u8]) -> bool {
    interpret_before(layout, bytes, LineEvent::Idle) == Frame(bytes.len())
}

fn any(patterns: Patterns<'_>, mut choose: impl FnMut(usize) -> usize) -> &[u8] {
    let all: Vec<&[u8]> = patterns.each().collect();
    if all.is_empty() {
        &[]
    } else {
        all[choose(all.len())]
    }
}

fn byte(mut choose: impl FnMut(usize) -> usize) -> u8 {
    choose(256).to_le_bytes()[0]
}

fn is_content(layout: &Layout, byte: u8) -> bool {
    let mut ranges = layout.content.iter();
    ranges.len() == 0 || ranges.any(|&(first, last)| (first..=last).contains(&byte))
}

fn write(frame: &mut [u8], at: usize, bytes: &[u8]) {
    let place = frame.iter_mut().skip(at);
    place.zip(bytes).for_each(|(byte, wanted)| *byte = *wanted);
}

/// Returns a mask of the bits that the layout determines in the byte at this index.
fn determined(layout: &Layout, at: usize, counted: usize) -> u8 {
    let is_within = |from: usize, count: usize| (from..from + count).contains(&at);
    let end = layout.terminator.length;
    if is_within(0, layout.sync.length)
        || matches!(layout.length, Length::Field(field) if is_within(field.number.at, field.number.bytes))
        || is_within(counted - end - layout.behind, end)
        || layout.checksum.is_some_and(|checksum| {
            is_within(place(checksum.at, counted), checksum.encoded_bytes())
        })
    {
        return u8::MAX;
    }
    let bits = layout.fixed.iter();
    let bits = bits.filter(|bits| place(bits.at, counted) == at);
    bits.fold(0, |mask, bits| mask | bits.mask)
}
