//! Tests the check of layouts. For each contradiction, the check must return an error that names the wrong part. If no
//! frame satisfies a layout, the layout has no example frame.

use framelock::{BufferedReceiver, DiscardReason, Format, Found, Frame, LineEvent};
use framelock_formats::layout::{
    Algorithm, ByteOrder, Checksum, Crc, Encoding, FixedBits, KnownMessage, Layout, Length,
    LengthField, Messages, Number, Part, Patterns, Table, Trailer,
};
use framelock_formats::mavlink::{ARDUPILOTMEGA, COMMON, layout_v1, layout_v2};
use framelock_formats::motion::BIN_CRC8;
use framelock_formats::{AnyOf, crsf, nmea, rtcm, sbus, ubx};

use crate::built;

/// `'A' 'B' length payload checksum`.
const COUNTED: Layout = Layout {
    sync: Patterns::one(b"AB"),
    length: Length::Field(LengthField {
        plus: 4,
        ..LengthField::byte(2)
    }),
    longest: 20,
    checksum: Some(CHECKSUM),
    ..Layout::NONE
};
const CHECKSUM: Checksum = Checksum {
    from: 2,
    ..Checksum::at_the_end(1)
};

/// `'A' 'B' checksum`, then bytes that the checksum covers.
const AT_2: Layout = Layout {
    sync: Patterns::one(b"AB"),
    longest: 8,
    checksum: Some(Checksum {
        at: 2,
        from: 3,
        to: -1,
        ..Checksum::at_the_end(1)
    }),
    ..Layout::NONE
};

/// `'A'`, 9 bytes, a line feed.
const FIXED: Layout = Layout {
    sync: Patterns::one(b"A"),
    longest: 11,
    terminator: Patterns::one(b"\n"),
    ..Layout::NONE
};
const LINE: Layout = Layout {
    length: Length::Delimiter,
    ..FIXED
};

const TEXT: Layout = Layout {
    content: &[(b' ', b'~')],
    ..LINE
};
/// `'A' 'B'`, any bytes, and a checksum.
const SILENT: Layout = Layout {
    length: Length::Silence,
    ..COUNTED
};
const DIGITS: Checksum = Checksum {
    encoding: Encoding::Hex,
    at: -3,
    to: -4,
    ..Checksum::at_the_end(1)
};

const fn field(field: LengthField) -> Layout<'static> {
    Layout {
        length: Length::Field(field),
        ..COUNTED
    }
}

