//! Tests the receiver of frames of any length: runs of noise, buffers, and when it asks the format. The tests of
//! `framelock-oracles` compare the receiver with the naive reference.

use std::cell::{Cell, RefCell};

use framelock::{BufferedReceiver, Classification, DiscardReason, Format};

/// `'#' length payload`, where bit 6 of the last byte must be 1, as in a letter.
#[derive(Clone, Copy)]
pub(crate) struct Short;

impl Format for Short {
    const LONGEST: usize = 9;
    type Message<'a> = &'a [u8];

    fn classify(&self, bytes: &[u8]) -> Classification {
        let whole = match *bytes {
            [b'#'] => 2,
            [b'#', length, ..] if length > 7 => {
                return Classification::Rejected(DiscardReason::TooLong);
            }
            [b'#', length, ..] => 2 + usize::from(length),
            _ => return Classification::Rejected(DiscardReason::NoSync),
        };
        match bytes.get(whole - 1) {
            None => Classification::Incomplete { at_least: whole },
            Some(last) if last & 0x40 != 0 => Classification::Frame(whole),
            Some(_) => Classification::Rejected(DiscardReason::WrongTerminator),
        }
    }

    fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
        &frame[2..]
    }
}

/// The receiver asks the format about one byte, about two bytes, and about the whole frame.
#[test]
fn the_format_is_asked_only_when_it_has_enough_bytes() {
    #[derive(Clone, Copy)]
    struct Noted<'a>(&'a RefCell<Vec<usize>>);
    impl Format for Noted<'_> {
        const LONGEST: usize = 9;
        type Message<'a> = &'a [u8];
        fn classify(&self, bytes: &[u8]) -> Classification {
            self.0.borrow_mut().push(bytes.len());
            Short.classify(bytes)
        }
        fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
            Short.decode(frame)
        }
    }
    let asked = RefCell::new(Vec::new());
    let mut receiver = BufferedReceiver::<_, [u8; 9]>::new(Noted(&asked));
    let frames = b"#\x07bcdefgh".iter();
    let frames = frames.filter(|&&byte| receiver.push(byte).is_some());
    assert_eq!(frames.count(), 1);
    asked.borrow_mut().dedup();
    assert_eq!(asked.into_inner(), [1, 2, 9]);
}

/// In a text that arrives byte by byte, the receiver asks the format to search each byte for the delimiter once, not
/// all bytes again after each byte. It does not matter whether the program pushes the bytes or passes slices.
#[test]
fn bytes_that_were_searched_for_a_delimiter_are_not_searched_again() {
    /// `$`, text, and a line feed. The cell counts the bytes that the format examines.
    #[derive(Clone, Copy)]
    struct Text<'a>(&'a Cell<usize>);
    impl Format for Text<'_> {
        const LONGEST: usize = 100;
        type Message<'a> = &'a [u8];
        fn classify(&self, bytes: &[u8]) -> Classification {
            self.classify_after(bytes, 0)
        }
        fn classify_after(&self, bytes: &[u8], seen: usize) -> Classification {
            self.0.set(self.0.get() + bytes.len() - seen);
            if bytes[0] != b'$' {
                return Classification::Rejected(DiscardReason::NoSync);
            }
            match bytes[seen..].iter().position(|&byte| byte == b'\n') {
                Some(place) => Classification::Frame(seen + place + 1),
                None => Classification::Incomplete {
                    at_least: bytes.len() + 1,
                },
            }
        }
        fn starts(&self, byte: u8) -> bool {
            byte == b'$'
        }
        fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
            frame
        }
    }
    let frame = [b"$".as_slice(), &[b'x'; 98], b"\n"].concat();
    let stream = frame.repeat(3);
    // The test allows the format to examine one byte of each frame twice.
    let most = stream.len() + 3;

    let examined = Cell::new(0);
    let mut receiver = BufferedReceiver::<_, [u8; 200]>::new(Text(&examined));
    let pushed = stream.iter().filter(|&&byte| receiver.push(byte).is_some());
    assert_eq!(pushed.count(), 3);
    assert!(examined.get() <= most, "push: {}", examined.get());

    for size in [1, 7, 100] {
        examined.set(0);
        let mut frames = 0;
        for mut slice in stream.chunks(size) {
            while receiver.next(&mut slice).is_some() {
                frames += 1;
            }
        }
        assert_eq!(frames, 3);
        assert!(examined.get() <= most, "next: {}", examined.get());

        examined.set(0);
        for slice in stream.chunks(size) {
            receiver.feed(slice, |found| {
                frames += usize::from(found.message().is_some());
            });
        }
        assert_eq!(frames, 6);
        assert!(examined.get() <= most, "feed: {}", examined.get());
    }
}

