//! Tests random layouts against the interpreter of layouts. Counts the properties of the layouts, each of which must
//! occur.
#![expect(clippy::cast_possible_truncation, reason = "frames are short")]

use std::collections::BTreeSet;
use std::ops::Range;

use framelock::{Classification::Frame, LineEvent};
use framelock_formats::AnyOf;
use framelock_formats::layout::*;
use framelock_oracles::{
    LONGEST, Occurred, Stream, StreamStep, cut, faulty, interpret_before, layouts,
    other_terminators, random_frame,
};
use rand::seq::{IndexedRandom as _, SliceRandom as _};
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// Bytes that no layout lists as content. If a layout restricts the content, its terminators begin with these bytes.
const RESERVED: [u8; 4] = [0x04, b'\n', b'\r', 0xF1];

/// Returns distinct patterns of this length. They begin with bytes of `first`, and often contain more of these bytes.
fn patterns(
    random: &mut ChaCha8Rng,
    count: usize,
    length: usize,
    first: &[u8],
) -> Patterns<'static> {
    let mut all = BTreeSet::new();
    while all.len() < count {
        let one = (0..length).map(|place| match first.choose(random) {
            Some(&byte) if place == 0 || random.random() => byte,
            _ => random.random(),
        });
        all.insert(one.collect::<Vec<u8>>());
    }
    let mut all = Vec::from_iter(all);
    all.shuffle(random);
    Patterns::any_of(all.concat().leak(), if count == 0 { 0 } else { length })
}

fn number(random: &mut ChaCha8Rng, at: usize) -> Number {
    let order = *[ByteOrder::Little, ByteOrder::Big]
        .choose(random)
        .expect("two");
    Number::new(at, random.random_range(1..=4), order)
}

fn length_field(random: &mut ChaCha8Rng, at: usize) -> LengthField {
    let masks = [u32::MAX, 0xFF, 0x3F, 0x1F7, 0x1F8];
    LengthField {
        number: number(random, at),
        mask: *masks.choose(random).expect("five"),
        factor: random.random_range(1..=4),
        plus: random.random_range(-3..=12),
    }
}

fn checksum(random: &mut ChaCha8Rng) -> Checksum<'static> {
    let bytes = random.random_range(1..=4);
    let (algorithm, bytes) = match random.random_range(0..10) {
        0 => (Algorithm::Sum, bytes),
        1 => (Algorithm::CarrySum, bytes),
        2 => (Algorithm::SumWords, bytes),
        3 => (Algorithm::Xor, 1),
        4 => (Algorithm::XorWords, 2),
        5 => (Algorithm::Fletcher, 2),
        6 => (
            Algorithm::Crc(Crc {
                reflected_in: true,
                reflected_out: true,
                initial: 0xFFFF,
                ..Crc::new(16, 0x1021)
            }),
            2,
        ),
        _ => {
            let width = *[8, random.random_range(8..=32)]
                .choose(random)
                .expect("two");
            let bits = u32::MAX >> (32 - width);
            let crc = Crc {
                initial: random.random::<u32>() & bits,
                xor_out: random.random::<u32>() & bits,
                reflected_in: random.random(),
                reflected_out: random.random(),
                ..Crc::new(width, random.random::<u32>() & bits | 1)
            };
            let table = match random.random_range(0..3) {
                0 if width == 8 => Table::Bytes(Box::leak(Box::new(crc.table_of_bytes()))),
                0 | 1 => Table::Words(Box::leak(Box::new(crc.table_of_words()))),
                _ => Table::None,
            };
            (
                Algorithm::Crc(Crc { table, ..crc }),
                width.div_ceil(8) as usize,
            )
        }
    };
    let encodings = [Encoding::Little, Encoding::Big, Encoding::Hex];
    let encoding = *encodings.choose(random).expect("three");
    let is_sum = !matches!(algorithm, Algorithm::Crc(_) | Algorithm::Fletcher);
    Checksum {
        algorithm,
        encoding,
        initial: random.random_range(0..=0xFF) * u32::from(is_sum),
        xor_out: *[0, 0xFF, u32::MAX].choose(random).expect("three"),
        over_hex_digits: is_sum && random.random_ratio(1, 4),
        ..Checksum::at_the_end(bytes)
    }
}

