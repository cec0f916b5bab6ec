/// A frame: `#`, the length of the text (at most 22), and the text.
#[derive(Clone, Copy)]
struct Text;

impl Format for Text {
    const LONGEST: usize = 24;
    type Message<'a> = &'a [u8];

    fn classify(&self, bytes: &[u8]) -> Classification {
        match *bytes {
            [b'#'] => Classification::Incomplete { at_least: 2 },
            [b'#', length, ..] if length > 22 => Classification::Rejected(DiscardReason::TooLong),
            [b'#', length, ..] => match 2 + usize::from(length) {
                whole if bytes.len() < whole => Classification::Incomplete { at_least: whole },
                whole => Classification::Frame(whole),
            },
            _ => Classification::Rejected(DiscardReason::NoSync),
        }
    }

    fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] { &frame[2..] }
}