/// One call of `found` reports all bytes up to the next byte that may begin a frame.
#[test]
fn noise_without_a_start_is_reported_together() {
    let mut receiver = BufferedReceiver::<_, [u8; 9]>::new(Short);
    let mut found = Vec::new();
    receiver.feed(b"noise#\x01a", |one| found.push(one.bytes()));
    assert_eq!(found, [5, 3]);
}

/// A shorter buffer could not hold the longest frame. A format whose longest frame has no bytes has no frames.
#[test]
fn a_borrowed_buffer_must_hold_the_longest_frame() {
    #[derive(Clone, Copy)]
    struct NoBytes;
    impl Format for NoBytes {
        const LONGEST: usize = 0;
        type Message<'a> = ();
        fn classify(&self, _: &[u8]) -> Classification {
            Classification::Rejected(DiscardReason::NoSync)
        }
        fn decode(&self, _: &[u8]) {}
    }
    let mut memory = [0; 9];
    assert!(BufferedReceiver::with_buffer(Short, &mut memory[..8]).is_none());
    assert!(BufferedReceiver::with_buffer(NoBytes, &mut memory[..]).is_none());
    let receiver = BufferedReceiver::with_buffer(Short, &mut memory[..]);
    let mut receiver = receiver.expect("it holds nine bytes");
    let frames = b"#\x01a#\x06bcdefg"
        .iter()
        .filter(|&&byte| receiver.push(byte).is_some());
    assert_eq!(frames.count(), 2);
}

/// A buffer that counts the bytes that change between two accesses.
struct Watched {
    bytes: [u8; 128],
    before: [u8; 128],
    changed: usize,
}

impl AsRef<[u8]> for Watched {
    fn as_ref(&self) -> &[u8] {
        &self.bytes
    }
}

impl AsMut<[u8]> for Watched {
    fn as_mut(&mut self) -> &mut [u8] {
        let pairs = self.bytes.iter().zip(&self.before);
        self.changed += pairs.filter(|(now, before)| now != before).count();
        self.before = self.bytes;
        &mut self.bytes
    }
}

/// Every byte is a false start that claims the longest frame, so 63 bytes are pending after each push from the 63rd on.
#[test]
fn a_buffer_of_two_frames_is_copied_less_than_once_per_byte() {
    #[derive(Clone, Copy)]
    struct Claimed<'a>(&'a Cell<usize>);
    impl Format for Claimed<'_> {
        const LONGEST: usize = 64;
        type Message<'a> = ();
        fn classify(&self, bytes: &[u8]) -> Classification {
            if bytes.len() < 64 {
                return Classification::Incomplete { at_least: 64 };
            }
            self.0.set(self.0.get() + 1);
            Classification::Rejected(DiscardReason::ChecksumMismatch)
        }
        fn decode(&self, _: &[u8]) {}
    }
    let rejected = Cell::new(0);
    let mut buffer = Watched {
        bytes: [0; 128],
        before: [0; 128],
        changed: 0,
    };
    let mut receiver =
        BufferedReceiver::with_buffer(Claimed(&rejected), &mut buffer).expect("it is long enough");
    let stream = (1..=250).cycle().step_by(7).take(10_000);
    for byte in stream {
        assert!(receiver.push(byte).is_none());
    }
    assert_eq!((receiver.pending(), rejected.get()), (63, 10_000 - 63));
    // Storing a byte changes one byte of the buffer. All other changes are copies.
    let copied = buffer.changed - 10_000;
    assert!(copied < 10_000, "{copied}");
}
