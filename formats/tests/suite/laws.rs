//! Checks that each format keeps the laws of [`Format`]. The streams are the format's shortest and longest frames,
//! followed by other bytes. Each byte of a stream is changed to every other value.

use framelock::motion::{Bin, BinCrc8, Setpoint};
use framelock::{Classification, DiscardReason, Encode as _, Format, LineEvent};
use framelock_formats::layout::{
    ByteOrder, CheckedLayout, FixedBits, KnownMessage, Layout, Length, LengthField, Messages,
    Number, Patterns,
};
use framelock_formats::{
    AnyOf, check_laws,
    crsf::{self, Crsf},
    ibus::{self, Ibus},
    mavlink::{self, Mavlink2},
    motion::{BIN, BIN_CRC8},
    sbus::{self, Sbus},
    ubx::{self, Ubx},
};

use crate::{DIALECT, built, frame};

pub(crate) fn keeps_the_laws<F: Format>(format: &F, frames: &[Vec<u8>]) {
    for frame in frames {
        let mut stream = [frame, &frame[..3]].concat();
        check_laws(format, &mut stream).unwrap_or_else(|broken| panic!("{broken}: {stream:02X?}"));
    }
}

#[test]
fn sbus() {
    let (least, most) = (sbus::Message::default(), [2047; 16]);
    let most = sbus::Message {
        channels: most,
        ..least
    };
    keeps_the_laws(&Sbus, &[frame(&Sbus, least), frame(&Sbus, most)]);
}

#[test]
fn ibus() {
    keeps_the_laws(&Ibus, &[frame(&Ibus, [0x4020; 18])]);
}

#[test]
fn crsf() {
    let message = |payload| crsf::Message {
        address: 0xC8,
        kind: 0xC8,
        payload,
    };
    let frames = [
        frame(&Crsf, message(&[])),
        frame(&Crsf, message(&[0xC8; 20])),
    ];
    keeps_the_laws(&Crsf, &frames);
    let longest = frame(&Crsf, message(&[2; 60]));
    assert_eq!(longest.len(), Crsf::LONGEST);
    keeps_the_laws(&Crsf, &[longest]);
}

#[test]
fn ubx() {
    let message = |payload| ubx::Message {
        class: 0xB5,
        id: 0x62,
        payload,
    };
    let frames = [
        frame(&Ubx::<32>, message(&[])),
        frame(&Ubx::<32>, message(&[0xB5; 24])),
    ];
    assert_eq!(frames[1].len(), 32);
    keeps_the_laws(&Ubx::<32>, &frames);
}

#[test]
fn mavlink2() {
    let message = |payload| mavlink::Message {
        payload,
        ..mavlink::Message::default()
    };
    let unsigned = frame(&Mavlink2(DIALECT), message(&[0xFD; 9]));
    let signed = signed(&unsigned);
    keeps_the_laws(
        &Mavlink2(DIALECT),
        &[frame(&Mavlink2(DIALECT), message(&[])), unsigned, signed],
    );
}