/// Returns 1 to 5 known messages, and the position of their number.
fn messages(random: &mut ChaCha8Rng, at: usize) -> Messages<'static> {
    let number = number(random, at);
    let most = u32::MAX >> (32 - 8 * number.bytes);
    let count = random.random_range(1..=5);
    let known: BTreeSet<u32> = (0..count).map(|_| random.random_range(0..=most)).collect();
    let known = known.into_iter().map(|number| {
        let mut message = KnownMessage::new(number);
        if random.random() {
            message.extra = Some(random.random());
        }
        if random.random() {
            message.longest_payload = random.random_range(4..30);
        }
        message
    });
    let known = known.collect::<Vec<_>>().leak();
    Messages { number, known }
}

/// The ranges of the content's bytes, and other terminators.
type Content = (&'static [(u8, u8)], [Patterns<'static>; 2]);

/// Returns ranges of content bytes, and 0 to 4 other terminators. The other terminators have up to two lengths. Both
/// differ from `terminator`, which is the length of the layout's own terminators.
fn content(random: &mut ChaCha8Rng, terminator: usize) -> Content {
    let ranges: [&[(u8, u8)]; 3] = [
        &[(b' ', b'~')],
        &[(b'0', b'~'), (b' ', b'$')],
        &[(14, 0xF0), (5, 9), (0, 3), (11, 12), (0xF2, 0xFF)],
    ];
    let mut lengths = vec![1, 2, 3, 4];
    lengths.retain(|&length| length != terminator);
    lengths.shuffle(random);
    let others = [lengths[0], lengths[1]];
    let others = others.map(|length| {
        let count = random.random_range(0..=2);
        patterns(random, count, length, &RESERVED)
    });
    (ranges.choose(random).expect("three"), others)
}

/// Returns 0 to 4 masks with their fixed bits. Each is in a byte of the header, in one of the first two bytes of the
/// payload, or in one of its last two bytes. The payload begins at index `body`, and `from_end` bytes follow it.
fn fixed_bits(
    random: &mut ChaCha8Rng,
    header: Range<usize>,
    body: usize,
    from_end: usize,
) -> &'static [FixedBits] {
    let fixed = (0..random.random_range(0..=4)).map(|_| {
        let at = match random.random_range(0..4) {
            0 => -offset(from_end) - random.random_range(1..=2),
            1 => offset(body) + random.random_range(0..=1),
            _ => offset(random.random_range(header.clone())),
        };
        let mask = mask(random, 8);
        let value = random.random::<u8>() & mask;
        FixedBits { at, mask, value }
    });
    fixed.collect::<Vec<_>>().leak()
}

