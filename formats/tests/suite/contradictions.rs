//! Tests the check of layouts. For each contradiction, it must return an error that names the wrong part. Every layout
//! that passes the check must have frames.

use std::collections::BTreeMap;

use framelock::{BufferedReceiver, Format};
use framelock_formats::layout::{
    Algorithm, ByteOrder, Checksum, Crc, Encoding, FixedBits, KnownMessage, Layout, LayoutBuilder,
    Length, LengthField, Messages, Number, Part, Patterns, Table, Trailer,
};
use framelock_formats::mavlink::{ARDUPILOTMEGA, COMMON, layout_v1, layout_v2};
use framelock_formats::motion::BIN_CRC8;
use framelock_formats::{AnyOf, crsf, nmea, rtcm, sbus, ubx};

/// `'A' 'B' length payload checksum`.
const COUNTED: LayoutBuilder = Layout::builder()
    .sync(Patterns::one(b"AB"))
    .length(Length::Field(LengthField::byte(2).plus(4)))
    .longest(20)
    .checksum(CHECKSUM);
const CHECKSUM: Checksum = Checksum::at_the_end(1).from(2);

/// `'A' 'B' checksum`, then bytes that the checksum covers.
const AT_2: LayoutBuilder = Layout::builder()
    .sync(Patterns::one(b"AB"))
    .longest(8)
    .checksum(Checksum::at_the_end(1).at(2).from(3).to(-1));

/// `'A'`, 9 bytes, a line feed.
const FIXED: LayoutBuilder = Layout::builder()
    .sync(Patterns::one(b"A"))
    .longest(11)
    .terminator(Patterns::one(b"\n"));
const LINE: LayoutBuilder = FIXED.length(Length::Delimiter);

const TEXT: LayoutBuilder = LINE.content(&[(b' ', b'~')]);
const DIGITS: Checksum = Checksum::at_the_end(1)
    .encoding(Encoding::Hex)
    .at(-3)
    .to(-4);

const fn field(field: LengthField) -> LayoutBuilder<'static> {
    COUNTED.length(Length::Field(field))
}

