//! Checks that formats keep the laws of [`Format`]. Each stream is a frame, followed by a copy of the
//! frame's first three bytes. `check_laws` also changes each byte of a stream.

use framelock::motion::{Bin, BinCrc8, Setpoint};
use framelock::{Classification, DiscardReason, Encode as _, Format, LineEvent};
use framelock_formats::layout::{
    ByteOrder, CheckedLayout, Layout, Length, LengthField, Number, Patterns,
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
fn each_format_keeps_the_laws() {
    let channels = [2047; 16];
    let least = sbus::Message::default();
    let most = sbus::Message { channels, ..least };
    keeps_the_laws(&Sbus, &[frame(&Sbus, least), frame(&Sbus, most)]);
    keeps_the_laws(&Ibus, &[frame(&Ibus, [0x4020; 18])]);
    let (address, kind) = (0xC8, 0xC8);
    for payload in [&[][..], &[0xC8; 20], &[2; 60]] {
        let message = crsf::Message {
            address,
            kind,
            payload,
        };
        keeps_the_laws(&Crsf, &[frame(&Crsf, message)]);
    }
    let (class, id) = (0xB5, 0x62);
    for payload in [&[][..], &[0xB5; 24]] {
        let message = ubx::Message { class, id, payload };
        keeps_the_laws(&Ubx::<32>, &[frame(&Ubx::<32>, message)]);
    }
    let mavlink2 = Mavlink2(DIALECT);
    let [shortest, long] = [&[][..], &[0xFD; 9]].map(|payload| {
        let message = mavlink::Message {
            payload,
            ..mavlink::Message::default()
        };
        frame(&mavlink2, message)
    });
    let signed = signed(&long);
    keeps_the_laws(&mavlink2, &[shortest, long, signed]);
}

/// `check_laws` uses the result of `Format::longest`, which may be smaller than `LONGEST`.
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

/// The frame that a format finds before a line event must not be longer than the bytes.
#[test]
fn a_frame_that_a_line_event_makes_longer_breaks_law_6() {
    /// A deliberate mistake: at one kind of line event, the format claims a frame of the longest length, however few
    /// bytes there are.
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
    /// A deliberate mistake that only one value of a single byte reveals. The frame below has another value there.
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

/// Returns the frame with a signature, and with the CRC of a signed frame.
fn signed(frame: &[u8]) -> Vec<u8> {
    let mut signed = [frame, &[7; 13]].concat();
    signed[2] = 1;
    assert!(mavlink::layout_v2(DIALECT).seal(&mut signed));
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
        // Sealing must restore the sync, the checksum and the terminator.
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

/// Lengths that no random layout has: below 0, and of 2 to the power of 63 bytes or more.
#[test]
fn impossible_lengths_are_rejected() {
    let field = LengthField::byte(1);
    let negative = LengthField { plus: -5, ..field };
    let great = LengthField {
        number: Number::new(1, 4, ByteOrder::Big),
        factor: u32::MAX,
        plus: 5,
        ..field
    };
    for (field, why) in [
        (negative, DiscardReason::BadHeader),
        (great, DiscardReason::TooLong),
    ] {
        let layout = built(&Layout {
            sync: Patterns::one(b"$"),
            length: Length::Field(field),
            longest: 10,
            ..Layout::NONE
        });
        let bytes = [0x24, 0xFF, 0xFF, 0xFF, 0xFF];
        let bytes = if field.plus < 0 {
            &[0x24, 3][..]
        } else {
            &bytes
        };
        assert_eq!(
            layout.classify(bytes),
            Classification::Rejected(why),
            "{layout:?}"
        );
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
