//! The frame format of a scenario, and example frames to send.

use framelock_description::{Description, Kind, Type, shipped};
use framelock_formats::layout::ByteOrder;
use framelock_receiving::Protocol;
use rand::seq::IndexedRandom as _;
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::scenario::Scenario;

/// Returns the protocol that a scenario uses.
pub(crate) fn protocol(scenario: &Scenario) -> Result<Protocol, String> {
    let text = shipped(&scenario.frame).unwrap_or(&scenario.description);
    described(&scenario.frame, text)
}

/// Parses a description of frames. An error begins with the line and column of the mistake.
pub(crate) fn described(name: &str, text: &str) -> Result<Protocol, String> {
    Protocol::described(name, text.to_owned()).map_err(|problem| {
        let mut parts = problem.splitn(4, ':').skip(1);
        let mut part = || parts.next().unwrap_or_default();
        format!("Line {}, column {}:{}", part(), part(), part())
    })
}

/// Returns `count` example frames that alternate between all kinds. Their bytes are random where
/// the format allows any value.
pub(crate) fn examples(description: &Description, count: u32, seed: u64) -> Vec<u8> {
    let (mut random, mut stream) = (ChaCha8Rng::seed_from_u64(seed), Vec::new());
    let kinds = description.kinds.iter().cycle();
    for (kind, _) in kinds.zip(0..count) {
        // Many message types have only one valid length, so try several lengths until the format accepts a frame.
        let mut frames = (0..64).filter_map(|nth| example(kind, nth / 8, &mut random));
        let frame = frames.find(|frame| description.is_frame(frame));
        stream.extend(frame.unwrap_or_default());
        // Frames of the user's own may be long, so limit the stream.
        if stream.len() > 1 << 16 {
            break;
        }
    }
    stream
}

/// Returns a frame of random bytes that is `longer` bytes longer than this kind requires, or `None`
/// if the layout cannot turn the bytes into a frame.
fn example(kind: &Kind, longer: usize, random: &mut ChaCha8Rng) -> Option<Vec<u8>> {
    let layout = kind.layout();
    let mut fields = kind.fields.iter();
    let takes_rest = fields.clone().any(|field| field.length().is_none());
    let rest = random.random_range(0..=12 * usize::from(takes_rest));
    let ends = fields.clone().filter_map(|field| field.end(rest));
    let length = kind.least_length(ends).max(layout.shortest) + longer;
    let is_text = fields.any(|field| field.kind == Type::Text);
    let any = if is_text { b'A'..=b'Z' } else { 0..=u8::MAX };
    let content = layout.content;
    let is_content = |byte: u8| content.iter().any(|(a, b)| (*a..=*b).contains(&byte));
    let any: Vec<u8> = any
        .filter(|byte| content.is_empty() || is_content(*byte))
        .collect();
    let bytes = (0..length.min(layout.longest)).filter_map(|_| any.choose(random).copied());
    let mut frame: Vec<u8> = bytes.collect();
    if let Some(messages) = layout.messages
        && let Some(message) = messages.known.choose(random)
    {
        let (place, mut bytes) = (messages.number, message.number.to_le_bytes());
        let bytes = bytes.get_mut(..place.bytes)?;
        if place.order == ByteOrder::Big {
            bytes.reverse();
        }
        frame.get_mut(place.at..place.end())?.copy_from_slice(bytes);
    }
    layout.seal(&mut frame).then_some(frame)
}
