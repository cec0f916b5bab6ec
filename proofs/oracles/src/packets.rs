//! Target `packets`: packets between delimiters, with any byte stuffing, and a stream of any bytes and line events.

use arbitrary::{Arbitrary, Unstructured};
use framelock::{
    Classification, Codes, Counters, DiscardReason, Format, Found, Frame, Line, LineEvent,
    PacketFormat, PacketReceiver, Parser, Stuffing,
};

use crate::outcome::{Occurred, as_counter};
use crate::stream::{Stream, StreamStep};

/// A format of packets, and a stream.
#[derive(Debug)]
pub struct AnyPackets {
    /// The format.
    pub format: Packets,
    /// The stream.
    pub stream: Stream,
}

/// A format of packets.
#[derive(Clone, Copy, Debug)]
pub struct Packets {
    /// The byte stuffing.
    pub stuffing: Stuffing,
    /// The property that makes a packet a frame.
    pub check: PacketCheck,
    /// The number of bytes in the longest frame, at least 1.
    pub most: usize,
}

/// The property that makes a packet a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum PacketCheck {
    /// Every packet is a frame.
    None,
    /// The XOR of all bytes is 0. The delimiter ends the frame.
    Xor,
    /// The first byte is the number of bytes that follow, 1 to 127. The XOR of all bytes is 0. The frame ends
    /// with its last byte, before the delimiter.
    LengthAndXor,
}

impl<'a> Arbitrary<'a> for AnyPackets {
    fn arbitrary(u: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        let [kind, check, most]: [u8; 3] = u.arbitrary()?;
        let stuffing = match kind % 8 {
            0 => Stuffing::SLIP,
            1 => Stuffing::HDLC,
            2 => Stuffing::Cobs,
            3 => Stuffing::DLE,
            4 => Stuffing::Doubled {
                escape: 0x10,
                start: None,
                end: 0x03,
            },
            5 => Stuffing::Break,
            6 => Stuffing::Escape {
                delimiter: u.arbitrary()?,
                escape: u.arbitrary()?,
                codes: if u.arbitrary()? {
                    Codes::Xor(u.arbitrary()?)
                } else {
                    Codes::Pair {
                        delimiter: u.arbitrary()?,
                        escape: u.arbitrary()?,
                    }
                },
            },
            _ => Stuffing::Doubled {
                escape: u.arbitrary()?,
                start: u.arbitrary()?,
                end: u.arbitrary()?,
            },
        };
        let check = match check % 3 {
            0 => PacketCheck::None,
            1 => PacketCheck::Xor,
            _ => PacketCheck::LengthAndXor,
        };
        Ok(Self {
            format: Packets {
                stuffing,
                check,
                most: 1 + 2 * usize::from(most),
            },
            stream: u.arbitrary()?,
        })
    }
}

impl Format for Packets {
    const LONGEST: usize = 512;
    type Message<'a> = &'a [u8];

    fn longest(&self) -> usize {
        match self.check {
            PacketCheck::LengthAndXor => self.most,
            _ => self.most + 1,
        }
    }

    fn classify(&self, bytes: &[u8]) -> Classification {
        assert!((1..=self.longest()).contains(&bytes.len()));
        let whole = match self.check {
            PacketCheck::LengthAndXor => 1 + usize::from(bytes[0]),
            _ => self.longest(),
        };
        if self.check == PacketCheck::LengthAndXor && !(1..=127).contains(&bytes[0]) {
            return Classification::Rejected(DiscardReason::BadHeader);
        }
        if whole > self.most && self.check == PacketCheck::LengthAndXor || bytes.len() > self.most {
            return Classification::Rejected(DiscardReason::TooLong);
        }
        match bytes.get(..whole) {
            None => Classification::Incomplete { at_least: whole },
            Some(frame) if xor(frame) == 0 => Classification::Frame(whole),
            Some(_) => Classification::Rejected(DiscardReason::ChecksumMismatch),
        }
    }

    fn classify_after(&self, bytes: &[u8], seen: usize) -> Classification {
        assert!(seen < bytes.len());
        self.classify(bytes)
    }

    fn classify_before(&self, bytes: &[u8], event: LineEvent) -> Classification {
        assert_eq!(event, LineEvent::Idle);
        assert!((1..=self.longest()).contains(&bytes.len()));
        match self.check {
            PacketCheck::LengthAndXor => Classification::Rejected(DiscardReason::LineEvent),
            PacketCheck::Xor if xor(bytes) != 0 => {
                Classification::Rejected(DiscardReason::ChecksumMismatch)
            }
            _ => Classification::Frame(bytes.len()),
        }
    }

    fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
        frame
    }
}