const fn sum(checksum: Checksum<'static>) -> LayoutBuilder<'static> {
    COUNTED.checksum(checksum)
}

const fn crc(bytes: usize, crc: Crc<'static>) -> LayoutBuilder<'static> {
    sum(Checksum::at_the_end(bytes).algorithm(Algorithm::Crc(crc)))
}

const fn known(known: &'static [KnownMessage]) -> LayoutBuilder<'static> {
    COUNTED.messages(Messages::new(Number::byte(3), known))
}

const KNOWN: [KnownMessage; 3] = [
    KnownMessage::new(7),
    KnownMessage::new(8),
    KnownMessage::new(300),
];
const BYTES: [u8; 256] = Crc::new(8, 7).table_of_bytes();
const WORDS: [u32; 256] = Crc::new(16, 7).table_of_words();

/// Each entry has a layout that contradicts itself, the part that the error must name, the beginning of the error's
/// message, and a similar layout without the contradiction.
#[rustfmt::skip]
const CONTRADICTIONS: &[(LayoutBuilder, Part, &str, LayoutBuilder)] = &[
    (COUNTED.sync(Patterns::any_of(b"ABC", 2)), Part::Sync, "sync: its bytes must be one pattern or more", COUNTED.sync(Patterns::any_of(b"ABCD", 2))),
    (COUNTED.sync(Patterns::any_byte_of(b"")), Part::Sync, "sync: its bytes must be one pattern or more", COUNTED.sync(Patterns::any_byte_of(b"A"))),
    (COUNTED.sync(Patterns::any_of(b"A", 0)), Part::Sync, "sync: its bytes must be one pattern or more", COUNTED.sync(Patterns::NONE)),
    (FIXED.terminator(Patterns::any_of(b"ABC", 2)), Part::Terminator, "terminator: its bytes must be one pattern or more", FIXED.terminator(Patterns::any_of(b"ABCD", 2))),
    (Layout::builder().longest(4), Part::Sync, "sync: nothing tells a frame from noise", Layout::builder().longest(4).checksum(Checksum::at_the_end(1))),
    (Layout::builder().longest(4), Part::Sync, "sync: nothing tells a frame from noise", Layout::builder().longest(4).terminator(Patterns::one(b"\n"))),
    (COUNTED.length(Length::Delimiter), Part::Terminator, "terminator: a delimiter ends each frame", LINE),
    (field(LengthField::new(Number::new(2, 0, ByteOrder::Big))), Part::Length, "length: the length field must have 1 to 4", field(LengthField::new(Number::new(2, 1, ByteOrder::Big)))),
    (field(LengthField::new(Number::new(2, 5, ByteOrder::Big))), Part::Length, "length: the length field must have 1 to 4", field(LengthField::new(Number::new(2, 4, ByteOrder::Big)))),
    (field(LengthField::byte(2).factor(0)), Part::Length, "length: with this mask or factor", field(LengthField::byte(2).factor(3))),
    (field(LengthField::byte(2).mask(0x100)), Part::Length, "length: with this mask or factor", field(LengthField::byte(2).mask(0x1F0))),
    (COUNTED.longest(0), Part::Longest, "longest: it is 0", COUNTED.longest(4)),
    (COUNTED.longest(3), Part::Longest, "longest: it is less than shortest", COUNTED.longest(4)),
    (COUNTED.shortest(40), Part::Longest, "longest: it is less than shortest", COUNTED.shortest(20)),
    (FIXED.longest(1), Part::Longest, "longest: the header and the terminator do not fit", FIXED.longest(2)),
    (LINE.longest(1), Part::Longest, "longest: it is less than shortest", LINE.sync(Patterns::NONE).longest(1)),
    (FIXED.shortest(10), Part::Shortest, "shortest: each frame has exactly longest bytes", FIXED.shortest(11)),
    (COUNTED.shortest(3), Part::Shortest, "shortest: a frame of this length has no room", COUNTED.shortest(4)),
    (field(LengthField::byte(2).plus(8)).shortest(7), Part::Shortest, "shortest: a frame of this length has no room", field(LengthField::byte(2).plus(8)).shortest(8)),
    (LINE.fixed(&[FixedBits::new(-3, 1, 1)]).shortest(3), Part::Shortest, "shortest: a frame of this length has no room", LINE.fixed(&[FixedBits::new(-3, 1, 1)]).shortest(4)),
    (COUNTED.longest(260), Part::Longest, "longest: it is more than the greatest length", COUNTED.longest(259)),
    (field(LengthField::byte(2).mask(7).factor(2).plus(6)).longest(21), Part::Longest, "longest: it is more than the greatest length", field(LengthField::byte(2).mask(7).factor(2).plus(6)).longest(20)),
    (field(LengthField::byte(2).factor(8)).shortest(9).longest(15), Part::Length, "length: no number that the length field can hold", field(LengthField::byte(2).factor(8)).shortest(9).longest(16)),
    (field(LengthField::byte(2).mask(0xF0)).shortest(5).longest(15), Part::Length, "length: no number that the length field can hold", field(LengthField::byte(2).mask(0xF8)).shortest(5).longest(15)),
    (COUNTED.fixed(&[FixedBits::new(2, 0xF0, 0x20)]), Part::Length, "length: no number that the length field can hold", COUNTED.fixed(&[FixedBits::new(2, 0xF0, 0x10)])),
    (COUNTED.fixed(&[FixedBits::new(2, 5, 5)]).shortest(8).longest(8), Part::Length, "length: no number that the length field can hold", COUNTED.fixed(&[FixedBits::new(2, 5, 5)]).shortest(8).longest(9)),
    (COUNTED.sync(Patterns::one(b"ABC")), Part::Length, "length: no number that the length field can hold", COUNTED.sync(Patterns::any_of(b"ABCAB\x09", 3))),
    (field(LengthField::byte(3).mask(0xF0)).shortest(5).messages(Messages::new(Number::byte(3), &KNOWN)), Part::Length, "length: no number that the length field can hold", field(LengthField::byte(3).mask(0x0F)).shortest(5).longest(15).messages(Messages::new(Number::byte(3), &KNOWN))),
    (known(&[KnownMessage::new(7).longest_payload(0)]), Part::Length, "length: no number that the length field can hold", known(&[KnownMessage::new(7).longest_payload(1)])),
    (COUNTED.messages(Messages::new(Number::new(3, 5, ByteOrder::Big), &KNOWN)), Part::Messages, "messages: the number must have 1 to 4", COUNTED.messages(Messages::new(Number::new(3, 4, ByteOrder::Big), &KNOWN))),
    (known(&[]), Part::Messages, "messages: none are known", known(&[KNOWN[0]])),
    (known(&[KNOWN[1], KNOWN[0]]), Part::Messages, "messages: the numbers are not in ascending order", known(&KNOWN)),
    (known(&[KNOWN[1], KNOWN[1]]), Part::Messages, "messages: the numbers are not in ascending order", known(&KNOWN)),
    (known(&[KNOWN[2]]), Part::Messages, "messages: no known number fits", known(&[KNOWN[1]])),
    (COUNTED.messages(Messages::new(Number::new(3, 3, ByteOrder::Big), &[KnownMessage::new(0x100_0000)])), Part::Messages, "messages: no known number fits", COUNTED.messages(Messages::new(Number::new(3, 3, ByteOrder::Big), &[KnownMessage::new(0xFF_FFFF)]))),
    (known(&KNOWN).fixed(&[FixedBits::new(3, 0xFF, 9)]), Part::Messages, "messages: no known number fits", known(&KNOWN).fixed(&[FixedBits::new(3, 0xFF, 8)])),
    (known(&KNOWN).sync(Patterns::one(b"AB\x01\x09")), Part::Messages, "messages: no known number fits", known(&KNOWN).sync(Patterns::one(b"AB\x01\x08"))),
    (COUNTED.trailer(Trailer::new(2, 0, 3)), Part::Trailer, "trailer: it must have 1 byte or more", COUNTED.trailer(Trailer::new(2, 1, 3))),
    (COUNTED.trailer(Trailer::new(2, 1, 0)), Part::Trailer, "trailer: it must have 1 byte or more", COUNTED.trailer(Trailer::new(2, 1, 1))),
    (FIXED.trailer(Trailer::new(2, 1, 3)), Part::Trailer, "trailer: only frames with a length field", COUNTED.trailer(Trailer::new(2, 1, 3))),
    (COUNTED.trailer(Trailer::new(2, 1, 17)), Part::Trailer, "trailer: the shortest frame with a trailer", COUNTED.trailer(Trailer::new(2, 1, 16))),
    (COUNTED.trailer(Trailer::new(9, 1, 3)).shortest(10), Part::Shortest, "shortest: a frame of this length has no room", COUNTED.trailer(Trailer::new(9, 1, 3)).shortest(11)),
    (FIXED.fixed(&[FixedBits::new(1, 0, 0)]), Part::Fixed(0), "fixed: the mask is 0", FIXED.fixed(&[FixedBits::new(1, 1, 0)])),
    (FIXED.fixed(&[FixedBits::new(1, 1, 3)]), Part::Fixed(0), "fixed: the mask is 0, or the value has bits", FIXED.fixed(&[FixedBits::new(1, 3, 3)])),
    (FIXED.fixed(&[FixedBits::new(1, 1, 1), FixedBits::new(11, 1, 1)]), Part::Fixed(1), "fixed: the shortest frame has no byte at this offset", FIXED.fixed(&[FixedBits::new(1, 1, 1), FixedBits::new(9, 1, 1)])),
    (FIXED.fixed(&[FixedBits::new(-12, 1, 1)]), Part::Fixed(0), "fixed: the shortest frame has no byte at this offset", FIXED.fixed(&[FixedBits::new(-11, 1, 1)])),
    (FIXED.fixed(&[FixedBits::new(2, 3, 1), FixedBits::new(-9, 2, 2)]), Part::Fixed(0), "fixed: other fixed bits", FIXED.fixed(&[FixedBits::new(2, 1, 1), FixedBits::new(-9, 2, 2)])),
    (FIXED.fixed(&[FixedBits::new(0, 1, 0)]), Part::Sync, "sync: the fixed bits at its offset", FIXED.fixed(&[FixedBits::new(0, 1, 1)])),
    (FIXED.fixed(&[FixedBits::new(-1, 1, 1)]), Part::Terminator, "terminator: the fixed bits at its offset", FIXED.fixed(&[FixedBits::new(-1, 1, 0)])),
    (LINE.shortest(5).fixed(&[FixedBits::new(3, 0xFF, b'\n')]), Part::Terminator, "terminator: the fixed bits or the message contain it", LINE.shortest(5).fixed(&[FixedBits::new(4, 0xFF, b'\n')])),
    (LINE.messages(Messages::new(Number::byte(1), &[KnownMessage::new(10)])), Part::Terminator, "terminator: the fixed bits or the message contain it", LINE.messages(Messages::new(Number::byte(1), &KNOWN))),
    (FIXED.content(&[(b' ', b'~')]), Part::Content, "content: only frames that a delimiter ends", TEXT),
    (TEXT.content(&[(b'~', b' ')]), Part::Content, "content: the first byte of a range", TEXT.content(&[(b'~', b'~')])),
    (TEXT.content(&[(b'\t', b'\n')]), Part::Content, "content: a terminator begins with a byte of the content", TEXT.content(&[(b'\t', b'\t')])),
    (TEXT.terminator(Patterns::any_byte_of(b"\nA")), Part::Content, "content: a terminator begins with a byte of the content", TEXT.terminator(Patterns::any_byte_of(b"\n\r"))),
    (TEXT.other_terminators(&[b"a\n"]), Part::Content, "content: a terminator begins with a byte of the content", TEXT.other_terminators(&[b"\rb"])),
    (LINE.other_terminators(&[b"\r\n"]), Part::OtherTerminators, "other terminators: without a content", TEXT.other_terminators(&[b"\r\n"])),
    (TEXT.other_terminators(&[b""]), Part::OtherTerminators, "other terminators: one has no bytes", TEXT.other_terminators(&[])),
    (TEXT.other_terminators(&[b"\r"]), Part::OtherTerminators, "other terminators: one is as long as the terminator", TEXT.terminator(Patterns::any_byte_of(b"\n\r"))),
    (TEXT.other_terminators(&[b"\n\r"]), Part::OtherTerminators, "other terminators: one begins with another one", TEXT.other_terminators(&[b"\r\n"])),
    (TEXT.fixed(&[FixedBits::new(-1, 1, 0)]), Part::Fixed(0), "fixed: in frames with a content, fixed bits must be before", TEXT.fixed(&[FixedBits::new(-2, 1, 0)])),
    (TEXT.fixed(&[FixedBits::new(-2, 0xE0, 0)]), Part::Fixed(0), "fixed: no byte of the content", TEXT.fixed(&[FixedBits::new(-2, 0xE0, 0x60)])),
    (TEXT.messages(Messages::new(Number::byte(1), &[KNOWN[0]])), Part::Messages, "messages: no known number fits", TEXT.messages(Messages::new(Number::byte(1), &[KnownMessage::new(0x30)]))),
    (TEXT.checksum(DIGITS.encoding(Encoding::Big).at(-2).to(-3)), Part::Checksum, "checksum: its bytes may be outside the content", TEXT.checksum(DIGITS)),
    (TEXT.checksum(DIGITS).content(&[(b'0', b'E')]), Part::Checksum, "checksum: its bytes may be outside the content", TEXT.checksum(DIGITS).content(&[(b'0', b'F')])),
    (TEXT.checksum(DIGITS.at(1).from(-2).to(-1)).shortest(5), Part::Checksum, "checksum: in frames with a content, it can only cover", TEXT.checksum(DIGITS.at(1).from(-2).to(-2)).shortest(5)),
    (sum(Checksum::at_the_end(0)), Part::Checksum, "checksum: it must have 1 to 4 bytes", sum(Checksum::at_the_end(1))),
    (sum(Checksum::at_the_end(5)), Part::Checksum, "checksum: it must have 1 to 4 bytes", sum(Checksum::at_the_end(4))),
    (sum(Checksum::at_the_end(2).algorithm(Algorithm::Xor)), Part::Checksum, "checksum: the algorithm needs another number", sum(Checksum::at_the_end(1).algorithm(Algorithm::Xor))),
    (sum(Checksum::at_the_end(1).algorithm(Algorithm::Fletcher)), Part::Checksum, "checksum: the algorithm needs another number", sum(Checksum::at_the_end(2).algorithm(Algorithm::Fletcher))),
    (crc(1, Crc::new(12, 7)), Part::Checksum, "checksum: the algorithm needs another number", crc(2, Crc::new(12, 7))),
    (crc(4, Crc::new(33, 7)), Part::Checksum, "checksum: the width of a CRC must be 8 to 32", crc(4, Crc::new(32, 7))),
    (crc(1, Crc::new(7, 7)), Part::Checksum, "checksum: the width of a CRC must be 8 to 32", crc(1, Crc::new(8, 7))),
    (crc(1, Crc::new(8, 0x107)), Part::Checksum, "checksum: the polynomial, the initial or", crc(2, Crc::new(9, 0x107))),
    (crc(1, Crc::new(8, 7).initial(0x100)), Part::Checksum, "checksum: the polynomial, the initial or", crc(1, Crc::new(8, 7).initial(0xFF))),
    (crc(1, Crc::new(8, 7).xor_out(0x100)), Part::Checksum, "checksum: the polynomial, the initial or", crc(1, Crc::new(8, 7).xor_out(0xFF))),
    (crc(1, Crc::new(8, 0)), Part::Checksum, "checksum: the polynomial is 0", crc(1, Crc::new(8, 1))),
    (crc(2, Crc::new(16, 7).table(Table::Bytes(&BYTES))), Part::Checksum, "checksum: a table of bytes is only for a CRC of 8", crc(1, Crc::new(8, 7).table(Table::Bytes(&BYTES)))),
    (crc(1, Crc::new(8, 9).table(Table::Bytes(&BYTES))), Part::Checksum, "checksum: the table belongs to another CRC", crc(1, Crc::new(8, 9).table(Table::Bytes(&Crc::new(8, 9).table_of_bytes())))),
    (crc(2, Crc::new(16, 7).reflected().table(Table::Words(&WORDS))), Part::Checksum, "checksum: the table belongs to another CRC", crc(2, Crc::new(16, 7).table(Table::Words(&WORDS)))),
    (crc(1, Crc::new(8, 7).reflected().table(Table::Bytes(&BYTES))), Part::Checksum, "checksum: the table belongs to another CRC", crc(1, Crc::new(8, 7).reflected().table(Table::Bytes(&Crc::new(8, 7).reflected().table_of_bytes())))),
    (sum(CHECKSUM.at(4)), Part::Checksum, "checksum: it is outside of the shortest", sum(CHECKSUM.at(3).to(2))),
    (sum(CHECKSUM.encoding(Encoding::Hex)), Part::Checksum, "checksum: it is outside of the shortest", sum(CHECKSUM.encoding(Encoding::Hex).at(-2).to(-3))),
    (FIXED.checksum(Checksum::at_the_end(1).at(-12)), Part::Checksum, "checksum: it is outside of the shortest", FIXED.checksum(Checksum::at_the_end(1).at(-2).to(-3))),
    (sum(CHECKSUM.to(-1)), Part::Checksum, "checksum: it covers itself", sum(CHECKSUM.to(-2))),
    (AT_2.checksum(CHECKSUM.at(2).from(3).to(8)), Part::Checksum, "checksum: the bytes that it covers", AT_2.checksum(CHECKSUM.at(2).from(3).to(7))),
    (sum(CHECKSUM.to(20)), Part::Checksum, "checksum: the bytes that it covers", sum(CHECKSUM.to(2))),
    (sum(CHECKSUM.from(4)).shortest(4), Part::Checksum, "checksum: the bytes that it covers", sum(CHECKSUM.from(3)).shortest(4)),
    (sum(CHECKSUM.from(-5)).shortest(4), Part::Checksum, "checksum: the bytes that it covers", sum(CHECKSUM.from(-4)).shortest(4)),
    (FIXED.checksum(Checksum::at_the_end(1)), Part::Checksum, "checksum: it overlaps", FIXED.checksum(Checksum::at_the_end(1).at(-2).to(-3))),
    (sum(CHECKSUM.at(1).from(3)).shortest(5), Part::Checksum, "checksum: it overlaps", sum(CHECKSUM.at(3).from(4).to(4)).shortest(5)),
    (sum(CHECKSUM.at(2).from(3)).shortest(5), Part::Checksum, "checksum: it overlaps", sum(CHECKSUM.at(3).to(2)).shortest(5)),
    (AT_2.length(Length::Field(LengthField::byte(2).plus(4))), Part::Checksum, "checksum: it overlaps", AT_2.length(Length::Field(LengthField::byte(3).plus(4)))),
    (AT_2.messages(Messages::new(Number::byte(2), &KNOWN)), Part::Checksum, "checksum: it overlaps", AT_2.messages(Messages::new(Number::byte(3), &KNOWN))),
    (known(&KNOWN).checksum(CHECKSUM.at(3).to(2)).shortest(5), Part::Checksum, "checksum: it overlaps", known(&KNOWN).checksum(CHECKSUM.at(4).to(3)).shortest(5)),
    (sum(CHECKSUM.at(3).to(2)).trailer(Trailer::new(3, 1, 3)), Part::Checksum, "checksum: it overlaps", sum(CHECKSUM.at(3).to(2)).trailer(Trailer::new(2, 1, 3))),
    (sum(CHECKSUM.at(3).to(2)).trailer(Trailer::new(3, 1, 3)), Part::Checksum, "checksum: it overlaps", sum(CHECKSUM.at(3).to(2)).trailer(Trailer::new(4, 1, 3))),
    (COUNTED.fixed(&[FixedBits::new(-1, 1, 1)]), Part::Checksum, "checksum: it overlaps", COUNTED.fixed(&[FixedBits::new(-2, 1, 1)])),
    (AT_2.fixed(&[FixedBits::new(2, 1, 1)]), Part::Checksum, "checksum: it overlaps", AT_2.fixed(&[FixedBits::new(3, 1, 1)])),
];

#[test]
fn each_contradiction_is_an_error_that_names_its_part() {
    for (number, (wrong, part, message, right)) in CONTRADICTIONS.iter().enumerate() {
        let told = wrong
            .build()
            .expect_err(&format!("case {number} is wrong: {message}"));
        assert!(
            told.part() == *part && told.to_string().starts_with(message),
            "case {number} is {part:?}, {message}: {told:?}"
        );
        assert!(
            delivers(
                &right
                    .build()
                    .unwrap_or_else(|told| panic!("case {number} is right: {told}"))
            ),
            "case {number}"
        );
    }
    let told = FIXED
        .fixed(&[FixedBits::new(1, 1, 3)])
        .build()
        .expect_err("3 has more bits than 1");
    assert!(
        told.to_string().ends_with(" (fixed bits with index 0)")
            && !told.message().contains("index")
    );
}

#[test]
fn shipped_layouts_have_frames() {
    let mavlink = [
        layout_v1(COMMON),
        layout_v2(COMMON),
        layout_v2(ARDUPILOTMEGA),
    ];
    let others = [
        BIN_CRC8,
        crsf::LAYOUT,
        nmea::LAYOUT,
        rtcm::LAYOUT,
        sbus::LAYOUT,
        ubx::LAYOUT,
    ];
    for layout in mavlink.iter().chain(&others) {
        assert_eq!(layout.to_builder().build().as_ref(), Ok(layout));
        assert!(delivers(layout), "{layout:?}");
    }
}

/// Returns true if a receiver delivers a frame of this layout.
fn delivers(layout: &Layout) -> bool {
    let mut random = Random(7);
    let known = layout.messages().map_or(&[][..], |messages| messages.known);
    let lengths = (layout.shortest()..=layout.longest())
        .flat_map(|length| (0..16).map(move |try_| (length, try_)));
    let mut of_lengths = lengths.flat_map(|(length, try_)| {
        // Try a header for each known message, or random headers if the layout does not restrict the messages.
        let messages = known.iter().map(|message| Some(message.number));
        let messages: Vec<_> = if known.is_empty() {
            vec![None]
        } else {
            messages.collect()
        };
        messages
            .into_iter()
            .map(move |message| (length, message, try_))
    });
    of_lengths.any(|(length, message, try_)| {
        let content: Vec<u8> = (0..=u8::MAX)
            .filter(|byte| {
                layout
                    .content()
                    .iter()
                    .any(|(a, b)| (a..=b).contains(&byte))
            })
            .collect();
        let mut any = || match &*content {
            [] => 0x80 | random.below(128),
            _ => content[usize::from(random.below(250)) % content.len()],
        };
        let mut frame: Vec<u8> = (0..length).map(|_| any()).collect();
        // Sealing keeps a valid sync and terminator.
        let (sync, terminator) = (layout.sync(), layout.terminator());
        for (patterns, from, try_) in [
            (sync, 0, try_ / 2),
            (terminator, length - terminator.length, try_ / 4),
        ] {
            let all: Vec<_> = patterns.each().collect();
            if !all.is_empty() {
                frame[from..][..patterns.length].copy_from_slice(all[try_ % all.len()]);
            }
        }
        if let (Some(messages), Some(message)) = (layout.messages(), message) {
            let number = messages.number;
            let mut bytes = message.to_le_bytes()[..number.bytes].to_vec();
            if number.order == ByteOrder::Big {
                bytes.reverse();
            }
            frame[number.at..number.end()].copy_from_slice(&bytes);
        }
        if let Some(trailer) = layout.trailer() {
            frame[trailer.at] &= !trailer.mask;
            if try_ % 2 == 0 {
                frame[trailer.at] |= trailer.mask;
                frame.resize(length + trailer.bytes, 0x55);
            }
        }
        layout.seal(&mut frame) && is_received(layout, &frame)
    })
}

fn is_received(layout: &Layout, frame: &[u8]) -> bool {
    let layouts = [*layout];
    let format = AnyOf(&layouts);
    let memory = vec![0; 2 * format.longest()];
    let mut receiver = BufferedReceiver::with_buffer(format, memory).expect("it holds a frame");
    let mut frames = 0;
    receiver.feed(frame, |found| {
        frames += usize::from(found.message().is_some_and(|it| it.bytes() == frame));
    });
    frames == 1
}

/// A generator of pseudo-random numbers: xorshift.
struct Random(u64);

impl Random {
    fn below(&mut self, most: u8) -> u8 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        let [.., high] = self.0.to_le_bytes();
        high % most
    }

    fn of<T: Copy>(&mut self, values: &[T]) -> T {
        let most = u8::try_from(values.len()).expect("few values");
        values[usize::from(self.below(most))]
    }

    fn place(&mut self) -> i16 {
        i16::from(self.below(14)) - 6
    }

    fn number(&mut self) -> Number {
        let order = self.of(&[ByteOrder::Little, ByteOrder::Big]);
        let bytes = self.of(&[1, 1, 1, 2, 2, 3, 4, 0, 5]);
        Number::new(usize::from(self.below(5)), bytes, order)
    }

    fn fixed(&mut self) -> Vec<FixedBits> {
        (0..self.of(&[0, 0, 0, 1, 2]))
            .map(|_| {
                let (mask, value) = (
                    self.of(&[0xFF, 0xFF, 0x0F, 0xF0, 1, 0]),
                    self.of(&[0x24, 1, 10, 0]),
                );
                let value = if self.below(9) == 0 {
                    value
                } else {
                    value & mask
                };
                FixedBits::new(self.place(), mask, value)
            })
            .collect()
    }

    fn known(&mut self) -> Vec<KnownMessage> {
        let mut known: Vec<_> = (0..self.below(4))
            .map(|_| {
                let number = self.of(&[1, 10, 0x24, 200, 256, 300, 0x1_2400]);
                KnownMessage::new(number).longest_payload(self.of(&[0, 3, 8, u16::MAX]))
            })
            .collect();
        if self.below(9) > 0 {
            known.sort_by_key(|message| message.number);
        }
        known
    }

    fn length(&mut self) -> Length {
        match self.below(4) {
            0 => Length::Fixed,
            1 => Length::Delimiter,
            _ => Length::Field(
                LengthField::new(self.number())
                    .mask(self.of(&[u32::MAX, u32::MAX, 0x0F, 0xF0, 0x3FF, 0]))
                    .factor(self.of(&[1, 1, 1, 2, 5, 0]))
                    .plus(self.of(&[0, 0, 3, 6, -2])),
            ),
        }
    }

    fn checksum(&mut self) -> Checksum<'static> {
        let bytes = self.of(&[1, 1, 1, 2, 4, 0, 5]);
        let algorithm = self.of(&[
            Algorithm::Sum,
            Algorithm::Sum,
            Algorithm::InvertedSum,
            Algorithm::NegatedSum,
            Algorithm::Xor,
            Algorithm::Fletcher,
            Algorithm::Crc(Crc::new(8, 7)),
            Algorithm::Crc(Crc::new(8, 9).table(Table::Bytes(&BYTES))),
            Algorithm::Crc(Crc::new(16, 7).table(Table::Words(&WORDS))),
            Algorithm::Crc(Crc::new(32, 7).reflected()),
            Algorithm::Crc(Crc::new(33, 7)),
        ]);
        let checksum = Checksum::at_the_end(bytes).algorithm(algorithm);
        let checksum = match self.below(3) {
            0 => checksum,
            1 => checksum.from(self.place()),
            _ => checksum
                .at(self.place())
                .from(self.place())
                .to(self.place()),
        };
        checksum.encoding(self.of(&[Encoding::Little, Encoding::Big, Encoding::Hex]))
    }
}

/// Shows that the check is strict enough. Each layout of random parts is either rejected, or has frames that a receiver
/// delivers.
#[test]
fn a_layout_that_the_check_accepts_has_frames() {
    let mut random = Random(26);
    let (mut accepted, mut rejected) = (BTreeMap::new(), BTreeMap::new());
    for _ in 0..60_000 {
        let (fixed, known) = (random.fixed(), random.known());
        let syncs = [
            Patterns::NONE,
            Patterns::one(b"$"),
            Patterns::one(b"$"),
            Patterns::any_byte_of(b"$\x01"),
            Patterns::any_of(b"$$\x01\x0A", 2),
            Patterns::any_of(b"$$$", 2),
        ];
        let ends = [
            Patterns::NONE,
            Patterns::NONE,
            Patterns::one(b"\n"),
            Patterns::any_byte_of(b"\n$"),
            Patterns::one(b"\r\n"),
        ];
        let mut builder = Layout::builder()
            .sync(random.of(&syncs))
            .length(random.length())
            .shortest(usize::from(random.below(12) * random.of(&[0, 0, 0, 1])))
            .longest(usize::from(random.below(24)))
            .fixed(&fixed)
            .terminator(random.of(&ends));
        if random.below(3) == 0 {
            builder = builder.messages(Messages::new(random.number(), &known));
        }
        if random.below(2) == 0 {
            builder = builder.checksum(random.checksum());
        }
        if random.below(4) == 0 {
            builder = builder.trailer(Trailer::new(
                usize::from(random.below(5)),
                random.of(&[1, 0x80, 0]),
                usize::from(random.below(6)),
            ));
        }
        if random.below(6) == 0 {
            let contents: [&[(u8, u8)]; 3] =
                [&[(b' ', b'~')], &[(11, 255)], &[(0, 9), (b'#', b'F')]];
            let others: [&[&[u8]]; 4] = [&[], &[], &[b"\r\n"], &[b"\n", b"\r\r\n"]];
            builder = builder
                .content(random.of(&contents))
                .other_terminators(random.of(&others));
        }
        match builder.build() {
            Ok(layout) => {
                let checksum = layout.checksum();
                for (part, is_there) in [
                    ("fixed length", layout.length() == Length::Fixed),
                    ("delimiter", layout.length() == Length::Delimiter),
                    ("length field", matches!(layout.length(), Length::Field(_))),
                    ("no sync", layout.sync().length == 0),
                    ("syncs of two bytes", layout.sync().length == 2),
                    ("fixed bits", !layout.fixed().is_empty()),
                    ("messages", layout.messages().is_some()),
                    ("content", !layout.content().is_empty()),
                    ("other terminators", !layout.other_terminators().is_empty()),
                    ("trailer", layout.trailer().is_some()),
                    ("no checksum", checksum.is_none()),
                    (
                        "little",
                        checksum.is_some_and(|it| it.encoding == Encoding::Little),
                    ),
                    (
                        "big",
                        checksum.is_some_and(|it| it.encoding == Encoding::Big),
                    ),
                    (
                        "hex",
                        checksum.is_some_and(|it| it.encoding == Encoding::Hex),
                    ),
                ] {
                    *accepted.entry(part).or_insert(0) += u32::from(is_there);
                }
                assert!(delivers(&layout), "no frame of {layout:?}");
            }
            Err(contradiction) => *rejected.entry(contradiction.message()).or_insert(0) += 1,
        }
    }
    // Every part must occur in an accepted layout, and almost every contradiction must occur.
    assert!(accepted.values().all(|&count| count > 10), "{accepted:?}");
    assert!(rejected.len() >= 25, "{rejected:#?}");
}
