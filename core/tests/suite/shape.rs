//! Tests that a shape finds the first wrong position of a frame.

use framelock::motion::Bin;
use framelock::{FixedFormat, Shape};

#[test]
fn the_first_wrong_place_is_told() {
    let wrong_place = |frame: &[u8; 7]| Bin::SHAPE.wrong_place(*frame);
    assert_eq!(wrong_place(b"AB\0xyz\r"), None);
    assert_eq!(wrong_place(b"aB\0xyz\n"), Some(0));
    assert_eq!(wrong_place(b"AC\0xyz\n"), Some(1));
    assert_eq!(wrong_place(b"AB\0xyz\n"), Some(6));
    let shape = Shape::new([Some(0x80); 16]);
    for place in 0..16 {
        let mut frame = [0x80; 16];
        frame[place..].fill(0x81);
        assert_eq!(shape.wrong_place(frame), Some(place));
    }
}
