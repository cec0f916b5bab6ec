//! Checks of a description. The description's receiver must deliver the frames of a stream without faults, however the
//! stream is cut. On a faulty line, the receiver must find the same frames as a naive reference. Encoding the values of
//! a frame must make the same frame again. The tests with random descriptions and the fuzz target call these checks.

use framelock::{Format, Line, LineEvent, PacketReceiver, Stuffing};
use framelock_description::Description;
use framelock_formats::CheckedLayout;
use framelock_formats::layout::Length;
use framelock_oracles::{Occurred, Stream, StreamStep, cut, faulty, layouts};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::drawn::{frames, values, with_any_end};

/// The greatest length of a frame for which [`is_refused_or_agrees`] checks the receiver. The reference is slow with
/// longer frames.
const LONGEST: usize = 300;

/// Checks a text. The parser must reject the text with a position, or the receiver must deliver the described frames.
/// If the description allows frames of more than `LONGEST` bytes, the receiver is not checked. Counts the texts that
/// are rejected or not checked, the delivered frames by their form, and the receiver's outcomes.
pub fn is_refused_or_agrees(text: &str, occurred: &mut Occurred) {
    match Description::parse("any.toml", text) {
        Ok(description) if description.format().longest() <= LONGEST => {
            let mut random = ChaCha8Rng::seed_from_u64(1);
            let frames = agrees_with_the_reference(&description, text, &mut random, occurred);
            let layout = *description.kinds[0].layout();
            for (name, is) in [
                ("frames of several kinds", description.kinds.len() > 1),
                ("packets", description.format().packets().is_some()),
                ("frames of a fixed length", layout.length == Length::Fixed),
                (
                    "frames with a length field",
                    matches!(layout.length, Length::Field(_)),
                ),
                (
                    "frames that a delimiter ends",
                    layout.length == Length::Delimiter,
                ),
                ("frames that silence ends", layout.length == Length::Silence),
            ] {
                occurred.count(name, if is { frames as u64 } else { 0 });
            }
        }
        Ok(_) => occurred.count("too long for the reference", true),
        Err(why) => {
            let mut lines = text.split('\n');
            let line = lines.nth(why.line - 1).expect("that line is there");
            let columns = 1..=line.chars().count() + 1;
            assert!(columns.contains(&why.column), "{why}");
            occurred.count("a rejected text", true);
        }
    }
}

/// Draws frames, and asserts that encoding the values of a frame gives the same frame. Asserts that receivers of the
/// description deliver each frame of a stream without faults, and that on a faulty line they find the same frames as
/// the naive interpreter of the description's layouts. Counts the receivers' outcomes. For packets, calls
/// `check_packets` instead. Returns the number of frames in the stream without faults.
pub fn agrees_with_the_reference(
    description: &Description,
    text: &str,
    random: &mut ChaCha8Rng,
    occurred: &mut Occurred,
) -> usize {
    let format = description.format();
    let mut frames = frames(description, random);
    frames.retain(|frame| description.sent(frame).is_some());
    for frame in &mut frames {
        assert!(description.is_frame(frame), "{text}\n{frame:02X?}");
        let again = description.encode(&values(description, frame));
        assert_eq!(again.as_ref(), Ok(&*frame), "{text}\n{frame:02X?}");
        let other = with_any_end(description, frame, random);
        let shown = values(description, &other);
        assert_eq!(shown, values(description, frame), "{text}\n{other:02X?}");
        *frame = other;
    }
    let all: Vec<CheckedLayout> = description
        .kinds
        .iter()
        .map(|kind| *kind.layout())
        .collect();
    if let Some(stuffing) = format.packets() {
        check_packets(description, stuffing, &frames, text, random);
        return frames.len();
    }
    // If silence ends the frames, pauses follow about half of the slices of the faulty stream.
    let pauses: f64 = if description.ending_event().is_some() {
        0.5
    } else {
        0.0
    };
    let line = |slices: Vec<StreamStep>, pauses: f64, random: &mut ChaCha8Rng| {
        let idle = StreamStep::Event(LineEvent::Idle);
        let mut steps = Vec::new();
        for slice in slices {
            steps.push(slice);
            steps.extend(random.random_bool(pauses).then(|| idle.clone()));
        }
        Stream([steps, vec![idle]].concat())
    };
    // Without pauses, the end of a frame and the beginning of the next one may also be a frame of an earlier kind.
    let all_pauses = pauses > 0.0 || description.kinds.len() > 1;
    let slices = if all_pauses {
        frames.iter().cloned().map(StreamStep::Slice).collect()
    } else {
        cut(&frames.concat(), random)
    };
    let stream = line(slices, f64::from(u8::from(all_pauses)), random);
    let clean = layouts(format, &all, &stream, occurred);
    let delivered = (clean.frames as usize, clean.discarded.total());
    assert_eq!(delivered, (frames.len(), 0), "{text}");
    let slices = cut(&faulty(&frames, random), random);
    layouts(format, &all, &line(slices, pauses, random), occurred);
    frames.len()
}

/// Asserts that the receiver of packets delivers each frame of a stream that consists of packets only. Also asserts
/// that the receiver delivers each frame on a faulty line, if the delimiter is a single byte. Does not check
/// other deliveries on a faulty line, which the oracle `packets` checks.
fn check_packets(
    description: &Description,
    stuffing: Stuffing,
    frames: &[Vec<u8>],
    text: &str,
    random: &mut ChaCha8Rng,
) {
    let format = description.format();
    let receive = |chunks: &[Vec<u8>]| {
        let parser = PacketReceiver::with_buffer(format.clone(), vec![0; format.longest()]);
        let (mut line, mut received) = (Line::new(parser.unwrap()), Vec::new());
        for bytes in chunks {
            // If the packets lie between breaks, a break precedes and follows each packet.
            for bytes in [&[][..], bytes] {
                line.feed(bytes, |found| {
                    received.extend(found.decoded().map(|(_, frame)| frame.to_vec()));
                });
                if stuffing == Stuffing::Break {
                    line.line_event(LineEvent::Break, |found| {
                        received.extend(found.decoded().map(|(_, frame)| frame.to_vec()));
                    });
                }
            }
        }
        (received, line.counters().discarded.total())
    };
    let sent: Vec<Vec<u8>> = frames
        .iter()
        .map(|frame| description.sent(frame).unwrap())
        .collect();
    assert_eq!(receive(&sent), (frames.to_vec(), 0), "{text}");
    if matches!(stuffing, Stuffing::Escape { .. } | Stuffing::Cobs) {
        let (received, _) = receive(&[faulty(&sent, random)]);
        let mut rest = received.iter();
        assert!(
            frames.iter().all(|frame| rest.any(|one| one == frame)),
            "{text}"
        );
    }
}
