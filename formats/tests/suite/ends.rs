//! Tests layouts of common protocols: frames that end with silence (Modbus RTU), checksums after the terminator, and
//! unusual sums and XORs.

use std::cell::Cell;

use framelock::{BufferedReceiver, Counters, Format as _, Line, LineEvent};
use framelock_formats::AnyOf;
use framelock_formats::layout::{
    Algorithm, CheckedLayout, Checksum, Crc, Encoding, FixedBits, Layout, Length, LengthField,
    Patterns,
};
use framelock_formats::modbus;
use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};

use crate::built;
use crate::laws::keeps_the_laws;

/// A byte or a line event.
type Step = Result<u8, LineEvent>;

fn bytes(bytes: &[u8]) -> Vec<Step> {
    bytes.iter().copied().map(Ok).collect()
}

/// Returns the frames of these kinds that a line delivers, and the line's counters.
fn received(kinds: &[CheckedLayout<'static>], line: &[Step]) -> (Vec<Vec<u8>>, Counters) {
    let format = AnyOf(&*kinds.to_vec().leak());
    let buffer = vec![0; 2 * format.longest()];
    let receiver = BufferedReceiver::with_buffer(format, buffer).expect("it holds the longest");
    let (mut line_of, mut frames) = (Line::new(receiver), Vec::new());
    for step in line {
        match *step {
            Ok(byte) => line_of.feed(&[byte], |found| {
                frames.extend(found.message().map(|frame| frame.bytes().to_vec()));
            }),
            Err(event) => line_of.line_event(event, |found| {
                frames.extend(found.message().map(|frame| frame.bytes().to_vec()));
            }),
        }
    }
    let counters = *line_of.counters();
    (frames, counters)
}

fn crc(bytes: &[u8]) -> [u8; 2] {
    let crc = crc::Crc::<u16>::new(&crc::CRC_16_MODBUS);
    crc.checksum(bytes).to_le_bytes()
}

fn modbus(message: &[u8]) -> Vec<u8> {
    [message, &crc(message)].concat()
}

/// Returns the longest suffix of the bytes that is a Modbus RTU frame.
fn longest_suffix(bytes: &[u8]) -> Option<&[u8]> {
    let is_frame = |frame: &&[u8]| {
        let (message, sum) = frame.split_last_chunk::<2>().expect("it is long enough");
        frame.len() <= 256 && crc(message) == *sum
    };
    (0..=bytes.len().checked_sub(4)?)
        .map(|from| &bytes[from..])
        .find(is_frame)
}

/// Returns a mixture of frames, noise and line events. Some of the frames have a changed or a lost byte.
fn line() -> impl Strategy<Value = Vec<Step>> {
    let some = |count| prop::collection::vec(any::<u8>(), count);
    let fault = prop::option::weighted(0.3, (any::<prop::sample::Index>(), any::<u8>()));
    let frame = (some(2..20), fault).prop_map(|(message, fault)| {
        let mut frame = modbus(&message);
        match fault {
            Some((at, change)) if change < 128 => frame[at.index(message.len())] ^= change,
            Some((at, _)) => drop(frame.remove(at.index(message.len()))),
            None => {}
        }
        bytes(&frame)
    });
    let error = prop_oneof![
        Just(LineEvent::Framing),
        Just(LineEvent::Parity),
        Just(LineEvent::Overrun)
    ];
    let event = prop_oneof![
        6 => Just(LineEvent::Idle),
        1 => Just(LineEvent::Break),
        1 => error
    ];
    let step = prop_oneof![
        4 => frame,
        1 => some(0..20).prop_map(|noise| bytes(&noise)),
        4 => event.prop_map(|event| vec![Err(event)]),
    ];
    prop::collection::vec(step, 0..16).prop_map(|steps| steps.concat())
}

/// At each pause or break, the receiver delivers only the longest frame that ends there and begins after the previous
/// event.
#[test]
fn the_longest_suffix_before_a_pause_is_delivered() {
    let (all, with_noise) = (Cell::new(0), Cell::new(0));
    let mut runner = TestRunner::new(ProptestConfig {
        cases: 3_000,
        rng_seed: RngSeed::Fixed(1),
        ..ProptestConfig::default()
    });
    let result = runner.run(&line(), |line| {
        let mut expected = Vec::new();
        for stretch in line.split_inclusive(Result::is_err) {
            let silent = [Err(LineEvent::Idle), Err(LineEvent::Break)];
            let pending: Vec<u8> = stretch.iter().filter_map(|step| step.ok()).collect();
            if let Some(frame) = longest_suffix(&pending)
                && stretch.ends_with(&silent[..1]) | stretch.ends_with(&silent[1..])
            {
                expected.push(frame.to_vec());
                all.set(all.get() + 1);
                with_noise.set(with_noise.get() + u32::from(frame.len() < pending.len()));
            }
        }
        let (frames, _) = received(&[modbus::LAYOUT], &line);
        prop_assert_eq!(frames, expected, "{:02X?}", line);
        Ok(())
    });
    result.unwrap_or_else(|why| panic!("{why}"));
    assert!(
        all.get() > 2_000 && with_noise.get() > 500,
        "{all:?}, {with_noise:?}"
    );
}

/// If two frames have no pause between them, only the second frame is delivered. A pause inside a frame costs this
/// frame. An error delivers nothing. The longest frame has 256 bytes.
#[test]
fn missed_and_false_pauses_and_the_longest_frame() {
    let [first, second] = [b"\x01\x03\x02\x00\x07", b"\x02\x03\x02\x12\x34"].map(|it| modbus(it));
    let of = |parts: &[(&[u8], LineEvent)]| {
        let steps = parts
            .iter()
            .map(|(part, event)| [bytes(part), vec![Err(*event)]].concat());
        received(&[modbus::LAYOUT], &steps.collect::<Vec<_>>().concat())
    };
    let idle = LineEvent::Idle;
    assert_eq!(of(&[(&[&first[..], &second].concat(), idle)]).0, [&*second]);
    for at in 1..first.len() {
        let (before, after) = first.split_at(at);
        assert_eq!(
            of(&[(before, idle), (after, idle), (&second, idle)]).0,
            [&*second]
        );
    }
    assert!(of(&[(&first, LineEvent::Overrun)]).0.is_empty());
    for (count, frames) in [(254, 1), (255, 0)] {
        assert_eq!(of(&[(&modbus(&vec![1; count]), idle)]).0.len(), frames);
    }

    // The discarded first byte counts as a checksum mismatch, not as discarded at a line event.
    let broken = [&first[..6], &[first[6] ^ 1]].concat();
    let (frames, counters) = of(&[(&broken, idle)]);
    assert!(frames.is_empty());
    assert_eq!(counters.discarded.total(), 7);
    assert!(counters.discarded.checksum_mismatch >= 1, "{counters:?}");
}

/// A kind whose frames end with silence receives the frames that all other kinds reject, whatever the order of the
/// kinds.
#[test]
fn silence_beside_other_kinds() {
    let read = Layout {
        fixed: &[FixedBits {
            at: 1,
            mask: 0xFF,
            value: 3,
        }],
        checksum: modbus::LAYOUT.checksum,
        ..Layout::NONE
    };
    let request = built(&Layout { longest: 8, ..read });
    let response = built(&Layout {
        length: Length::Field(LengthField {
            plus: 5,
            ..LengthField::byte(2)
        }),
        longest: 255,
        ..read
    });
    let sent = [
        &b"\x01\x03\x70\x02\x00\x01"[..],
        b"\x01\x03\x02\x00\x07",
        b"\x01\x10\x00\x01\x00\x01\x02\x00\x07",
    ];
    let sent = sent.map(modbus);
    let line: Vec<Step> = sent
        .iter()
        .flat_map(|frame| [bytes(frame), vec![Err(LineEvent::Idle)]].concat())
        .collect();
    for kinds in [
        [request, response, modbus::LAYOUT],
        [modbus::LAYOUT, response, request],
        [response, modbus::LAYOUT, request],
    ] {
        let (frames, counters) = received(&kinds, &line);
        assert_eq!(frames, sent);
        assert_eq!(counters.discarded.total(), 0);
        keeps_the_laws(&AnyOf(&kinds), &sent);
    }
}

/// A checksum byte that makes the sum of all bytes zero, modulo 256.
const NEGATED: Checksum = Checksum {
    initial: 0xFF,
    xor_out: 0xFF,
    ..Checksum::at_the_end(1)
};

const fn fixed_length(
    sync: &'static [u8],
    longest: usize,
    checksum: Checksum<'static>,
) -> Layout<'static> {
    Layout {
        sync: Patterns::one(sync),
        longest,
        checksum: Some(checksum),
        ..Layout::NONE
    }
}