const fn sum(checksum: Checksum<'static>) -> Layout<'static> {
    Layout {
        checksum: Some(checksum),
        ..COUNTED
    }
}

const fn crc(bytes: usize, crc: Crc<'static>) -> Layout<'static> {
    sum(Checksum {
        algorithm: Algorithm::Crc(crc),
        ..Checksum::at_the_end(bytes)
    })
}

const fn known(known: &'static [KnownMessage]) -> Layout<'static> {
    Layout {
        messages: Some(messages(Number::byte(3), known)),
        ..COUNTED
    }
}

const fn messages(number: Number, known: &'static [KnownMessage]) -> Messages<'static> {
    Messages { number, known }
}

const fn others(other: &'static [u8]) -> [Patterns<'static>; 2] {
    [Patterns::NONE, Patterns::one(other)]
}

const fn bits(at: i16, mask: u8, value: u8) -> FixedBits {
    FixedBits { at, mask, value }
}

const fn trailer(at: usize, mask: u8, bytes: usize) -> Trailer {
    Trailer { at, mask, bytes }
}

const KNOWN: [KnownMessage; 3] = [
    KnownMessage::new(7),
    KnownMessage::new(8),
    KnownMessage::new(300),
];

const OF_8: [u8; 256] = Crc::new(8, 7).table_of_bytes();
const OF_16: [u32; 256] = Crc::new(16, 7).table_of_words();

/// Each entry has a layout that contradicts itself, the part that the error must name, the beginning of the error's
/// message, and a similar layout without the contradiction.
#[rustfmt::skip]
const CONTRADICTIONS: &[(Layout, Part, &str, Layout)] = &[
    (Layout { sync: Patterns::any_of(b"ABC", 2), ..COUNTED }, Part::Sync, "sync: its bytes must be one pattern or more", Layout { sync: Patterns::any_of(b"ABCD", 2), ..COUNTED }),
    (Layout { sync: Patterns::any_byte_of(b""), ..COUNTED }, Part::Sync, "sync: its bytes must be one pattern or more", Layout { sync: Patterns::any_byte_of(b"A"), ..COUNTED }),
    (Layout { sync: Patterns::any_of(b"A", 0), ..COUNTED }, Part::Sync, "sync: its bytes must be one pattern or more", Layout { sync: Patterns::NONE, ..COUNTED }),
    (Layout { terminator: Patterns::any_of(b"ABC", 2), ..FIXED }, Part::Terminator, "terminator: its bytes must be one pattern or more", Layout { terminator: Patterns::any_of(b"ABCD", 2), ..FIXED }),
    (Layout { longest: 4, ..Layout::NONE }, Part::Sync, "sync: nothing tells a frame from noise", Layout { longest: 4, checksum: Some(Checksum::at_the_end(1)), ..Layout::NONE }),
    (Layout { longest: 4, ..Layout::NONE }, Part::Sync, "sync: nothing tells a frame from noise", Layout { longest: 4, terminator: Patterns::one(b"\n"), ..Layout::NONE }),
    (Layout { length: Length::Delimiter, ..COUNTED }, Part::Terminator, "terminator: a delimiter ends each frame", LINE),
    (field(LengthField::new(Number::new(2, 0, ByteOrder::Big))), Part::Length, "length: the length field must have 1 to 4", field(LengthField::new(Number::new(2, 1, ByteOrder::Big)))),
    (field(LengthField::new(Number::new(2, 5, ByteOrder::Big))), Part::Length, "length: the length field must have 1 to 4", field(LengthField::new(Number::new(2, 4, ByteOrder::Big)))),
    (field(LengthField { factor: 0, ..LengthField::byte(2) }), Part::Length, "length: with this mask or factor", field(LengthField { factor: 3, ..LengthField::byte(2) })),
    (field(LengthField { mask: 0x100, ..LengthField::byte(2) }), Part::Length, "length: with this mask or factor", field(LengthField { mask: 0x11F, ..LengthField::byte(2) })),
    (Layout { longest: 3, ..COUNTED }, Part::Longest, "longest: it is less than shortest", Layout { longest: 4, ..COUNTED }),
    (Layout { shortest: 40, ..COUNTED }, Part::Longest, "longest: it is less than shortest", Layout { shortest: 20, ..COUNTED }),
    (Layout { longest: 1, ..FIXED }, Part::Longest, "longest: the header and the terminator do not fit", Layout { longest: 2, ..FIXED }),
    (Layout { longest: 1, ..LINE }, Part::Longest, "longest: it is less than shortest", Layout { sync: Patterns::NONE, longest: 1, ..LINE }),
    (Layout { shortest: 10, ..FIXED }, Part::Shortest, "shortest: each frame has exactly longest bytes", Layout { shortest: 11, ..FIXED }),
    (Layout { shortest: 3, ..COUNTED }, Part::Shortest, "shortest: a frame of this length has no room", Layout { shortest: 4, ..COUNTED }),
    (Layout { shortest: 7, ..field(LengthField { plus: 8, ..LengthField::byte(2) }) }, Part::Shortest, "shortest: a frame of this length has no room", Layout { shortest: 8, ..field(LengthField { plus: 8, ..LengthField::byte(2) }) }),
    (Layout { fixed: &[bits(-3, 1, 1)], shortest: 3, ..LINE }, Part::Shortest, "shortest: a frame of this length has no room", Layout { fixed: &[bits(-3, 1, 1)], shortest: 4, ..LINE }),
    (Layout { longest: 260, ..COUNTED }, Part::Longest, "longest: it is more than the greatest length", Layout { longest: 259, ..COUNTED }),
    (Layout { longest: 21, ..field(LengthField { mask: 7, factor: 2, plus: 6, ..LengthField::byte(2) }) }, Part::Longest, "longest: it is more than the greatest length", Layout { longest: 20, ..field(LengthField { mask: 7, factor: 2, plus: 6, ..LengthField::byte(2) }) }),
    (Layout { messages: Some(messages(Number::new(3, 5, ByteOrder::Big), &KNOWN)), ..COUNTED }, Part::Messages, "messages: the number must have 1 to 4", Layout { messages: Some(messages(Number::new(3, 4, ByteOrder::Big), &KNOWN)), ..COUNTED }),
    (known(&[KNOWN[1], KNOWN[0]]), Part::Messages, "messages: the numbers are not in ascending order", known(&KNOWN)),
    (known(&[KNOWN[1], KNOWN[1]]), Part::Messages, "messages: the numbers are not in ascending order", known(&KNOWN)),
    (Layout { trailer: Some(trailer(2, 1, 3)), ..FIXED }, Part::Trailer, "trailer: only frames with a length field", Layout { trailer: Some(trailer(2, 1, 3)), ..COUNTED }),
    (Layout { trailer: Some(trailer(2, 0, 3)), ..COUNTED }, Part::Trailer, "trailer: only frames with a length field", Layout { trailer: Some(trailer(2, 1, 3)), ..COUNTED }),
    (Layout { trailer: Some(trailer(2, 1, 0)), ..COUNTED }, Part::Trailer, "trailer: only frames with a length field", Layout { trailer: Some(trailer(2, 1, 1)), ..COUNTED }),
    (Layout { trailer: Some(trailer(2, 1, 17)), ..COUNTED }, Part::Trailer, "trailer: the shortest frame with a trailer", Layout { trailer: Some(trailer(2, 1, 16)), ..COUNTED }),
    (Layout { trailer: Some(trailer(9, 1, 3)), shortest: 10, ..COUNTED }, Part::Shortest, "shortest: a frame of this length has no room", Layout { trailer: Some(trailer(9, 1, 3)), shortest: 11, ..COUNTED }),
    (Layout { fixed: &[bits(1, 1, 1), bits(11, 1, 1)], ..FIXED }, Part::Fixed(1), "fixed: the shortest frame has no byte at this offset", Layout { fixed: &[bits(1, 1, 1), bits(9, 1, 1)], ..FIXED }),
    (Layout { fixed: &[bits(-12, 1, 1)], ..FIXED }, Part::Fixed(0), "fixed: the shortest frame has no byte at this offset", Layout { fixed: &[bits(-11, 1, 1)], ..FIXED }),
    (Layout { content: &[(b' ', b'~')], ..FIXED }, Part::Content, "content: only frames that a delimiter ends", TEXT),
    (Layout { content: &[(b'\t', b'\n')], ..TEXT }, Part::Content, "content: a terminator begins with a byte of the content", Layout { content: &[(b'\t', b'\t')], ..TEXT }),
    (Layout { terminator: Patterns::any_byte_of(b"\nA"), ..TEXT }, Part::Content, "content: a terminator begins with a byte of the content", Layout { terminator: Patterns::any_byte_of(b"\n\r"), ..TEXT }),
    (Layout { other_terminators: others(b"a\n"), ..TEXT }, Part::Content, "content: a terminator begins with a byte of the content", Layout { other_terminators: others(b"\rb"), ..TEXT }),
    (Layout { other_terminators: others(b"\r\n"), ..LINE }, Part::OtherTerminators, "other terminators: without a content", Layout { other_terminators: others(b"\r\n"), ..TEXT }),
    (Layout { other_terminators: [Patterns::any_of(b"\r\n\r", 2), Patterns::NONE], ..TEXT }, Part::OtherTerminators, "other terminators: the bytes must be one pattern or more", Layout { other_terminators: [Patterns::NONE; 2], ..TEXT }),
    (Layout { other_terminators: others(b"\n\r"), ..TEXT }, Part::OtherTerminators, "other terminators: one begins with another one", Layout { other_terminators: others(b"\r\n"), ..TEXT }),
    (Layout { checksum: Some(Checksum { encoding: Encoding::Big, at: -2, to: -3, ..DIGITS }), ..TEXT }, Part::Checksum, "checksum: its bytes may be outside the content", Layout { checksum: Some(DIGITS), ..TEXT }),
    (Layout { behind: 1, ..FIXED }, Part::Behind, "behind: only frames that one delimiter ends", Layout { behind: 1, ..LINE }),
    (Layout { behind: 1, other_terminators: others(b"\r\n"), ..TEXT }, Part::Behind, "behind: only frames that one delimiter ends", Layout { behind: 1, ..TEXT }),
    (Layout { behind: 2, checksum: Some(Checksum { at: -3, to: -4, from: 0, ..CHECKSUM }), ..LINE }, Part::Checksum, "checksum: it overlaps", Layout { behind: 2, checksum: Some(CHECKSUM), ..LINE }),
    (Layout { behind: 2, checksum: Some(Checksum { at: -4, to: -5, ..CHECKSUM }), ..TEXT }, Part::Checksum, "checksum: its bytes may be outside the content", Layout { behind: 2, checksum: Some(Checksum { at: -2, to: -3, ..CHECKSUM }), ..TEXT }),
    (Layout { behind: 9, longest: 10, ..LINE }, Part::Longest, "longest: it is less than shortest", Layout { behind: 8, longest: 10, ..LINE }),
    (Layout { content: &[(b' ', b'~')], ..SILENT }, Part::Content, "content: only frames that a delimiter ends", SILENT),
    (Layout { shortest: 2, ..SILENT }, Part::Shortest, "shortest: a frame of this length has no room", Layout { shortest: 3, ..SILENT }),
    (sum(Checksum { algorithm: Algorithm::XorWords, ..Checksum::at_the_end(1) }), Part::Checksum, "checksum: the algorithm needs another number", sum(Checksum { algorithm: Algorithm::XorWords, ..Checksum::at_the_end(2) })),
    (sum(Checksum { algorithm: Algorithm::Fletcher, initial: 1, ..Checksum::at_the_end(2) }), Part::Checksum, "checksum: initial and hex digits are for sums", sum(Checksum { algorithm: Algorithm::SumWords, initial: 1, ..Checksum::at_the_end(2) })),
    (sum(Checksum { over_hex_digits: true, algorithm: Algorithm::Crc(Crc::new(8, 7)), ..CHECKSUM }), Part::Checksum, "checksum: initial and hex digits are for sums", Layout { checksum: Some(Checksum { over_hex_digits: true, ..DIGITS }), ..TEXT }),
    (sum(Checksum::at_the_end(0)), Part::Checksum, "checksum: it must have 1 to 4 bytes", sum(Checksum::at_the_end(1))),
    (sum(Checksum::at_the_end(5)), Part::Checksum, "checksum: it must have 1 to 4 bytes", sum(Checksum::at_the_end(4))),
    (sum(Checksum { algorithm: Algorithm::Xor, ..Checksum::at_the_end(2) }), Part::Checksum, "checksum: the algorithm needs another number", sum(Checksum { algorithm: Algorithm::Xor, ..Checksum::at_the_end(1) })),
    (sum(Checksum { algorithm: Algorithm::Fletcher, ..Checksum::at_the_end(1) }), Part::Checksum, "checksum: the algorithm needs another number", sum(Checksum { algorithm: Algorithm::Fletcher, ..Checksum::at_the_end(2) })),
    (crc(1, Crc::new(12, 7)), Part::Checksum, "checksum: the algorithm needs another number", crc(2, Crc::new(12, 7))),
    (crc(4, Crc::new(33, 7)), Part::Checksum, "checksum: the width of a CRC must be 8 to 32", crc(4, Crc::new(32, 7))),
    (crc(1, Crc::new(7, 7)), Part::Checksum, "checksum: the width of a CRC must be 8 to 32", crc(1, Crc::new(8, 7))),
    (crc(1, Crc::new(8, 0x107)), Part::Checksum, "checksum: the polynomial, the initial or", crc(2, Crc::new(9, 0x107))),
    (crc(1, Crc { initial: 0x100, ..Crc::new(8, 7) }), Part::Checksum, "checksum: the polynomial, the initial or", crc(1, Crc { initial: 0xFF, ..Crc::new(8, 7) })),
    (crc(1, Crc { xor_out: 0x100, ..Crc::new(8, 7) }), Part::Checksum, "checksum: the polynomial, the initial or", crc(1, Crc { xor_out: 0xFF, ..Crc::new(8, 7) })),
    (crc(1, Crc::new(8, 0)), Part::Checksum, "checksum: the polynomial is 0", crc(1, Crc::new(8, 1))),
    (crc(2, Crc { table: Table::Bytes(&OF_8), ..Crc::new(16, 7) }), Part::Checksum, "checksum: a table of bytes is only for a CRC of 8", crc(1, Crc { table: Table::Bytes(&OF_8), ..Crc::new(8, 7) })),
    (crc(1, Crc { table: Table::Bytes(&OF_8), ..Crc::new(8, 9) }), Part::Checksum, "checksum: the table belongs to another CRC", crc(1, Crc { table: Table::Bytes(&Crc::new(8, 9).table_of_bytes()), ..Crc::new(8, 9) })),
    (crc(2, Crc { reflected_in: true, reflected_out: true, table: Table::Words(&OF_16), ..Crc::new(16, 7) }), Part::Checksum, "checksum: the table belongs to another CRC", crc(2, Crc { table: Table::Words(&OF_16), ..Crc::new(16, 7) })),
    (crc(1, Crc { reflected_in: true, reflected_out: true, table: Table::Bytes(&OF_8), ..Crc::new(8, 7) }), Part::Checksum, "checksum: the table belongs to another CRC", crc(1, Crc { reflected_in: true, reflected_out: true, table: Table::Bytes(&Crc { reflected_in: true, reflected_out: true, ..Crc::new(8, 7) }.table_of_bytes()), ..Crc::new(8, 7) })),
    (sum(Checksum { at: 4, ..CHECKSUM }), Part::Checksum, "checksum: it is outside of the shortest", sum(Checksum { at: 3, to: 2, ..CHECKSUM })),
    (sum(Checksum { encoding: Encoding::Hex, ..CHECKSUM }), Part::Checksum, "checksum: it is outside of the shortest", sum(Checksum { encoding: Encoding::Hex, at: -2, to: -3, ..CHECKSUM })),
    (Layout { checksum: Some(Checksum { at: -12, ..Checksum::at_the_end(1) }), ..FIXED }, Part::Checksum, "checksum: it is outside of the shortest", Layout { checksum: Some(Checksum { at: -2, to: -3, ..Checksum::at_the_end(1) }), ..FIXED }),
    (sum(Checksum { to: -1, ..CHECKSUM }), Part::Checksum, "checksum: it covers itself", sum(Checksum { to: -2, ..CHECKSUM })),
    (Layout { checksum: Some(Checksum { at: 2, from: 3, to: 8, ..CHECKSUM }), ..AT_2 }, Part::Checksum, "checksum: the bytes that it covers", Layout { checksum: Some(Checksum { at: 2, from: 3, to: 7, ..CHECKSUM }), ..AT_2 }),
    (sum(Checksum { to: 20, ..CHECKSUM }), Part::Checksum, "checksum: the bytes that it covers", sum(Checksum { to: 2, ..CHECKSUM })),
    (Layout { shortest: 4, ..sum(Checksum { from: 4, ..CHECKSUM }) }, Part::Checksum, "checksum: the bytes that it covers", Layout { shortest: 4, ..sum(Checksum { from: 3, ..CHECKSUM }) }),
    (Layout { shortest: 4, ..sum(Checksum { from: -5, ..CHECKSUM }) }, Part::Checksum, "checksum: the bytes that it covers", Layout { shortest: 4, ..sum(Checksum { from: -4, ..CHECKSUM }) }),
    (Layout { checksum: Some(Checksum::at_the_end(1)), ..FIXED }, Part::Checksum, "checksum: it overlaps", Layout { checksum: Some(Checksum { at: -2, to: -3, ..Checksum::at_the_end(1) }), ..FIXED }),
    (Layout { shortest: 5, ..sum(Checksum { at: 1, from: 3, ..CHECKSUM }) }, Part::Checksum, "checksum: it overlaps", Layout { shortest: 5, ..sum(Checksum { at: 3, from: 4, to: 4, ..CHECKSUM }) }),
];

/// Each entry has a layout without frames, the reason to reject the bytes that come closest to a frame, and a similar
/// layout with frames.
#[rustfmt::skip]
const WITHOUT_FRAMES: &[(Layout, DiscardReason, Layout)] = &[
    (Layout { shortest: 9, longest: 15, ..field(LengthField { factor: 8, ..LengthField::byte(2) }) }, DiscardReason::BadHeader, Layout { shortest: 9, longest: 16, ..field(LengthField { factor: 8, ..LengthField::byte(2) }) }),
    (Layout { shortest: 5, longest: 15, ..field(LengthField { mask: 0xF0, factor: 16, ..LengthField::byte(2) }) }, DiscardReason::BadHeader, Layout { shortest: 5, longest: 15, ..field(LengthField { mask: 0xF0, ..LengthField::byte(2) }) }),
    (Layout { fixed: &[bits(2, 0xF0, 0x20)], ..COUNTED }, DiscardReason::TooLong, Layout { fixed: &[bits(2, 0xF0, 0x10)], ..COUNTED }),
    (Layout { fixed: &[bits(2, 5, 5)], shortest: 8, longest: 8, ..COUNTED }, DiscardReason::TooLong, Layout { fixed: &[bits(2, 5, 5)], shortest: 8, longest: 9, ..COUNTED }),
    (Layout { sync: Patterns::one(b"ABC"), ..COUNTED }, DiscardReason::BrokenSync, Layout { sync: Patterns::any_of(b"ABCAB\x09", 3), ..COUNTED }),
    (Layout { shortest: 5, longest: 15, messages: Some(messages(Number::byte(3), &KNOWN)), ..field(LengthField { mask: 0xF0, ..LengthField::byte(3) }) }, DiscardReason::UnknownMessage, Layout { shortest: 5, longest: 15, messages: Some(messages(Number::byte(3), &KNOWN)), ..field(LengthField { mask: 0x0F, ..LengthField::byte(3) }) }),
    (known(&[KnownMessage { longest_payload: 0, ..KnownMessage::new(7) }]), DiscardReason::TooLong, known(&[KnownMessage { longest_payload: 1, ..KnownMessage::new(7) }])),
    (known(&[]), DiscardReason::UnknownMessage, known(&[KNOWN[0]])),
    (known(&[KNOWN[2]]), DiscardReason::UnknownMessage, known(&[KNOWN[1]])),
    (Layout { fixed: &[bits(1, 1, 3)], ..FIXED }, DiscardReason::WrongTerminator, Layout { fixed: &[bits(1, 3, 3)], ..FIXED }),
    (Layout { fixed: &[bits(3, 0xFF, 9)], ..known(&KNOWN) }, DiscardReason::UnknownMessage, Layout { fixed: &[bits(3, 0xFF, 8)], ..known(&KNOWN) }),
    (Layout { sync: Patterns::one(b"AB\x01\x09"), ..known(&KNOWN) }, DiscardReason::UnknownMessage, Layout { sync: Patterns::one(b"AB\x01\x08"), ..known(&KNOWN) }),
    (Layout { fixed: &[bits(2, 3, 1), bits(-9, 2, 2)], ..FIXED }, DiscardReason::WrongTerminator, Layout { fixed: &[bits(2, 1, 1), bits(-9, 2, 2)], ..FIXED }),
    (Layout { fixed: &[bits(0, 1, 0)], ..FIXED }, DiscardReason::NoSync, Layout { fixed: &[bits(0, 1, 1)], ..FIXED }),
    (Layout { fixed: &[bits(-1, 1, 1)], ..FIXED }, DiscardReason::WrongTerminator, Layout { fixed: &[bits(-1, 1, 0)], ..FIXED }),
    (Layout { shortest: 5, fixed: &[bits(3, 0xFF, b'\n')], ..LINE }, DiscardReason::BadHeader, Layout { shortest: 5, fixed: &[bits(4, 0xFF, b'\n')], ..LINE }),
    (Layout { messages: Some(messages(Number::byte(1), &[KnownMessage::new(10)])), ..LINE }, DiscardReason::BadHeader, Layout { messages: Some(messages(Number::byte(1), &KNOWN)), ..LINE }),
    (Layout { fixed: &[bits(-2, 0xE0, 0)], ..TEXT }, DiscardReason::WrongTerminator, Layout { fixed: &[bits(-2, 0xE0, 0x60)], ..TEXT }),
    (Layout { messages: Some(messages(Number::byte(1), &[KNOWN[0]])), ..TEXT }, DiscardReason::WrongTerminator, Layout { messages: Some(messages(Number::byte(1), &[KnownMessage::new(0x30)])), ..TEXT }),
];

#[test]
fn each_contradiction_is_an_error_that_names_its_part() {
    for (number, (wrong, part, message, right)) in CONTRADICTIONS.iter().enumerate() {
        let contradiction = wrong
            .check()
            .expect_err(&format!("case {number} is wrong: {message}"));
        assert!(
            contradiction.part == *part && contradiction.to_string().starts_with(message),
            "case {number} is {part:?}, {message}: {contradiction:?}"
        );
        has_frames(right);
    }
    let fixed = &[bits(11, 1, 1)];
    let contradiction = Layout { fixed, ..FIXED }
        .check()
        .expect_err("the frame has 11 bytes");
    assert!(
        contradiction
            .to_string()
            .ends_with(" (fixed bits with index 0)")
            && !contradiction.message.contains("index")
    );
}

#[test]
fn no_example_is_made_if_there_are_no_frames() {
    for (number, (wrong, reason, right)) in WITHOUT_FRAMES.iter().enumerate() {
        let checked = wrong.check().expect("its parts agree");
        let example = checked.example(&mut [0; 300]).map(|frame| frame.to_vec());
        assert_eq!(example, Err(*reason), "case {number}");
        has_frames(right);
    }
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
        assert_eq!(layout.check().as_ref(), Ok(layout));
        has_frames(layout);
    }
}

/// Asserts that an example can be made, and that a receiver delivers it.
fn has_frames(layout: &Layout) {
    let layouts = [built(layout)];
    let mut buffer = vec![0; layout.longest];
    let frame = layouts[0].example(&mut buffer);
    let frame = frame.unwrap_or_else(|why| panic!("{why:?}: {layout:?}"));
    let format = AnyOf(&layouts);
    let memory = vec![0; 2 * format.longest()];
    let mut receiver = BufferedReceiver::with_buffer(format, memory).expect("it holds a frame");
    let mut frames = 0;
    let frame = frame.to_vec();
    let mut found = |found: Found<Frame<_>>| {
        frames += usize::from(found.message().is_some_and(|it| it.bytes() == frame));
    };
    receiver.feed(&frame, &mut found);
    receiver.line_event(LineEvent::Idle, found);
    assert_eq!(frames, 1, "{layout:?}");
}
