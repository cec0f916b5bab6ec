//! Any of the receivers, byte by byte.

use framelock::{
    Accounting, Bin, BinCrc8, BufferedReceiver, Counters, Event, Found, Lecture, LineEvent,
    Mismatch, Parser, Receiver, Setpoint,
};
use framelock_formats::{Crsf, CrsfMessage};

use crate::scenario::FrameKind;

#[derive(Clone)]
pub(crate) enum AnyParser {
    Lecture(Accounting<Lecture>),
    Bin(Accounting<Receiver<Bin>>),
    BinCrc8(Accounting<Receiver<BinCrc8>>),
    Crsf(Accounting<BufferedReceiver<Crsf, 128>>),
}

/// What becomes of the next bytes. Some frames carry no setpoint.
type Decided = Found<Option<Setpoint>>;

macro_rules! for_any {
    ($parser:expr, $accounting:ident => $fixed:expr, $crsf:expr) => {
        match $parser {
            AnyParser::Lecture($accounting) => $fixed,
            AnyParser::Bin($accounting) => $fixed,
            AnyParser::BinCrc8($accounting) => $fixed,
            AnyParser::Crsf($accounting) => $crsf,
        }
    };
}

impl AnyParser {
    pub(crate) fn receiver(kind: FrameKind) -> Self {
        match kind {
            FrameKind::Bin => Self::Bin(Accounting::default()),
            FrameKind::BinCrc8 => Self::BinCrc8(Accounting::default()),
            FrameKind::Crsf => Self::Crsf(Accounting::new(BufferedReceiver::new(Crsf::default()))),
        }
    }

    /// Takes bytes; what is decided by them, in the order of the stream.
    pub(crate) fn feed(&mut self, bytes: &[u8]) -> Vec<Decided> {
        let mut decided = Vec::new();
        for_any!(self, parser => feed(parser, bytes, &mut decided),
            parser.feed(bytes, |found| decided.push(setpoint(found))));
        decided
    }

    /// The line is idle.
    pub(crate) fn idle(&mut self) -> Vec<Decided> {
        let mut decided = Vec::new();
        let why = Mismatch::LineEvent;
        for_any!(self, parser => {
            let count = parser.pending();
            decided.extend((count > 0).then_some(Found::Dropped { count, why }));
            parser.line_event(LineEvent::Idle);
        }, parser.line_event(LineEvent::Idle, |found| decided.push(setpoint(found))));
        decided
    }

    pub(crate) fn counters(&self) -> &Counters {
        for_any!(self, parser => parser.counters(), parser.counters())
    }

    /// The lecture's machine, if it is that.
    pub(crate) fn lecture(&self) -> Option<&Lecture> {
        match self {
            Self::Lecture(accounting) => Some(accounting.parser()),
            _ => None,
        }
    }
}

fn feed<P>(parser: &mut Accounting<P>, bytes: &[u8], decided: &mut Vec<Decided>)
where
    P: Parser<Message = Setpoint>,
{
    let length = P::FRAME_LENGTH;
    parser.feed_events(bytes, |event| {
        decided.push(match event {
            Event::Dropped { count, why } => Found::Dropped { count, why },
            Event::Frame { message, .. } => Found::Frame {
                length,
                message: Some(message),
            },
        });
    });
}

/// The type of CRSF's attitude frames: pitch, roll and yaw in 16 bits each.
pub(crate) const ATTITUDE: u8 = 0x1E;

/// The high bytes of an attitude's angles are a setpoint. Other messages have none.
fn setpoint(found: Found<CrsfMessage>) -> Decided {
    let (length, message) = match found {
        Found::Dropped { count, why } => return Found::Dropped { count, why },
        Found::Frame { length, message } => (length, message),
    };
    let message = match *message.payload {
        [pitch, _, roll, _, yaw, _] if message.kind == ATTITUDE => {
            Some([pitch, roll, yaw].map(|axis| axis ^ 0x80).into())
        }
        _ => None,
    };
    Found::Frame { length, message }
}
