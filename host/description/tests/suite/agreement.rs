//! Checks of a description. The description's receiver must deliver the described frames, whatever bytes surround the
//! frames and however the stream is cut. Encoding the values of a frame must make the same frame again. The tests with
//! random descriptions and the fuzz target call these checks.

use framelock::{BufferedReceiver, Classification, Format, Found, Frame, LineEvent};
use framelock_description::{Description, Layouts};
use framelock_proofs::reference::framed;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::drawn::{frames, noisy, values, with_any_end};

/// The length of the longest frame that is checked. The reference is slow with longer frames.
const LONGEST: usize = 300;

/// Checks a text. The parser must reject the text with a position, or the receiver must deliver the described frames.
/// Returns the number of delivered frames, or `None` if the text is rejected.
pub(crate) fn is_refused_or_agrees(text: &str) -> Option<usize> {
    match Description::parse("any.toml", text) {
        Ok(description) if description.format().longest() <= LONGEST => {
            let mut random = ChaCha8Rng::seed_from_u64(1);
            Some(agrees_with_the_reference(&description, text, &mut random))
        }
        Ok(_) => Some(0),
        Err(why) => {
            let line = text
                .split('\n')
                .nth(why.line - 1)
                .expect("that line is there");
            let columns = 1..=line.chars().count() + 1;
            assert!(columns.contains(&why.column), "{why}");
            None
        }
    }
}

/// The outcomes of a stream's bytes. A frame's message is the position at which the frame begins.
type Events = Vec<Found<usize>>;

/// Returns the events of a receiver for a stream that is cut into random slices of up to `most` bytes.
fn received(
    description: &Description,
    stream: &[u8],
    most: usize,
    random: &mut ChaCha8Rng,
) -> Events {
    let format = description.format();
    let mut receiver =
        BufferedReceiver::with_buffer(format.clone(), vec![0; 2 * format.longest()]).unwrap();
    let (mut rest, mut settled, mut events) = (stream, 0, vec![]);
    let mut note = |found: Found<Frame<'_, Layouts>>| {
        let count = found.bytes();
        events.push(found.map(|_| settled));
        settled += count;
    };
    while !rest.is_empty() {
        let (piece, behind) = rest.split_at(random.random_range(1..=most.min(rest.len())));
        rest = behind;
        receiver.feed(piece, &mut note);
    }
    receiver.line_event(LineEvent::Idle, &mut note);
    one_by_one(&events)
}

/// Splits runs of discarded bytes into single bytes, because the length of the runs depends on the cuts.
fn one_by_one(events: &[Found<usize>]) -> Events {
    let each = events.iter().flat_map(|event| match *event {
        Found::Frame { .. } => vec![*event],
        Found::Discarded { count, why, .. } => vec![Found::discarded(1, why); count],
    });
    each.collect()
}

/// Asserts that receiver and reference have the same events on a noisy stream with random cuts. Also asserts that the
/// receiver delivers each frame of a stream that consists of frames only. Returns the number of frames in this second
/// stream.
pub(crate) fn agrees_with_the_reference(
    description: &Description,
    text: &str,
    random: &mut ChaCha8Rng,
) -> usize {
    let mut frames = frames(description, random);
    for frame in &mut frames {
        assert_eq!(
            description.format().classify(frame),
            Classification::Frame(frame.len())
        );
        let again = description.encode(&values(description, frame));
        assert_eq!(again.as_ref(), Ok(&*frame), "{text}\n{frame:02X?}");
        let other = with_any_end(description, frame, random);
        let shown = values(description, &other);
        assert_eq!(shown, values(description, frame), "{text}\n{other:02X?}");
        *frame = other;
    }
    let clean = received(description, &frames.concat(), 20, random);
    let whole: Vec<usize> = clean
        .iter()
        .filter_map(|event| event.message().map(|_| event.bytes()))
        .collect();
    let lengths: Vec<usize> = frames.iter().map(Vec::len).collect();
    assert_eq!(whole, lengths, "{text}");

    let stream = noisy(&frames, random);
    let mut expected = Events::new();
    framed(
        description.format(),
        &stream,
        Some(LineEvent::Idle),
        |event| {
            expected.push(event);
        },
    );
    let expected = one_by_one(&expected);
    for most in [1, 20, stream.len().max(1)] {
        let told = received(description, &stream, most, random);
        assert_eq!(told, expected, "{text}\n{stream:02X?}");
    }
    frames.len()
}