/// Each protocol's name, its layout, one of its frames, and the number of bytes at the frame's end that nothing checks.
#[rustfmt::skip]
const PROTOCOLS: &[(&str, Layout, &[u8], usize)] = &[
    ("VE.Direct", Layout {
        length: Length::Delimiter,
        longest: 400,
        terminator: Patterns::one(b"Checksum\t"),
        behind: 1,
        ..fixed_length(b"\r\n", 0, NEGATED)
    }, b"\r\nPID\t0xA071\r\nV\t22000\r\nI\t0\r\nVPV\t0\r\nPPV\t0\r\nMPPT\t0\r\nCS\t0\r\nOR\t0x00000001\r\nERR\t0\r\nLOAD\tOFF\r\n\
         H19\t1077\r\nH20\t0\r\nH21\t4\r\nH22\t117\r\nH23\t921\r\nHSDS\t16\r\nChecksum\t\xC4", 0),
    ("IEC 62056-21, with a block check character after ETX", Layout {
        length: Length::Delimiter,
        longest: 200,
        terminator: Patterns::one(b"\x03"),
        behind: 1,
        ..fixed_length(b"\x02", 0, Checksum { algorithm: Algorithm::Xor, from: 1, ..Checksum::at_the_end(1) })
    }, b"\x021.8.0(000123.456*kWh)\r\n2.8.0(000000.000*kWh)\r\n!\r\n\x03!", 0),
    ("DSMR P1", Layout {
        length: Length::Delimiter,
        longest: 2048,
        terminator: Patterns::one(b"!"),
        behind: 6,
        ..fixed_length(b"/", 0, Checksum {
            algorithm: Algorithm::Crc(Crc { reflected_in: true, reflected_out: true, ..Crc::new(16, 0x8005) }),
            encoding: Encoding::Hex,
            at: -6,
            to: -7,
            ..Checksum::at_the_end(2)
        })
    }, b"/Ene5\\T210-D ESMR5.0\r\n\r\n1-0:1.8.1(000050.134*kWh)\r\n!4E20\r\n", 2),
    ("Modbus ASCII", Layout {
        length: Length::Delimiter,
        longest: 513,
        terminator: Patterns::one(b"\r\n"),
        ..fixed_length(b":", 0, Checksum {
            encoding: Encoding::Hex,
            over_hex_digits: true,
            from: 1,
            at: -4,
            to: -5,
            ..NEGATED
        })
    }, b":0403020004F3\r\n", 0),
    ("Z-Wave", Layout {
        length: Length::Field(LengthField { plus: 2, ..LengthField::byte(1) }),
        ..fixed_length(b"\x01", 66, Checksum { algorithm: Algorithm::Xor, initial: 0xFF, from: 1, ..Checksum::at_the_end(1) })
    }, b"\x01\x03\x00\x02\xFE", 0),
    ("Moza", Layout {
        length: Length::Field(LengthField { plus: 5, ..LengthField::byte(1) }),
        ..fixed_length(b"\x7E", 69, Checksum { initial: 0x0D, ..Checksum::at_the_end(1) })
    }, b"\x7E\x03\x40\x13\x01\x00\x00\xE2", 0),
    ("LG's air conditioners",
        fixed_length(b"\xA8", 13, Checksum { xor_out: 0x55, ..Checksum::at_the_end(1) }),
        b"\xA8\x12\x40\x00\x00\x00\x08\x28\x00\x00\x00\x00\x7F", 0),
    ("hoverboard",
        fixed_length(b"\xCD\xAB", 18, Checksum { algorithm: Algorithm::XorWords, ..Checksum::at_the_end(2) }),
        b"\xCD\xAB\0\0\0\0\x64\0\x9C\xFF\x9D\x0E\x2B\x01\0\0\x83\x5B", 0),
    ("a sum of big-endian words behind a delimiter", Layout {
        length: Length::Delimiter,
        longest: 12,
        terminator: Patterns::one(b"!"),
        behind: 2,
        ..fixed_length(b"A", 0, Checksum { algorithm: Algorithm::SumWords, encoding: Encoding::Big, ..Checksum::at_the_end(2) })
    // 0x4101 + 0x02FF + 0x2100
    }, b"A\x01\x02\xFF!\x65\x00", 0),
    ("S.Port",
        fixed_length(b"\x10", 8, Checksum { algorithm: Algorithm::CarrySum, xor_out: 0xFF, ..Checksum::at_the_end(1) }),
        b"\x10\x01\xF1\x34\0\0\0\xC8", 0),
];