impl PacketFormat for Packets {
    fn stuffing(&self) -> Stuffing {
        self.stuffing
    }
}

fn xor(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum, byte| sum ^ byte)
}

/// A delivered packet.
#[derive(Clone, PartialEq, Eq, Debug)]
struct Delivery {
    /// The unstuffed bytes.
    packet: Vec<u8>,
    /// The number of received bytes that count as bytes of the packet.
    received: usize,
    /// The index of the item that completes the packet.
    at: usize,
}

/// A byte, or a line event.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Item {
    Byte(u8),
    Event(LineEvent),
}

/// The naive definition of packets. It sees the whole stream.
impl Packets {
    /// Returns the packets of a stream.
    fn deliveries(&self, items: &[Item]) -> Vec<Delivery> {
        match self.stuffing {
            Stuffing::Doubled { escape, start, end } => self.framed(items, escape, start, end),
            _ => self.delimited(items),
        }
    }

    /// Splits the stream at the delimiters and the line events. A part can be a packet only if a delimiter precedes it,
    /// with at most pauses in between.
    fn delimited(&self, items: &[Item]) -> Vec<Delivery> {
        let is_delimiter = |item: Item| match self.stuffing {
            Stuffing::Escape { delimiter, .. } => item == Item::Byte(delimiter),
            Stuffing::Cobs => item == Item::Byte(0),
            _ => item == Item::Event(LineEvent::Break),
        };
        let mut deliveries = Vec::new();
        // How many bytes before the next part count as bytes of its packet. `None` if no delimiter precedes the part.
        let mut before = None;
        let mut from = 0;
        while from < items.len() {
            let bytes = items[from..].iter().map_while(|&item| match item {
                Item::Byte(byte) if !is_delimiter(item) => Some(byte),
                _ => None,
            });
            let part: Vec<u8> = bytes.collect();
            let next = items.get(from + part.len()).copied();
            let is_closed = next.is_some_and(is_delimiter);
            if let Some(before) = before
                && let Some((packet, length)) = self.whole(&part, is_closed)
            {
                let at = from + length - usize::from(self.check == PacketCheck::LengthAndXor);
                deliveries.push(Delivery {
                    packet,
                    received: before + length,
                    at,
                });
            }
            let is_empty = unstuffed(self.stuffing, &part) == (Some(Vec::new()), true);
            before = match next {
                None => break,
                Some(Item::Byte(_)) if is_empty => Some(before.map_or(0, |n| n + part.len()) + 1),
                Some(Item::Byte(_)) => Some(1),
                Some(Item::Event(_)) if is_closed => Some(0),
                Some(Item::Event(LineEvent::Idle)) if part.is_empty() => before,
                Some(Item::Event(_)) => None,
            };
            from += part.len() + 1;
        }
        deliveries
    }

    /// Returns the frame in the bytes after a delimiter, and how many of these bytes it needs.
    fn whole(&self, part: &[u8], is_closed: bool) -> Option<(Vec<u8>, usize)> {
        if self.check != PacketCheck::LengthAndXor {
            let (packet, is_complete) = unstuffed(self.stuffing, part);
            return packet
                .filter(|packet| is_closed && is_complete && self.is_frame(packet))
                .map(|packet| (packet, part.len()));
        }
        let prefixes =
            (1..=part.len()).map(|length| (unstuffed(self.stuffing, &part[..length]).0, length));
        let mut longer = prefixes.skip_while(|(packet, _)| {
            packet
                .as_ref()
                .is_some_and(|packet| packet.len() < 1 + usize::from(*packet.first().unwrap_or(&1)))
        });
        let (packet, length) = longer.next()?;
        Some((packet.filter(|packet| self.is_frame(packet))?, length))
    }

    fn is_frame(&self, packet: &[u8]) -> bool {
        let Some(&first) = packet.first() else {
            return false;
        };
        let has_right_length = (1..=127).contains(&first) && packet.len() == 1 + usize::from(first);
        packet.len() <= self.most
            && match self.check {
                PacketCheck::None => true,
                PacketCheck::Xor => xor(packet) == 0,
                PacketCheck::LengthAndXor => has_right_length && xor(packet) == 0,
            }
    }

    /// Looks for a packet at each position in turn, except inside delivered packets.
    fn framed(&self, items: &[Item], escape: u8, start: Option<u8>, end: u8) -> Vec<Delivery> {
        let mut deliveries = Vec::new();
        let mut from = 0;
        while from < items.len() {
            if let Some((packet, received)) = framed_at(&items[from..], escape, start, end)
                && self.is_frame(&packet)
            {
                from += received;
                deliveries.push(Delivery {
                    packet,
                    received,
                    at: from - 1,
                });
            } else {
                from += 1;
            }
        }
        deliveries
    }
}