/// `check_laws` uses the longest frame of the format's value, which may be shorter than `LONGEST`.
#[test]
fn several_layouts_that_ask_for_more_than_their_longest_frame_break_law_1() {
    /// A deliberate mistake: `AnyOf` states a longest frame that is too short.
    #[derive(Clone, Copy)]
    struct Shortened(AnyOf<'static>);
    impl Format for Shortened {
        const LONGEST: usize = usize::MAX;
        type Message<'a> = ();
        fn longest(&self) -> usize {
            self.0.longest() - 1
        }
        fn classify(&self, bytes: &[u8]) -> Classification {
            self.0.classify(bytes)
        }
        fn decode(&self, _: &[u8]) {}
    }
    let several = AnyOf(&[ibus::LAYOUT]);
    let mut stream = frame(&Ibus, [1500; 18]);
    let mut broken_by = |format: &Shortened| check_laws(format, &mut stream);
    let broken = broken_by(&Shortened(several)).expect_err("it asks for one byte too many");
    assert_eq!((broken.law, broken.from, broken.changed), (1, 0, None));
    keeps_the_laws(&several, &[stream.clone()]);
}

/// A format that finds a frame before a line event must find it among the bytes.
#[test]
fn a_frame_that_a_line_event_makes_longer_breaks_law_6() {
    /// A deliberate mistake: at one kind of line event, the format claims the longest frame.
    #[derive(Clone, Copy)]
    struct Impatient(LineEvent);
    impl Format for Impatient {
        const LONGEST: usize = Ibus::LONGEST;
        type Message<'a> = ();
        fn classify(&self, bytes: &[u8]) -> Classification {
            Ibus.classify(bytes)
        }
        fn classify_before(&self, _: &[u8], event: LineEvent) -> Classification {
            if event == self.0 {
                Classification::Frame(Self::LONGEST)
            } else {
                Classification::Rejected(DiscardReason::LineEvent)
            }
        }
        fn decode(&self, _: &[u8]) {}
    }
    let mut stream = frame(&Ibus, [1500; 18]);
    for event in [
        LineEvent::Framing,
        LineEvent::Parity,
        LineEvent::Overrun,
        LineEvent::Break,
        LineEvent::Idle,
    ] {
        let broken = check_laws(&Impatient(event), &mut stream);
        let broken = broken.expect_err("the frame is too long");
        assert_eq!(
            (broken.law, broken.from, broken.length),
            (6, 0, 1),
            "{event:?}"
        );
    }
}

/// The check is fast enough for long frames, even without optimisation.
#[test]
fn a_frame_of_300_bytes() {
    /// A deliberate mistake that only one value of a single byte reveals. No valid frame reveals it.
    #[derive(Clone, Copy)]
    struct Hasty;
    impl Format for Hasty {
        const LONGEST: usize = 300;
        type Message<'a> = ();
        fn classify(&self, bytes: &[u8]) -> Classification {
            match bytes.get(201) {
                Some(0x51) => Classification::Frame(bytes.len()),
                _ => Ubx::<300>.classify(bytes),
            }
        }
        fn decode(&self, _: &[u8]) {}
    }
    let message = ubx::Message {
        class: 1,
        id: 2,
        payload: &[0xB5; 292],
    };
    let longest = frame(&Ubx::<300>, message);
    assert_eq!(longest.len(), 300);
    keeps_the_laws(&Ubx::<300>, std::slice::from_ref(&longest));
    let mut stream = longest.clone();
    let broken = check_laws(&Hasty, &mut stream).expect_err("it settles too soon");
    assert_eq!((broken.law, broken.changed), (3, Some((201, 0x51))));
    assert_eq!(
        stream, longest,
        "the stream is restored after an error, too"
    );
}

/// Returns the frame with a signature and with the CRC that a signed frame has.
pub(crate) fn signed(frame: &[u8]) -> Vec<u8> {
    let (unsigned, _) = frame.split_last_chunk::<2>().expect("a CRC");
    let mut signed = unsigned.to_vec();
    signed[2] = 1;
    let id = u32::from_le_bytes([frame[7], frame[8], frame[9], 0]);
    let known = DIALECT.iter().find(|known| known.number == id);
    let extra = known
        .expect("a known message")
        .extra
        .expect("an extra byte");
    let crc = mavlink_core::calculate_crc(&signed[1..], extra);
    signed.extend(crc.to_le_bytes());
    signed.extend([7, 1, 2, 3, 4, 5, 6, 0xA, 0xB, 0xC, 0xD, 0xE, 0xF]);
    signed
}

/// Sealing with the layouts of BIN and BIN-CRC8 writes the same frames as the core's encoders.
#[test]
fn bin_and_bin_crc8() {
    for seed in 0..=u8::MAX {
        let setpoint = Setpoint {
            pitch: seed,
            roll: seed.wrapping_mul(3),
            yaw: !seed,
        };
        let (mut bin, mut bin_crc8) = (Bin::encode(setpoint), BinCrc8::encode(setpoint));
        let (sent, sent_crc8) = (bin, bin_crc8);
        // Sealing must restore every byte that is not part of the setpoint.
        (bin[0], bin[1], bin[6]) = (0, 0, 0);
        (bin_crc8[0], bin_crc8[1], bin_crc8[6], bin_crc8[7]) = (0, 0, 0, 0);
        assert!(BIN.seal(&mut bin) && BIN_CRC8.seal(&mut bin_crc8));
        assert_eq!((bin, bin_crc8), (sent, sent_crc8));
    }
}

/// If a byte contains bits of the length and other bits, sealing changes only the bits of the length.
#[test]
fn what_is_not_of_the_length_stays_as_it_is() {
    const LAYOUT: CheckedLayout = Layout {
        sync: Patterns::one(&[0x24]),
        length: Length::Field(LengthField {
            mask: 0x3F,
            ..LengthField::byte(1)
        }),
        longest: 20,
        ..Layout::NONE
    }
    .checked();
    let mut frame = [0, 0x95, 1, 2, 3];
    assert!(LAYOUT.seal(&mut frame));
    assert_eq!(frame, [0x24, 0x85, 1, 2, 3]);
}

/// Numbers of each size are read in the byte order that the layout states. Sealing writes the numbers in this order
/// too.
#[test]
fn numbers_in_the_header_have_a_size_and_an_order() {
    for (bytes, order) in
        (1..=4).flat_map(|bytes| [(bytes, ByteOrder::Big), (bytes, ByteOrder::Little)])
    {
        let mut number: Vec<u8> = (1..).take(bytes).collect();
        let value = number
            .iter()
            .fold(0, |value, byte| value << 8 | u32::from(*byte));
        if order == ByteOrder::Little {
            number.reverse();
        }
        let (frame, length) = ([b"$", &*number].concat(), 1 + bytes);
        let (at, whole) = (Number::new(1, bytes, order), Classification::Frame(length));
        let any = Layout {
            sync: Patterns::one(b"$"),
            longest: length,
            ..Layout::NONE
        };

        let plus = i32::try_from(length).expect("a few") - value.cast_signed();
        let counted = built(&Layout {
            length: Length::Field(LengthField {
                plus,
                ..LengthField::new(at)
            }),
            ..any
        });
        assert_eq!(counted.classify(&frame), whole, "{counted:?}");
        let mut unsealed = vec![0; length];
        assert!(counted.seal(&mut unsealed));
        assert_eq!(unsealed, frame);

        let known = [KnownMessage::new(value)];
        let numbered = built(&Layout {
            messages: Some(Messages {
                number: at,
                known: &known,
            }),
            ..any
        });
        assert_eq!(numbered.classify(&frame), whole, "{numbered:?}");
    }
}

/// Limiting cases: the shortest and longest frames, fixed bits next to the end of the header, and negative lengths.
#[test]
fn what_a_layout_says_at_its_limits() {
    let field = LengthField::byte(1);
    let layout = Layout {
        sync: Patterns::one(b"$"),
        length: Length::Field(field),
        longest: 10,
        ..Layout::NONE
    };
    let counted = |field| Layout {
        length: Length::Field(field),
        ..layout
    };
    let has_a_bit = |at| {
        [FixedBits {
            at,
            mask: 0x40,
            value: 0x40,
        }]
    };
    let (in_header, behind) = (&has_a_bit(1), &has_a_bit(2));
    for (layout, bytes, says) in [
        // A frame may consist only of its header, even if this is also the longest frame.
        (layout, &[0x24, 2][..], Classification::Frame(2)),
        (
            Layout {
                longest: 2,
                ..layout
            },
            &[0x24, 2],
            Classification::Frame(2),
        ),
        (
            Layout {
                fixed: in_header,
                ..counted(LengthField {
                    mask: 0x3F,
                    ..field
                })
            },
            &[0x24, 3],
            Classification::Rejected(DiscardReason::BadHeader),
        ),
        (
            Layout {
                shortest: 3,
                fixed: behind,
                ..layout
            },
            &[0x24, 3],
            Classification::Incomplete { at_least: 3 },
        ),
        (
            counted(LengthField { plus: -5, ..field }),
            &[0x24, 3],
            Classification::Rejected(DiscardReason::BadHeader),
        ),
        // A length of 2 to the power of 63 bytes or more is too long, too.
        (
            counted(LengthField {
                number: Number::new(1, 4, ByteOrder::Big),
                factor: u32::MAX,
                plus: 5,
                ..field
            }),
            &[0x24, 0xFF, 0xFF, 0xFF, 0xFF],
            Classification::Rejected(DiscardReason::TooLong),
        ),
        // There are as many bytes as in the longest frame, but no terminator.
        (
            Layout {
                length: Length::Delimiter,
                longest: 4,
                terminator: Patterns::one(b"\n"),
                ..layout
            },
            b"$abc",
            Classification::Rejected(DiscardReason::WrongTerminator),
        ),
    ] {
        let layout = built(&layout);
        assert_eq!(layout.classify(bytes), says, "{layout:?} of {bytes:02X?}");
    }
}

/// The signature of 13 bytes is a trailer, so the longest frame without a signature has 267 bytes.
#[test]
fn the_lengths_of_a_layout_count_its_header_and_its_trailer() {
    let layout = mavlink::layout_v2(DIALECT);
    assert_eq!(layout.longest, 280);
    assert_eq!(layout.longest_without_trailer(), 267);
    assert_eq!(layout.header(), 10);
}