/// Returns a random layout, or `None` if its parts contradict each other.
fn layout(random: &mut ChaCha8Rng) -> Option<CheckedLayout<'static>> {
    let form = random.random_range(0..4);
    let has_content = form == 3;
    let all: Vec<u8> = (0..=u8::MAX).collect();
    let any: Vec<u8> = all.choose_multiple(random, 8).copied().collect();
    let (syncs, sync_length) = (random.random_range(0..=8), random.random_range(1..=4));
    let sync = patterns(random, syncs, sync_length, &any);
    let mut layout = Layout::NONE;
    layout.sync = sync;

    // The parts of the header follow one another in any order, some of them after a gap.
    let (mut at, mut field, mut trailer) = (sync.length, None, 0);
    let mut parts = [0, 1, 2, 3];
    parts.shuffle(random);
    for part in parts {
        at += random.random_range(0_usize..4).saturating_sub(2);
        match part {
            0 if form == 1 => {
                let length = length_field(random, at);
                at += length.number.bytes;
                field = Some(length);
            }
            1 if random.random() => {
                let messages = messages(random, at);
                at = messages.number.end();
                layout.messages = Some(messages);
            }
            2 if form == 1 && random.random() => {
                trailer = random.random_range(1..=5);
                layout.trailer = Some(Trailer {
                    at,
                    mask: mask(random, 4),
                    bytes: trailer,
                });
                at += 1;
            }
            _ => {}
        }
    }
    let header = at.max(1);
    let mut end = 0;
    if form >= 2 || random.random() {
        let (count, length) = (random.random_range(1..=4), random.random_range(1..=3));
        let first = if has_content { &RESERVED[..] } else { &any };
        layout.terminator = patterns(random, count, length, first);
        end = length;
    }
    if has_content {
        (layout.content, layout.other_terminators) = content(random, end);
    }

    if form == 2 || has_content && layout.other_terminators == [Patterns::NONE; 2] {
        layout.behind = random.random_range(0_usize..8).saturating_sub(3);
        end += layout.behind;
    }

    // `body` is the number of bytes before the payload, and `from_end` the number of bytes after it. The checksum is
    // directly before the payload, directly after it, or among the bytes behind the terminator.
    let (mut body, mut from_end) = (header, end);
    if syncs == 0 && end == 0 || random.random_range(0..4) > 0 {
        let mut checksum = checksum(random);
        if has_content {
            checksum.encoding = Encoding::Hex;
        }
        let bytes = checksum.encoded_bytes();
        (checksum.at, checksum.from, checksum.to) = if layout.behind >= bytes {
            let (at, from) = (-offset(layout.behind), offset(sync.length));
            (at, from, at - 1)
        } else if random.random() {
            let covers_terminator = random.random() && !has_content;
            let to = -1 - if covers_terminator { 0 } else { offset(end) };
            let (at, from) = (offset(body), offset(body + bytes));
            body += bytes;
            (at, from, to)
        } else {
            from_end += bytes;
            let from = *[0, sync.length, header].choose(random).expect("three");
            let at = -offset(from_end);
            (at, offset(from), at - 1)
        };
        layout.checksum = Some(checksum);
    }
    let header = sync.length..header.max(sync.length + 1);
    layout.fixed = fixed_bits(random, header, body, from_end);
    let least = body + from_end + 2;
    layout.longest = least + random.random_range(0..24);
    match field {
        Some(field) => {
            let counted = field.value(u32::MAX >> (32 - 8 * field.number.bytes));
            let most = u64::from(counted) * u64::from(field.factor);
            let most = most.saturating_add_signed(field.plus.into());
            layout.longest = trailer + most.min(layout.longest as u64) as usize;
            layout.length = Length::Field(field);
        }
        None if form == 0 && random.random() => layout.length = Length::Silence,
        None if form == 0 => {}
        None => layout.length = Length::Delimiter,
    }
    layout.shortest = if layout.length == Length::Fixed || random.random_ratio(1, 3) {
        0
    } else {
        least + random.random_range(0..3)
    };
    let checked = layout.check().ok();
    checked.filter(|layout| layout.longest <= LONGEST && !has_fixed_bits_in_the_checksum(layout))
}

/// Returns true if some fixed bits are in the checksum. Such a layout has too few frames for the test.
fn has_fixed_bits_in_the_checksum(layout: &Layout) -> bool {
    let Some(checksum) = layout.checksum else {
        return false;
    };
    (layout.shortest..=layout.longest).any(|length| {
        let from = index(checksum.at, length).unwrap_or(0);
        let place = from..from + checksum.encoded_bytes();
        let mut fixed = layout.fixed.iter();
        fixed.any(|bits| index(bits.at, length).is_some_and(|at| place.contains(&at)))
    })
}

fn offset(bytes: usize) -> i16 {
    i16::try_from(bytes).expect("frames are short")
}

/// Returns a mask of 1 to `most` bits.
fn mask(random: &mut ChaCha8Rng, most: usize) -> u8 {
    let mut mask = 0;
    for _ in 0..random.random_range(1..=most) {
        mask |= 1 << random.random_range(0..8);
    }
    mask
}

/// Counts each condition under its name. If a range is given, counts the condition for each value in the range.
macro_rules! count {
    ($occurred:ident; $($name:literal $(in $range:expr)?, $is:expr;)*) => {
        $(count!(@ $occurred, $name, $($range,)? $is);)*
    };
    (@ $occurred:ident, $name:literal, $range:expr, $is:expr) => {
        for value in $range {
            $occurred.count(format!("{}: {value:?}", $name).leak(), $is(value));
        }
    };
    (@ $occurred:ident, $name:literal, $is:expr) => {
        $occurred.count($name, $is);
    };
}