/// Returns the packet with which the stream begins, and the number of its received bytes.
fn framed_at(items: &[Item], escape: u8, start: Option<u8>, end: u8) -> Option<(Vec<u8>, usize)> {
    let byte = |at: usize| match items.get(at) {
        Some(&Item::Byte(byte)) => Some(byte),
        _ => None,
    };
    let code = byte(1).filter(|_| byte(0) == Some(escape))?;
    let mut packet = match start {
        Some(start) if code == start => Vec::new(),
        None if code != escape && code != end => vec![code],
        _ => return None,
    };
    let mut at = 2;
    loop {
        let next = byte(at)?;
        at += 1;
        if next == escape {
            let code = byte(at)?;
            at += 1;
            if code == end {
                return Some((packet, at));
            } else if code != escape {
                return None;
            }
        }
        packet.push(next);
    }
}

/// Returns the bytes for which the stuffed bytes stand, and whether the packet may end after them. Returns no bytes if
/// the stuffing is wrong.
fn unstuffed(stuffing: Stuffing, bytes: &[u8]) -> (Option<Vec<u8>>, bool) {
    let mut packet = Vec::new();
    match (stuffing, bytes) {
        (Stuffing::Cobs, [code, rest @ ..]) => {
            let length = usize::from(code - 1);
            let Some((block, rest)) = rest.split_at_checked(length) else {
                return (Some(rest.to_vec()), false);
            };
            packet.extend(block);
            if length < 254 && !rest.is_empty() {
                packet.push(0);
            }
            let (behind, is_complete) = unstuffed(stuffing, rest);
            packet.extend(behind.unwrap_or_default());
            (Some(packet), is_complete)
        }
        (
            Stuffing::Escape {
                delimiter,
                escape,
                codes,
            },
            _,
        ) => {
            let mut rest = bytes.iter();
            while let Some(&byte) = rest.next() {
                if byte != escape {
                    packet.push(byte);
                    continue;
                }
                let Some(&code) = rest.next() else {
                    return (Some(packet), false);
                };
                packet.push(match codes {
                    Codes::Xor(with) => code ^ with,
                    Codes::Pair {
                        delimiter: for_delimiter,
                        ..
                    } if code == for_delimiter => delimiter,
                    Codes::Pair {
                        escape: for_escape, ..
                    } if code == for_escape => escape,
                    Codes::Pair { .. } => return (None, false),
                });
            }
            (Some(packet), true)
        }
        _ => (Some(bytes.to_vec()), true),
    }
}

/// One receiver with all its outcomes. The message of a frame is the packet.
struct Run {
    receiver: PacketReceiver<Packets, Vec<u8>>,
    found: Vec<Found<Vec<u8>>>,
}

impl Run {
    fn new(format: Packets) -> Self {
        let receiver = PacketReceiver::with_buffer(format, vec![0; format.longest()]);
        Self {
            receiver: receiver.expect("the buffer holds the longest packet"),
            found: Vec::new(),
        }
    }

    fn feed(&mut self, bytes: &[u8]) {
        let found = &mut self.found;
        self.receiver.feed(bytes, |one| {
            found.push(one.map(|frame| frame.message().to_vec()));
        });
    }

    fn line_event(&mut self, event: LineEvent) {
        let found = &mut self.found;
        let add =
            |one: Found<Frame<'_, Packets>>| found.push(one.map(|frame| frame.message().to_vec()));
        self.receiver.line_event(event, add);
    }

    /// Takes the rest of a slice up to a frame. Returns whether there is a frame.
    fn next(&mut self, rest: &mut &[u8]) -> bool {
        let (found, mut received) = (&mut self.found, 0);
        let frame = self.receiver.next_with(rest, |one| match one {
            Found::Frame { length, .. } => received = length,
            Found::Discarded { count, why, .. } => found.push(Found::discarded(count, why)),
        });
        let packet = frame.map(|frame| frame.message().to_vec());
        let is_frame = packet.is_some();
        found.extend(packet.map(|packet| Found::frame(received, packet)));
        is_frame
    }

    fn bytes(&self) -> usize {
        self.found.iter().map(Found::bytes).sum::<usize>() + self.receiver.pending()
    }
}

