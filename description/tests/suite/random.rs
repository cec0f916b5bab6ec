//! Random descriptions and random frames of the shipped ones, against the reference: frames come out, whatever is
//! around them and however the stream is cut, and values make the frame again that they are of.

use framelock::{BufferedIn, Format, Found, Verdict};
use framelock_description::{Description, SHIPPED};
use framelock_formats::check_laws;
use framelock_proofs::reference::framed;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::drawn::{description, frames, noisy, values};

/// What becomes of the bytes of a stream, each frame as the place at which it begins.
type Events = Vec<Found<usize>>;

/// What a receiver makes of a stream that is cut anywhere; byte by byte if `most` is 1.
fn received(
    description: &Description,
    stream: &[u8],
    most: usize,
    random: &mut ChaCha8Rng,
) -> Events {
    let format = description.format();
    let mut receiver = BufferedIn::within(format, vec![0; 2 * format.longest()]).unwrap();
    let (mut rest, mut settled, mut events) = (stream, 0, vec![]);
    let mut note = |found: Found<(usize, &[u8])>| {
        let count = found.bytes();
        events.push(found.map(|_| settled));
        settled += count;
    };
    while !rest.is_empty() {
        let (piece, behind) = rest.split_at(random.random_range(1..=most.min(rest.len())));
        rest = behind;
        receiver.feed(piece, &mut note);
    }
    receiver.line_event(note);
    one_by_one(&events)
}

/// Discarded bytes one by one: in how many pieces they are told depends on the cuts.
fn one_by_one(events: &[Found<usize>]) -> Events {
    let each = events.iter().flat_map(|event| match *event {
        Found::Frame { .. } => vec![*event],
        Found::Discarded { count, why } => vec![Found::Discarded { count: 1, why }; count],
    });
    each.collect()
}

/// Whatever the stream and however it is cut, what the reference makes of it comes out; and of frames alone, each.
fn agrees_with_the_reference(
    description: &Description,
    text: &str,
    random: &mut ChaCha8Rng,
) -> usize {
    let frames = frames(description, random);
    for frame in &frames {
        assert_eq!(
            description.format().judge(frame),
            Verdict::Frame(frame.len())
        );
        let again = description.encode(&values(description, frame));
        assert_eq!(again.as_ref(), Ok(frame), "{text}\n{frame:02X?}");
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
    framed(&description.format(), &stream, true, |event| {
        expected.push(event);
    });
    let expected = one_by_one(&expected);
    for most in [1, 20, stream.len().max(1)] {
        let told = received(description, &stream, most, random);
        assert_eq!(told, expected, "{text}\n{stream:02X?}");
    }
    frames.len()
}

#[test]
fn shipped_frames_come_out_and_their_values_make_them_again() {
    for (name, text) in SHIPPED {
        let description = Description::parse(name, text).unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let frames: usize = (0..20)
            .map(|_| agrees_with_the_reference(&description, text, &mut random))
            .sum();
        // A row of MAVLink whose message is not there, or is longer, is none.
        assert!(
            frames > if name.starts_with("mavlink") { 60 } else { 100 },
            "{name}: {frames}"
        );
    }
}

#[test]
fn shipped_frames_keep_the_laws() {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    for (name, text) in SHIPPED {
        let description = Description::parse(name, text).unwrap();
        let mut bytes = frames(&description, &mut random).swap_remove(0);
        bytes.push(bytes[0]);
        // Longer ones take long, and agree with the reference above.
        bytes.truncate(14);
        check_laws(&description.format(), &mut bytes)
            .unwrap_or_else(|broken| panic!("{name}: {broken}"));
    }
}

/// Of any description: receiver and reference agree, laws hold, and frames come out.
#[test]
fn described_frames_come_out_and_their_values_make_them_again() {
    let (mut right, mut without_sync, mut in_all) = (0, 0, 0);
    for seed in 0..1200 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let text = description(&mut random);
        let Ok(description) = Description::parse("any.toml", &text) else {
            continue;
        };
        right += 1;
        let frames = (0..3).map(|_| agrees_with_the_reference(&description, &text, &mut random));
        let frames: usize = frames.sum();
        assert!(frames > 0, "{seed}: {text}");
        in_all += frames;
        without_sync += usize::from(!text.contains("sync") && text.contains("terminator"));
        if seed % 4 == 0 {
            let mut beginning: Vec<u8> = crate::drawn::frames(&description, &mut random).concat();
            beginning.truncate(6);
            check_laws(&description.format(), &mut beginning).unwrap();
        }
    }
    assert!(
        right > 200 && without_sync > 8 && in_all > 5_000,
        "{right} {without_sync} {in_all}"
    );
}
