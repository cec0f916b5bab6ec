//! iBUS frames from Betaflight's unit tests, `rx_ibus_unittest.cc` and `telemetry_ibus_unittest.cc`.

use framelock_description::{Description, hex, shipped};

use crate::values;

/// Returns the values of frames.
fn shown(name: &str, frames: &[&str]) -> Vec<String> {
    let description = Description::parse(name, shipped(name).unwrap()).unwrap();
    let values = frames.iter().map(|frame| {
        let frame = hex::parse(&[frame]).unwrap();
        let format = framelock::Format::classify(description.format(), &frame);
        assert_eq!(format, framelock::Classification::Frame(frame.len()));
        let fields = values(&description.kinds[0], &frame).into_iter();
        fields
            .map(|(_, values)| values)
            .collect::<Vec<_>>()
            .join(" ")
    });
    values.collect()
}

#[test]
fn a_servo_frame_with_another_command() {
    let frame = "20 00 00 00 01 00 02 00 03 00 04 00 05 00 06 00 07 00 08 00 09 00 \
        00 00 00 00 00 00 00 00 B2 FF";
    assert_eq!(
        shown("ibus-any", &[frame]),
        ["0 0 1 2 3 4 5 6 7 8 9 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0"]
    );
}

#[test]
fn telemetry() {
    let frames = [
        "04 81 7A FF",
        "04 91 6A FF",
        "06 91 03 02 63 FF",
        "06 A1 64 00 F4 FE",
        "06 A2 84 03 D0 FE",
    ];
    assert_eq!(
        shown("ibus-telemetry", &frames),
        ["1 8 x", "1 9 x", "1 9 x0302", "1 10 x6400", "2 10 x8403"]
    );
}