/// Counts each property that the layout and its frames have, for example two syncs. The frames were delivered.
fn count(layout: &Layout, frames: &[Vec<u8>], occurred: &mut Occurred) {
    let starts = |pattern: &[u8]| frames.iter().any(|frame| frame.starts_with(pattern));
    let ends = |pattern: &[u8]| frames.iter().any(|frame| frame.ends_with(pattern));
    let (sync, terminator, content) = (layout.sync, layout.terminator, layout.content);
    let (others, length, fixed) = (other_terminators(layout), layout.length, layout.fixed);
    let field = match length {
        Length::Field(field) => Some(field),
        _ => None,
    };
    let header = offset(layout.header());
    let fixed_in = |range: &dyn Fn(i16) -> bool| fixed.iter().filter(|bits| range(bits.at)).count();
    let messages = layout.messages;
    let known = messages.map_or(&[][..], |messages| messages.known);
    let is = |number: Option<Number>, wanted| number.map(|it| (it.bytes, it.order)) == Some(wanted);
    let numbers =
        [ByteOrder::Little, ByteOrder::Big].map(|order| (1..=4).map(move |bytes| (bytes, order)));
    let numbers: Vec<(usize, ByteOrder)> = numbers.into_iter().flatten().collect();
    let trailer = layout.trailer;
    let bits = |frame: &[u8]| trailer.map_or(0, |it| (frame[it.at] & it.mask).count_ones());
    let checksum = layout.checksum;
    let encodings = [Encoding::Little, Encoding::Big, Encoding::Hex];
    let encodings = encodings.map(|encoding| (1..=4).map(move |bytes| (bytes, encoding)));
    let algorithm = checksum.map(|checksum| checksum.algorithm);
    let crc = match algorithm {
        Some(Algorithm::Crc(crc)) => Some(crc),
        _ => None,
    };
    count! { occurred;
        "syncs" in 0..=8, |count| sync.each().count() == count;
        "bytes of a sync" in 1..=4, |bytes| sync.length == bytes;
        "sync with the index" in 0..=7, |index| sync.each().nth(index).is_some_and(starts);
        "terminators" in 0..=4, |count| terminator.each().count() == count;
        "bytes of a terminator" in 1..=3, |bytes| terminator.length == bytes;
        "terminator with the index" in 0..=3, |index| terminator.each().nth(index).is_some_and(ends);
        "other terminators" in 1..=4, |count| others.len() == count;
        "other terminator with the index" in 0..=3, |index: usize| others.get(index).is_some_and(|end| ends(end));
        "terminators that end alike", others.iter().any(|end| ends(end) && terminator.each().any(|one| {
            one.ends_with(end) && ends(one) || end.ends_with(one)
        }));
        "ranges of content" in [1, 2, 5], |count| content.len() == count;
        "fixed length", length == Length::Fixed;
        "silence", length == Length::Silence;
        "bytes behind the terminator" in 1..=4, |count| layout.behind == count;
        "checksum behind the terminator", checksum.is_some_and(|it| it.at < 0 && layout.behind >= usize::from(it.at.unsigned_abs()));
        "checksum with a first value", checksum.is_some_and(|it| it.initial > 0);
        "checksum with a final XOR" in [0xFF, u32::MAX], |xor| checksum.is_some_and(|it| it.xor_out == xor);
        "checksum over digits", checksum.is_some_and(|it| it.over_hex_digits);
        "delimiter without a content", length == Length::Delimiter && content.is_empty();
        "length field" in &numbers, |&form| is(field.map(|it| it.number), form);
        "mask of a length" in [0x3F, 0x1F7, 0x1F8], |mask| field.is_some_and(|it| it.mask == mask);
        "two lengths with a mask that is shifted", trailer.is_none() && field.is_some_and(|it| it.mask == 0x1F8)
            && frames.iter().any(|frame| frame.len() != frames[0].len());
        "factor of a length" in 1..=4, |factor| field.is_some_and(|it| it.factor == factor);
        "correction of a length" in -3..=12, |plus| field.is_some_and(|it| it.plus == plus);
        "longest frame of several lengths", length != Length::Fixed && frames.iter().any(|frame| frame.len() == layout.longest);
        "messages" in 0..=5, |count| known.len() == count;
        "number of a message" in &numbers, |&form| is(messages.map(|it| it.number), form);
        "message with an extra byte", checksum.is_some() && known.iter().any(|it| it.extra.is_some());
        "message with a longest payload", field.is_some() && known.iter().any(|it| it.longest_payload < 30);
        "fixed bits" in 0..=4, |count| fixed.len() == count;
        "fixed bits in the header" in 1..=3, |count| fixed_in(&|at| 0 <= at && at < header) == count;
        "fixed bits after the header" in 1..=3, |count| fixed_in(&|at| header <= at) == count;
        "fixed bits from the end" in 1..=3, |count| fixed_in(&|at| at < 0) == count;
        "fixed bits of one byte" in 2..=3, |count| fixed.iter().any(|bits| fixed_in(&|at| at == bits.at) == count);
        "bytes of a trailer" in 1..=5, |bytes| trailer.is_some_and(|it| it.bytes == bytes);
        "bits that announce a trailer" in 1..=4, |count| trailer.is_some_and(|it| it.mask.count_ones() == count);
        "bits of several that are set" in 0..=1, |count| {
            trailer.is_some_and(|it| it.mask.count_ones() > 1) && frames.iter().any(|frame| bits(frame) == count)
        };
        "no checksum", checksum.is_none();
        "checksum" in encodings.into_iter().flatten(), |form| checksum.map(|it| (it.bytes, it.encoding)) == Some(form);
        "checksum before what it covers", checksum.is_some_and(|it| it.at >= 0);
        "checksum after the whole frame", checksum.is_some_and(|it| it.at < 0 && it.from == 0);
        "checksum after a part of the frame", checksum.is_some_and(|it| it.at < 0 && it.from > 0);
        "checksum that covers the terminator", checksum.is_some_and(|it| it.to == -1 && terminator.length > 0);
        "algorithm" in [
            Algorithm::Sum, Algorithm::CarrySum, Algorithm::SumWords, Algorithm::Xor, Algorithm::XorWords,
            Algorithm::Fletcher,
        ], |one| algorithm == Some(one);
        "MAVLink's CRC", crc.is_some_and(|it| it.polynomial == 0x1021);
        "bits of a CRC modulo 8" in 0..8, |bits| crc.is_some_and(|it| it.width % 8 == bits);
        "no table", crc.is_some_and(|it| it.table == Table::None);
        "table of bytes", crc.is_some_and(|it| matches!(it.table, Table::Bytes(_)));
        "table of words", crc.is_some_and(|it| matches!(it.table, Table::Words(_)));
        "reflected" in [(false, false), (false, true), (true, false), (true, true)], |both| {
            crc.is_some_and(|it| (it.reflected_in, it.reflected_out) == both)
        };
    }
}

