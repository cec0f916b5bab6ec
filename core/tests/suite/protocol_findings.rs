//! The lecture's examples, and other known properties of the protocol, as streams.

use framelock::lecture::Lecture;
use framelock::motion::{Bin, BinCrc8, Setpoint, crc8};
use framelock::{Encode, Line, LineEvent, Parser, Receiver};

/// Pushes the bytes one by one. Returns each delivered setpoint with the index of its frame's
/// last byte.
fn commits<P>(mut parser: P, bytes: &[u8]) -> Vec<(usize, Setpoint)>
where
    P: for<'a> Parser<Message<'a> = Setpoint> + 'static,
{
    let step = |(index, &byte)| parser.push(byte).map(|message| (index, message));
    bytes.iter().enumerate().filter_map(step).collect()
}

const FIRST: Setpoint = Setpoint {
    pitch: 0x7F,
    roll: 0xC8,
    yaw: 0x4A,
};
const SECOND: Setpoint = Setpoint {
    pitch: 0x82,
    roll: 0xC4,
    yaw: 0x4A,
};

#[test]
fn the_lectures_first_example() {
    let bytes = [0x41, 0x42, 0x00, 0x7F, 0xC8, 0x4A, 0x0D];
    let mut machine = Lecture::new();
    let mut temps = Vec::new();
    for byte in bytes {
        machine.push(byte);
        temps.push(<[u8; 3]>::from(machine.temp));
    }
    assert_eq!(temps[2], [0, 0, 0]);
    assert_eq!(temps[3], [0x7F, 0, 0]);
    assert_eq!(temps[4], [0x7F, 0xC8, 0]);
    assert_eq!(temps[5], [0x7F, 0xC8, 0x4A]);
    assert_eq!(commits(Lecture::new(), &bytes), [(6, FIRST)]);
    assert_eq!(commits(Receiver::<Bin>::new(), &bytes), [(6, FIRST)]);
}

#[test]
fn the_lectures_second_example() {
    let sent = [Bin::encode(FIRST), Bin::encode(SECOND)].concat();
    let received = [&sent[..3], &sent[5..]].concat();
    assert_eq!(
        received,
        [
            0x41, 0x42, 0x00, 0x4A, 0x0D, 0x41, 0x42, 0x00, 0x82, 0xC4, 0x4A, 0x0D
        ]
    );
    let mut machine = Lecture::new();
    assert_eq!(
        received[..6].iter().find_map(|&byte| machine.push(byte)),
        None
    );
    assert_eq!(
        machine.temp,
        Setpoint {
            pitch: 0x4A,
            roll: 0x0D,
            yaw: 0x41
        }
    );
    assert_eq!(commits(Lecture::new(), &received), []);
    assert_eq!(commits(Receiver::<Bin>::new(), &received), [(11, SECOND)]);
}

fn frame_of(payload: [u8; 4]) -> [u8; 7] {
    let [reserved, pitch, roll, yaw] = payload;
    [b'A', b'B', reserved, pitch, roll, yaw, b'\r']
}

/// Returns a stream that repeats one frame 300 times, without the first `missing` bytes of the stream.
fn parked(payload: [u8; 4], missing: usize) -> Vec<u8> {
    frame_of(payload).repeat(300)[missing..].to_vec()
}

/// Finding 1: a sender repeats one frame. If one, two or three bytes are lost, the lecture's machine may never commit
/// again.
#[test]
fn the_lectures_machine_goes_deaf_and_the_receiver_does_not() {
    let payload = [0x00, 0x41, 0x42, 0x00];
    for missing in 1..=3 {
        let stream = parked(payload, missing);
        assert_eq!(commits(Lecture::new(), &stream), []);
        let delivered = commits(Receiver::<Bin>::new(), &stream);
        assert_eq!(delivered.len(), 299);
        assert!(
            delivered
                .iter()
                .all(|&(_, setpoint)| setpoint == Setpoint::from(*b"AB\0"))
        );
    }
    // The machine stays deaf for ever, because after each frame it is in the same state again.
    let mut machine = Lecture::new();
    machine.feed(&parked(payload, 1)[..13], |_| ());
    let after_one = machine;
    machine.feed(&frame_of(payload), |_| ());
    assert_eq!(machine, after_one);
}

