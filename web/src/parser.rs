//! Any of the receivers, byte by byte.

use framelock::can_go_deaf::Lecture;
use framelock::motion::{Bin, BinCrc8, Setpoint};
use framelock::{BufferedReceiver, Counters, Found, Line, LineEvent, Receiver};
use framelock_formats::{Crsf, CrsfMessage};

use crate::scenario::FrameKind;

#[derive(Clone)]
pub(crate) enum AnyLine {
    Lecture(Line<Lecture>),
    Bin(Line<Receiver<Bin>>),
    BinCrc8(Line<Receiver<BinCrc8>>),
    Crsf(Line<BufferedReceiver<Crsf, 128>>),
}

/// What becomes of the next bytes. Some frames carry no setpoint.
type Decided = Found<Option<Setpoint>>;

/// Does the same with any of them. `$setpoint` is a message's setpoint, if it has one.
macro_rules! for_any {
    ($any:expr, $line:ident, $setpoint:pat => $does:expr) => {{
        let $setpoint = Some::<Setpoint>;
        match $any {
            AnyLine::Lecture($line) => $does,
            AnyLine::Bin($line) => $does,
            AnyLine::BinCrc8($line) => $does,
            AnyLine::Crsf($line) => {
                let $setpoint = attitude;
                $does
            }
        }
    }};
}

impl AnyLine {
    pub(crate) fn receiver(kind: FrameKind) -> Self {
        match kind {
            FrameKind::Bin => Self::Bin(Line::default()),
            FrameKind::BinCrc8 => Self::BinCrc8(Line::default()),
            FrameKind::Crsf => Self::Crsf(Line::new(BufferedReceiver::new(Crsf))),
        }
    }

    /// Takes bytes; what is decided by them, in the order of the stream.
    pub(crate) fn feed(&mut self, bytes: &[u8]) -> Vec<Decided> {
        let mut decided = Vec::new();
        for_any!(self, line, setpoint => line.feed(bytes, |found| decided.push(found.map(setpoint))));
        decided
    }

    /// The line is idle.
    pub(crate) fn idle(&mut self) -> Vec<Decided> {
        let mut decided = Vec::new();
        for_any!(self, line, setpoint =>
            line.line_event(LineEvent::Idle, |found| decided.push(found.map(setpoint))));
        decided
    }

    pub(crate) fn counters(&self) -> &Counters {
        for_any!(self, line, _ => line.counters())
    }

    /// The lecture's machine, if it is that.
    pub(crate) fn lecture(&self) -> Option<&Lecture> {
        match self {
            Self::Lecture(line) => Some(line.parser()),
            _ => None,
        }
    }
}

/// The type of CRSF's attitude frames: pitch, roll and yaw in 16 bits each.
pub(crate) const ATTITUDE: u8 = 0x1E;

/// The high bytes of an attitude's angles are a setpoint. Other messages have none.
fn attitude(message: CrsfMessage) -> Option<Setpoint> {
    match *message.payload {
        [pitch, _, roll, _, yaw, _] if message.kind == ATTITUDE => {
            Some([pitch, roll, yaw].map(|axis| axis ^ 0x80).into())
        }
        _ => None,
    }
}