/// If the special bytes differ, checks that a receiver delivers exactly the packets of the naive definition, each with
/// its last byte or its delimiter. Also checks that pushed bytes and fed slices have the same outcomes, and that each
/// byte is counted once.
///
/// Counts the outcomes, and the packets of each way of stuffing and of each check. Returns the counters.
///
/// # Panics
/// Panics if the input shows a bug.
pub fn packets(input: &AnyPackets, occurred: &mut Occurred) -> Counters {
    let AnyPackets {
        format,
        stream: Stream(steps),
    } = input;
    let (mut fed, mut pushed, mut pulled) =
        (Run::new(*format), Run::new(*format), Run::new(*format));
    let mut line = Line::new(Run::new(*format).receiver);
    let (mut items, mut deliveries, mut taken) = (Vec::new(), Vec::new(), 0);
    let [mut cuts, mut pauses] = [0_u32; 2];
    for step in steps {
        match step {
            StreamStep::Slice(slice) => {
                cuts += u32::from(line.pending() > 0 && !slice.is_empty());
                fed.feed(slice);
                for &byte in slice {
                    let before = pushed.found.len();
                    pushed.next(&mut [byte].as_slice());
                    items.push(Item::Byte(byte));
                    note(&pushed.found[before..], items.len() - 1, &mut deliveries);
                }
                let mut rest = slice.as_slice();
                while pulled.next(&mut rest) {}
                match slice.first() {
                    Some(first) if first % 2 == 1 => {
                        for &byte in slice {
                            let _ = line.push(byte);
                        }
                    }
                    _ => line.feed(slice, |_| ()),
                }
            }
            StreamStep::Event(event) => {
                let before = pushed.found.len();
                for run in [&mut fed, &mut pushed, &mut pulled] {
                    run.line_event(*event);
                }
                items.push(Item::Event(*event));
                note(&pushed.found[before..], items.len() - 1, &mut deliveries);
                line.line_event(*event, |_| ());
                pauses += u32::from(*event == LineEvent::Idle && line.pending() > 0);
            }
        }
        taken += step.bytes().len();
        for run in [&fed, &pushed, &pulled] {
            assert_eq!(run.found, pushed.found, "{input:02X?}");
            assert_eq!(run.bytes(), taken, "{input:02X?}");
        }
        let counters = line.counters();
        let placed = counters.frame_bytes + counters.discarded.total() + as_counter(line.pending());
        assert_eq!(
            (placed, counters.bytes),
            (as_counter(taken), as_counter(taken)),
            "{input:02X?}"
        );
    }
    assert!(
        pushed.found.iter().all(|found| found.bytes() > 0),
        "{input:02X?}"
    );
    let is_defined = is_unambiguous(format.stuffing);
    if is_defined {
        assert_eq!(deliveries, format.deliveries(&items), "{input:02X?}");
    }
    let counters = *line.counters();
    let [way, check] = [way(format.stuffing), format.check as usize];
    for (number, name) in WAYS.into_iter().enumerate() {
        let is_way = number == way && is_defined;
        occurred.count(name, if is_way { counters.frames } else { 0 });
    }
    for (number, name) in CHECKS.into_iter().enumerate() {
        occurred.count(name, if number == check { counters.frames } else { 0 });
    }
    occurred.count("special bytes are equal", !is_defined);
    occurred.count("a slice begins within a packet", cuts);
    occurred.count("a pause after a delimiter", pauses);
    occurred.count_all(&counters);
    counters
}

/// The names of the ways of stuffing. The packets of each way are counted.
const WAYS: [&str; 6] = [
    "escape bytes by XOR",
    "escape bytes with a pair of codes",
    "COBS",
    "doubled bytes after a start byte",
    "doubled bytes without a start byte",
    "breaks",
];

/// The names of the [checks](PacketCheck), in order. The packets of each check are counted.
const CHECKS: [&str; 3] = ["any packet", "XOR", "length and XOR"];

fn way(stuffing: Stuffing) -> usize {
    match stuffing {
        Stuffing::Escape { codes, .. } => usize::from(matches!(codes, Codes::Pair { .. })),
        Stuffing::Cobs => 2,
        Stuffing::Doubled { start, .. } => 3 + usize::from(start.is_none()),
        Stuffing::Break => 5,
    }
}

/// Adds the frames that the item at this index has completed.
fn note(found: &[Found<Vec<u8>>], at: usize, deliveries: &mut Vec<Delivery>) {
    for one in found {
        if let Found::Frame {
            length, message, ..
        } = one
        {
            deliveries.push(Delivery {
                packet: message.clone(),
                received: *length,
                at,
            });
        }
    }
}

/// Returns whether the special bytes differ.
fn is_unambiguous(stuffing: Stuffing) -> bool {
    match stuffing {
        Stuffing::Escape {
            delimiter, escape, ..
        } => delimiter != escape,
        Stuffing::Doubled { escape, start, end } => {
            escape != end && start != Some(escape) && start != Some(end)
        }
        Stuffing::Cobs | Stuffing::Break => true,
    }
}
