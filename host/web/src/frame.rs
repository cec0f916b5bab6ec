//! The frames on the line: what describes them, the receiver of them, and frames to be sent.

use framelock::{BufferedIn, Format as _, Line, Verdict};
use framelock_description::{Description, Kind, Type, shipped};
use framelock_formats::layout::ByteOrder;
use framelock_simulation::FrameFormat;
use rand::seq::IndexedRandom as _;
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::parser::AnyLine;
use crate::scenario::Scenario;

/// What a description in TOML says of frames.
pub(crate) struct Frame {
    pub(crate) description: Description,
    pub(crate) text: String,
    /// If they bring setpoints: then the small receiver takes them, and actuators move.
    pub(crate) setpoints: Option<FrameFormat>,
}

impl Frame {
    /// The frames of a scenario.
    pub(crate) fn of(scenario: &Scenario) -> Result<Self, String> {
        let setpoints = match &*scenario.frame {
            "bin" => Some(FrameFormat::Bin),
            "bin-crc8" => Some(FrameFormat::BinCrc8),
            _ => None,
        };
        let text = shipped(&scenario.frame).unwrap_or(&scenario.description);
        Ok(Self {
            setpoints,
            ..Self::described(text)?
        })
    }

    /// The frames that a text describes. The error says in which line and column it goes wrong.
    pub(crate) fn described(text: &str) -> Result<Self, String> {
        let description = Description::parse("", text).map_err(|problem| {
            let mut parts = problem.splitn(4, ':').skip(1);
            let mut part = || parts.next().unwrap_or_default();
            format!("Line {}, column {}:{}", part(), part(), part())
        })?;
        Ok(Self {
            description,
            text: text.to_owned(),
            setpoints: None,
        })
    }

    /// The receiver of them at the end of a line.
    pub(crate) fn line(&self) -> Result<AnyLine, String> {
        Ok(match self.setpoints {
            Some(FrameFormat::Bin) => AnyLine::Bin(Line::default()),
            Some(FrameFormat::BinCrc8) => AnyLine::BinCrc8(Line::default()),
            None => {
                let format = self.description.format();
                let receiver = BufferedIn::within(format, vec![0; 2 * format.longest()]);
                AnyLine::Described(Line::new(receiver.ok_or("Frames without bytes")?))
            }
        })
    }

    /// So many of them, of each kind in turn, with random bytes where any may stand.
    pub(crate) fn examples(&self, count: u32, seed: u64) -> Vec<u8> {
        let (mut random, mut stream) = (ChaCha8Rng::seed_from_u64(seed), Vec::new());
        let format = self.description.format();
        let kinds = self.description.kinds.iter().cycle();
        for (kind, _) in kinds.zip(0..count) {
            // Not all bytes make a frame: of many messages each has a length of its own.
            let mut frames = (0..64).filter_map(|nth| example(kind, nth / 8, &mut random));
            let frame = frames.find(|frame| format.judge(frame) == Verdict::Frame(frame.len()));
            stream.extend(frame.unwrap_or_default());
            // Those of one's own may be long.
            if stream.len() > 1 << 20 {
                break;
            }
        }
        stream
    }
}

/// A frame of that kind, so much longer than it need be; if these bytes make one.
fn example(kind: &Kind, longer: usize, random: &mut ChaCha8Rng) -> Option<Vec<u8>> {
    let layout = &kind.layout;
    let mut fields = kind.fields.iter();
    let takes_rest = fields.clone().any(|field| field.length().is_none());
    let rest = random.random_range(0..=12 * usize::from(takes_rest));
    let ends = fields.clone().filter_map(|field| field.end(rest));
    let length = kind.least_length(ends).max(layout.shortest) + longer;
    let is_text = fields.any(|field| field.kind == Type::Text);
    let any = if is_text { b'A'..=b'Z' } else { 0..=u8::MAX };
    let bytes = (0..length.min(layout.longest)).map(|_| random.random_range(any.clone()));
    let mut frame: Vec<u8> = bytes.collect();
    if let Some(messages) = &layout.messages
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