/// Whatever parts a layout has, its receivers deliver its frames and nothing else.
#[test]
fn frames_of_any_layout_are_delivered() {
    let (mut random, mut occurred) = (ChaCha8Rng::seed_from_u64(1), Occurred::NOTHING);
    let mut layouts_with_frames = 0;
    while layouts_with_frames < 2_000 {
        let Some(layout) = layout(&mut random) else {
            continue;
        };
        let all: &'static [CheckedLayout] = vec![layout].leak();
        let tries = (0..60).filter_map(|_| random_frame(&layout, &mut random).ok());
        let frames: Vec<Vec<u8>> = tries.take(12).collect();
        if frames.is_empty() {
            continue;
        }
        layouts_with_frames += 1;
        let mut example = vec![0; layout.longest];
        let example = layout.example(&mut example);
        let example = example.unwrap_or_else(|why| panic!("{why:?}: {layout:?}"));
        assert_eq!(
            interpret_before(&layout, example, LineEvent::Idle),
            Frame(example.len())
        );
        let idle = vec![StreamStep::Event(LineEvent::Idle)];
        let clean: Vec<StreamStep> = if layout.length == Length::Silence {
            let frames = frames.iter().map(|frame| cut(frame, &mut random));
            frames
                .flat_map(|steps| [steps, idle.clone()].concat())
                .collect()
        } else {
            cut(&frames.concat(), &mut random)
        };
        let noisy = cut(&faulty(&frames, &mut random), &mut random);
        let stream = Stream(clean.clone());
        let counters = layouts(&AnyOf(all), all, &stream, &mut Occurred::default());
        let is_clean = counters.frames as usize == frames.len() && counters.discarded.total() == 0;
        assert!(is_clean, "{counters:?} {layout:?}");
        let stream = Stream([noisy, idle, clean].concat());
        layouts(&AnyOf(all), all, &stream, &mut occurred);
        count(&layout, &frames, &mut occurred);
    }
    let impossible = [
        "break",
        "broken stuffing",
        "framing error",
        "overrun",
        "parity error",
    ];
    assert_eq!(occurred.rarer_than(3), impossible, "{occurred:#?}");
}
