//! Tests the sizes in bytes that the crate's first page states, except those of `PacketReceiver` and `Reader`.

use framelock::lecture::Lecture;
use framelock::motion::{Bin, BinCrc8, Failsafe};
use framelock::{BufferedReceiver, FixedFormat, Line, Receiver, Shape};

/// A format with frames of sixteen bytes, the longest fixed length.
enum Longest {}

impl FixedFormat for Longest {
    type Frame = [u8; 16];
    type Message = ();
    const SHAPE: Shape<[u8; 16]> = Shape::new([Some(b'A'); 16]);

    fn decode(_: [u8; 16]) {}
}

#[test]
fn state_is_as_small_as_the_table_says() {
    assert_eq!(size_of::<Receiver<Bin>>(), 8);
    assert_eq!(size_of::<Receiver<BinCrc8>>(), 8);
    assert_eq!(size_of::<Receiver<Longest>>(), 16);
    assert_eq!(size_of::<Lecture>(), 4);
    let line = size_of::<Line<Receiver<Bin>>>();
    assert_eq!(line, 8 + 20 * 4);
    assert_eq!(
        size_of::<BufferedReceiver<Bin, [u8; 64]>>(),
        64 + 3 * size_of::<usize>()
    );
    assert_eq!(size_of::<Failsafe<u8, 3>>(), 104);
}
