//! Checks the receiver of packets against plain definitions of the stuffings.

use framelock::{
    Classification, Codes, Counters, Format, Line, LineEvent, PacketReceiver, Stuffing,
};
use framelock_description::Description;
use framelock_oracles::{broken, faulty};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Asserts that the receiver delivers each frame of a line without faults. Also asserts that on a faulty line it delivers
/// the frames that stand between delimiters, and nothing else. For DLE framing, whose receiver looks for packets inside
/// broken packets, checks only the line without faults.
pub(crate) fn check_packets(
    description: &Description,
    stuffing: Stuffing,
    frames: &[Vec<u8>],
    random: &mut ChaCha8Rng,
) {
    let sent: Vec<Vec<u8>> = frames
        .iter()
        .map(|frame| description.sent(frame).unwrap())
        .collect();
    let (delivered, counters) = received(description, &sent);
    assert_eq!((&*delivered, counters.discarded.total()), (frames, 0));
    let delimiter = match stuffing {
        Stuffing::Doubled { .. } => return,
        Stuffing::Escape { delimiter, .. } => Some(delimiter),
        _ => (stuffing == Stuffing::Cobs).then_some(0),
    };
    let (chunks, between) = if let Some(delimiter) = delimiter {
        let bytes = faulty(&sent, random);
        let packets = bytes.split(|byte| *byte == delimiter);
        let packets: Vec<Vec<u8>> = packets.map(<[u8]>::to_vec).collect();
        // A delimiter must precede a packet.
        (vec![bytes], packets[1..].to_vec())
    } else {
        let mut chunk = |frame: &Vec<u8>| match random.random() {
            true => broken(frame, |count| random.random_range(0..count)),
            false => frame.clone(),
        };
        let chunks: Vec<Vec<u8>> = sent.iter().map(&mut chunk).collect();
        (chunks.clone(), chunks)
    };
    let last = between.len().wrapping_sub(1);
    let expected = between.iter().enumerate().filter_map(|(number, packet)| {
        // The last packet may lack its delimiter.
        frame_in(
            description,
            stuffing,
            packet,
            delimiter.is_none() || number < last,
        )
    });
    let expected: Vec<Vec<u8>> = expected.collect();
    assert_eq!(
        received(description, &chunks).0,
        expected,
        "{stuffing:?}: {chunks:02X?}"
    );
}

/// Returns the frame in the bytes between two delimiters.
fn frame_in(
    description: &Description,
    stuffing: Stuffing,
    bytes: &[u8],
    is_closed: bool,
) -> Option<Vec<u8>> {
    let mut before = 0;
    for end in 0..=bytes.len() {
        let (packet, is_whole) = unstuffed(stuffing, &bytes[..end])?;
        if packet.len() > description.format().longest() {
            return None;
        }
        let is_longer = packet.len() > std::mem::replace(&mut before, packet.len());
        let ends_by_itself = is_longer
            && description.format().classify(&packet) == Classification::Frame(packet.len());
        let is_last = end == bytes.len() && is_closed && is_whole && !packet.is_empty();
        if ends_by_itself || is_last && description.is_frame(&packet) {
            return Some(packet);
        }
    }
    None
}

/// Returns the packet that these bytes stand for, and whether the packet may end here. `None` if no packet begins with
/// these bytes.
fn unstuffed(stuffing: Stuffing, bytes: &[u8]) -> Option<(Vec<u8>, bool)> {
    let (mut packet, mut rest) = (Vec::new(), bytes);
    match stuffing {
        Stuffing::Cobs => {
            let mut ends_with_zero = false;
            while let [code, behind @ ..] = rest {
                packet.extend(ends_with_zero.then_some(0));
                let wanted = usize::from(*code) - 1;
                let (block, next) = behind.split_at(wanted.min(behind.len()));
                packet.extend(block);
                if block.len() < wanted {
                    return Some((packet, false));
                }
                (rest, ends_with_zero) = (next, *code < 0xFF);
            }
        }
        Stuffing::Escape {
            delimiter,
            escape,
            codes,
        } => {
            while let [byte, behind @ ..] = rest {
                rest = behind;
                if *byte != escape {
                    packet.push(*byte);
                    continue;
                }
                let [code, behind @ ..] = behind else {
                    return Some((packet, false));
                };
                rest = behind;
                packet.push(match codes {
                    Codes::Xor(number) => code ^ number,
                    Codes::Pair { delimiter: one, .. } if *code == one => delimiter,
                    Codes::Pair { escape: other, .. } if *code == other => escape,
                    Codes::Pair { .. } => return None,
                });
            }
        }
        _ => packet.extend(rest),
    }
    Some((packet, true))
}

/// Returns the frames that the receiver delivers, and its counters. A break precedes and follows each chunk.
fn received(description: &Description, chunks: &[Vec<u8>]) -> (Vec<Vec<u8>>, Counters) {
    let format = description.format();
    let receiver = PacketReceiver::with_buffer(format.clone(), vec![0; format.longest()]);
    let mut line = Line::new(receiver.unwrap());
    let mut frames = Vec::new();
    for chunk in chunks {
        for bytes in [&[][..], chunk] {
            line.feed(bytes, |found| {
                frames.extend(found.message().map(|frame| frame.bytes().to_vec()))
            });
            if format.packets() == Some(Stuffing::Break) {
                let found = |found: framelock::Found<framelock::Frame<'_, _>>| {
                    frames.extend(found.message().map(|frame| frame.bytes().to_vec()));
                };
                line.line_event(LineEvent::Break, found);
            }
        }
    }
    (frames, *line.counters())
}