/// Finding 1 in numbers: there are 256 payloads in which each of the four bytes is 0D, 41, 42 or 80. 39 of these
/// payloads can make the lecture's machine deaf if a sender repeats one of them. None of the 256 makes the receiver
/// deaf.
#[test]
fn how_many_constant_payloads_can_make_it_deaf() {
    let alphabet = [0x0D, 0x41, 0x42, 0x80];
    let (mut deaf_discarding, mut deaf_rescanning) = (0, 0);
    for index in 0..256_usize {
        let payload = [0, 2, 4, 6].map(|shift| alphabet[index >> shift & 3]);
        let deaf = |parser: fn(&[u8]) -> usize| {
            (1..7).any(|missing| parser(&parked(payload, missing)) == 0)
        };
        deaf_discarding += usize::from(deaf(|stream| commits(Lecture::new(), stream).len()));
        deaf_rescanning +=
            usize::from(deaf(|stream| commits(Receiver::<Bin>::new(), stream).len()));
    }
    assert_eq!((deaf_discarding, deaf_rescanning), (39, 0));
}

/// Finding 2: payloads `(0D 41 42 x)` and `(x 0D 41 42)` make a repeated frame ambiguous. A receiver that joins at the
/// wrong byte delivers setpoints that nobody sent, for ever. After an idle gap, the receiver delivers the setpoints
/// that were sent.
#[test]
fn ambiguous_payloads_and_the_idle_gap_that_ends_them() {
    let mut ambiguous = 0;
    for x in 0..=u8::MAX {
        for payload in [[0x0D, 0x41, 0x42, x], [x, 0x0D, 0x41, 0x42]] {
            ambiguous += 1;
            let sent = Setpoint::from([payload[1], payload[2], payload[3]]);
            let wrong_for_ever = (1..7).any(|missing| {
                let delivered = commits(Receiver::<Bin>::new(), &parked(payload, missing));
                delivered.len() >= 298 && delivered.iter().all(|&(_, setpoint)| setpoint != sent)
            });
            assert!(wrong_for_ever, "{payload:02X?}");

            for missing in 1..7 {
                let mut line = Line::new(Receiver::<Bin>::new());
                line.feed(&parked(payload, missing), |_| ());
                line.line_event(LineEvent::Idle, |_| ());
                let mut after = Vec::new();
                line.feed(&parked(payload, 0), |found| after.extend(found.message()));
                assert_eq!(after, vec![sent; 300], "{payload:02X?}");
            }
        }
    }
    assert_eq!(ambiguous, 512);
}

/// With BIN-CRC8, no frame that is repeated without a pause gives a wrong setpoint. Only one repeated stream contains
/// frames at two offsets. These frames have the payloads 0A 0D 41 42 and EF 0D 41 42, so both have the same setpoint.
#[test]
fn repeated_frames_of_bin_crc8_give_no_wrong_setpoint() {
    // A repeated frame can contain another frame only if CR, A and B follow one another in its payload, or if its
    // payload ends with CR and A and its checksum is B.
    let wholes = (0..=u8::MAX).flat_map(|x| [[0x0D, 0x41, 0x42, x], [x, 0x0D, 0x41, 0x42]]);
    let cut = (0..=u16::MAX).map(|x| [x.to_be_bytes()[0], x.to_be_bytes()[1], 0x0D, 0x41]);
    let mut at_two_offsets = Vec::new();
    for payload in wholes.chain(cut) {
        let [reserved, pitch, roll, yaw] = payload;
        let frame = [0x41, 0x42, reserved, pitch, roll, yaw, crc8(payload), 0x0D];
        let stream = frame.repeat(3);
        for missing in 1..8 {
            let received = commits(Receiver::<BinCrc8>::new(), &stream[missing..]);
            let sent = Setpoint { pitch, roll, yaw };
            assert!(received.iter().all(|&(_, setpoint)| setpoint == sent));
            if received[0].0 + missing != 15 {
                at_two_offsets.push((payload, missing));
            }
        }
    }
    let [first, second] = [0x0A, 0xEF].map(|reserved| [reserved, 0x0D, 0x41, 0x42]);
    let expected = [first, second].map(|payload| (1..=4).map(move |missing| (payload, missing)));
    assert!(
        at_two_offsets
            .into_iter()
            .eq(expected.into_iter().flatten())
    );
}

/// Finding 4: a changed byte goes unnoticed at 4 of 7 positions. At 3 of these 4 positions, it changes the setpoint.
#[test]
fn a_substituted_byte_goes_unnoticed_in_four_of_seven_places() {
    let sent = frame_of([0x10, 0x20, 0x30, 0x50]);
    let mut unnoticed = Vec::new();
    for place in 0..7 {
        for byte in (0..=u8::MAX).filter(|&byte| byte != sent[place]) {
            let mut received = sent;
            received[place] = byte;
            let rescanned = commits(Receiver::<Bin>::new(), &received);
            assert_eq!(commits(Lecture::new(), &received), rescanned);
            if let [(6, setpoint)] = rescanned[..] {
                unnoticed.push((place, setpoint != Setpoint::from([0x20, 0x30, 0x50])));
            }
        }
    }
    unnoticed.dedup();
    assert_eq!(unnoticed, [(2, false), (3, true), (4, true), (5, true)]);
}