/// Frames of these protocols are delivered. A frame with a changed byte is not. Sealing writes the same checksum.
#[test]
fn checksums_as_protocols_have_them() {
    for (name, layout, frame, unchecked) in PROTOCOLS {
        let layouts = [built(layout)];
        let (frames, counters) = received(&layouts, &bytes(&frame.repeat(3)));
        assert_eq!(frames, [*frame; 3], "{name}");
        assert_eq!(counters.discarded.total(), 0, "{name}");
        for at in 0..frame.len() - unchecked {
            let mut changed = frame.to_vec();
            changed[at] ^= 1;
            let line = [bytes(&changed), vec![Err(LineEvent::Idle)]].concat();
            assert!(received(&layouts, &line).0.is_empty(), "{name}: {at}");
        }
        let checksum = layout.checksum.expect("each has one");
        let at = frame.len() - usize::from(checksum.at.unsigned_abs());
        let mut sealed = frame.to_vec();
        sealed[at..][..checksum.encoded_bytes()].fill(b'0');
        assert!(layouts[0].seal(&mut sealed), "{name}");
        assert_eq!(sealed, *frame, "{name}");
        if frame.len() < 20 {
            keeps_the_laws(&AnyOf(&layouts), &[frame.to_vec()]);
        }
    }
}
