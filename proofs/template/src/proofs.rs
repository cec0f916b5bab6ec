//! Theorems about the format, each for all inputs. `cargo kani` or the offline prover checks them. `laws` shows that
//! the format keeps the laws on which the theorems about `BufferedReceiver` rely.
//!
//! The number in `kani::unwind` bounds the repetitions of each loop. For a layout, the longest frame plus 2 is enough.
//! If the number is too small, the proof fails, and says so.

use framelock::{Classification, Format};

use crate::{Motor, OwnFrame, encode};

const LONGEST: usize = OwnFrame::LONGEST;

fn any_motor() -> Motor {
    Motor {
        angle: kani::any(),
        temperature: kani::any::<bool>().then(kani::any),
    }
}

/// Laws 1 to 5 of `Format`, for all bytes and any two lengths.
#[kani::proof]
#[kani::unwind(8)]
fn laws() {
    let bytes: [u8; LONGEST] = kani::any();
    let some = kani::any_where(|some: &usize| (1..=LONGEST).contains(some));
    let more = kani::any_where(|more: &usize| (some..=LONGEST).contains(more));
    let early = OwnFrame.classify(&bytes[..some]);
    let late = OwnFrame.classify(&bytes[..more]);
    match early {
        Classification::Frame(length) => {
            assert!((1..=some).contains(&length), "law 1");
            assert!(late == early, "law 2");
        }
        Classification::Rejected(_) => assert!(late == early, "law 2"),
        Classification::Incomplete { at_least } => {
            assert!(some < at_least && at_least <= LONGEST, "law 1");
            let is_incomplete = matches!(late, Classification::Incomplete { .. });
            assert!(more >= at_least || is_incomplete, "law 3");
            assert!(
                OwnFrame.classify_after(&bytes[..more], some) == late,
                "law 5"
            );
        }
    }
    let is_rejected = matches!(late, Classification::Rejected(_));
    assert!(OwnFrame.starts(bytes[0]) || is_rejected, "law 4");
    kani::cover!(
        early != late && late == Classification::Frame(LONGEST),
        "the longest frame"
    );
    kani::cover!(early != late && is_rejected, "a rejected frame");
}

/// `decode` does not panic, whatever a frame contains.
#[kani::proof]
#[kani::unwind(8)]
fn no_panic() {
    let bytes: [u8; LONGEST] = kani::any();
    if let Classification::Frame(length) = OwnFrame.classify(&bytes) {
        let motor = OwnFrame.decode(&bytes[..length]);
        kani::cover!(motor.temperature.is_none(), "a short frame");
    }
}

/// A receiver reads from a frame the values that were encoded.
#[kani::proof]
#[kani::unwind(8)]
fn round_trip() {
    let motor = any_motor();
    let mut buffer = [0; LONGEST];
    let frame = encode(motor, &mut buffer);
    assert!(OwnFrame.classify(frame) == Classification::Frame(frame.len()));
    assert!(OwnFrame.decode(frame) == motor);
    kani::cover!(motor.temperature == Some(-40), "a long frame");
}

/// A frame from the specification, byte by byte, has the values that the specification states. This harness notices
/// a mistake that `encode` and `decode` share, such as the wrong byte order. `round_trip` cannot notice it.
#[kani::proof]
#[kani::unwind(8)]
fn frame_of_the_specification() {
    const FRAME: [u8; LONGEST] = [0xAA, 0x03, 0x02, 0x01, 0x15, 0xC5];
    const VALUES: Motor = Motor {
        angle: 258,
        temperature: Some(21),
    };
    assert!(OwnFrame.classify(&FRAME) == Classification::Frame(LONGEST));
    assert!(OwnFrame.decode(&FRAME) == VALUES);
    assert!(encode(VALUES, &mut [0; LONGEST]) == FRAME);
    kani::cover!();
}

/// A theorem of your own: if one byte of a frame is wrong, `classify` does not accept the bytes as a frame of the same
/// length.
#[kani::proof]
#[kani::unwind(8)]
fn one_wrong_byte_is_noticed() {
    let mut buffer = [0; LONGEST];
    let length = encode(any_motor(), &mut buffer).len();
    let place = kani::any_where(|place: &usize| *place < length);
    let wrong: u8 = kani::any_where(|wrong: &u8| *wrong != buffer[place]);
    buffer[place] = wrong;
    assert!(OwnFrame.classify(&buffer[..length]) != Classification::Frame(length));
    kani::cover!(place == 2, "a wrong payload");
}
