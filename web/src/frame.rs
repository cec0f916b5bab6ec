//! The frames on the line: what describes them, the receiver of them, and frames to be sent.

use framelock::{BufferedIn, Format as _, Line, Verdict};
use framelock_description::{Description, Kind, Type, shipped};
use framelock_formats::layout::{ByteOrder, Number};
use framelock_simulation::FrameFormat;
use rand::seq::IndexedRandom as _;
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::parser::AnyLine;
use crate::places::place;
use crate::scenario::Scenario;

/// Frames of one's own may be long: no more bytes of them are sent.
const MOST_BYTES: usize = 1 << 20;

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
        let kinds = self.description.kinds.iter().cycle();
        for (kind, _) in kinds.zip(0..count) {
            let is_it = |frame: &Vec<u8>| {
                self.description.format().judge(frame) == Verdict::Frame(frame.len())
            };
            // Not all bytes make a frame: of those with a list of messages each has a length of its own.
            let tries = 0..64;
            stream.extend(
                tries
                    .filter_map(|nth| example(kind, nth / 8, &mut random))
                    .find(is_it)
                    .unwrap_or_default(),
            );
            if stream.len() > MOST_BYTES {
                break;
            }
        }
        stream
    }
}

/// A frame of that kind, so much longer than it need be; if these bytes make one.
fn example(kind: &Kind, longer: usize, random: &mut ChaCha8Rng) -> Option<Vec<u8>> {
    let layout = &kind.layout;
    let ends = kind
        .fields
        .iter()
        .filter_map(|field| Some(usize::try_from(field.at).ok()? + field.length()?));
    let front = ends.max().unwrap_or_default().max(layout.header());
    let takes_rest = kind.fields.iter().any(|field| field.length().is_none());
    let rest = if takes_rest {
        random.random_range(0..=12)
    } else {
        0
    };
    let length = layout.shortest.max(front + kind.trailer) + rest + longer;
    let mut frame: Vec<u8> = (0..length.min(layout.longest))
        .map(|_| random.random())
        .collect();
    for field in kind.fields.iter().filter(|field| field.kind == Type::Text) {
        let place = place(field, 0, frame.len());
        for byte in place
            .and_then(|place| frame.get_mut(place))
            .unwrap_or_default()
        {
            *byte = random.random_range(b'A'..=b'Z');
        }
    }
    if let Some(messages) = &layout.messages
        && let Some(message) = messages.known.choose(random)
    {
        write(messages.number, message.number, &mut frame);
    }
    layout.seal(&mut frame).then_some(frame)
}

fn write(place: Number, number: u32, frame: &mut [u8]) {
    let lowest_first = number.to_le_bytes().into_iter().take(place.bytes);
    let bytes = frame
        .get_mut(place.at..place.end())
        .unwrap_or_default()
        .iter_mut();
    match place.order {
        ByteOrder::Little => bytes.zip(lowest_first).for_each(|(byte, it)| *byte = it),
        ByteOrder::Big => bytes
            .rev()
            .zip(lowest_first)
            .for_each(|(byte, it)| *byte = it),
    }
}
