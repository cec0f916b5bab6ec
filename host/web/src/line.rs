//! The line: each byte sent, and the byte that arrives.

use std::time::Duration;

use framelock::{Found, LineEvent};
use framelock_receiving::{AnyLine, LineError, Policy, Protocol};
use framelock_simulation::{Seed, examples, transmissions};

use crate::scenario::{Action, Scenario};

/// The time of a byte on the line and the pause after a frame, in microseconds. The line has 1200
/// baud, which is slow enough to watch.
const BYTE: u64 = 8_333;
const PAUSE: u64 = 5 * BYTE;

/// The time of a BIN frame with its pause. The motion advances by this time from frame to frame.
const FRAME_TIME: Duration = Duration::from_millis(100);

/// A byte on the line.
#[derive(Default)]
pub(crate) struct Cell {
    /// The byte sent, or `None` if nobody sent it.
    pub(crate) sent: Option<u8>,
    /// The byte that arrives, or `None` if the byte is lost.
    pub(crate) received: Option<u8>,
    /// True if a sent frame begins with this byte.
    pub(crate) begins: bool,
    /// If a sent frame ends with this byte, the length of that frame; otherwise 0.
    pub(crate) ends: usize,
    /// The time at which the byte ends, in milliseconds.
    pub(crate) at: u32,
}

impl Cell {
    /// Returns the line's effect on the byte. The page shows this text.
    pub(crate) fn kind(&self) -> &'static str {
        match (self.sent, self.received) {
            (_, None) => "lost",
            (None, _) => "inserted",
            (sent, received) if sent == received => "as sent",
            _ => "altered",
        }
    }
}

/// Returns the line of a scenario.
pub(crate) fn line(scenario: &Scenario, protocol: &Protocol) -> Result<Vec<Cell>, LineError> {
    let mut cells = if scenario.own.is_empty() {
        sent(&frames(scenario, protocol), protocol)?
    } else {
        sent(std::slice::from_ref(&scenario.own), protocol)?
    };
    for (place, action) in &scenario.edits {
        edit(&mut cells, *place, *action);
    }
    Ok(cells)
}

/// Returns the frames that the sender sends: frames of setpoints with the scenario's payload, or examples.
fn frames(scenario: &Scenario, protocol: &Protocol) -> Vec<Vec<u8>> {
    let count = scenario.frames as usize;
    if protocol.has_setpoints() {
        let seed = Seed { seed: 1, trial: 0 };
        let frames = transmissions(protocol, scenario.payload, seed, FRAME_TIME);
        return frames.take(count).map(|frame| frame.bytes).collect();
    }
    let frames = examples(&protocol.description, 1).take(count);
    let sent = frames.filter_map(|frame| protocol.description.sent(&frame));
    // Frames of the user's own may be long, so limit the stream.
    let mut length = 0;
    let mut is_short = |frame: &Vec<u8>| {
        length += frame.len();
        length < 1 << 13
    };
    sent.take_while(|frame| is_short(frame)).collect()
}

fn edit(cells: &mut Vec<Cell>, place: usize, action: Action) {
    let Some(cell) = cells.get_mut(place) else {
        return;
    };
    match action {
        Action::Drop if cell.sent.is_none() => drop(cells.remove(place)),
        Action::Drop if cell.received.is_none() => cell.received = cell.sent,
        Action::Drop => cell.received = None,
        Action::Flip(bits) => cell.received = cell.received.map(|byte| byte ^ bits),
        Action::Insert(byte) => {
            let inserted = Cell {
                received: Some(byte),
                at: cell.at,
                ..Cell::default()
            };
            cells.insert(place, inserted);
        }
    }
}

/// Returns the bytes as the sender sends them, with a pause after each frame. The frames are those that the receiver
/// finds on a line without faults.
fn sent(frames: &[Vec<u8>], protocol: &Protocol) -> Result<Vec<Cell>, LineError> {
    let cells = frames.iter().flatten().map(|&byte| Cell {
        sent: Some(byte),
        received: Some(byte),
        ..Cell::default()
    });
    let mut cells: Vec<Cell> = cells.collect();
    let mut receiver = AnyLine::new(protocol, Policy::Framelock)?;
    let mut decided = 0;
    let mut on_outcome = |found: Found<&[u8]>| {
        if let Found::Frame { length, .. } = found {
            cells[decided].begins = true;
            cells[decided + length - 1].ends = length;
        }
        decided += found.bytes();
    };
    let ending_event = protocol.description.ending_event();
    for frame in frames {
        // A break must come before a packet too. A pause before a frame changes nothing.
        for bytes in [&[][..], frame] {
            receiver.feed(bytes, &mut on_outcome);
            if let Some(event) = ending_event {
                receiver.line_event(event, &mut on_outcome);
            }
        }
    }
    // The line is idle after the last byte.
    receiver.line_event(LineEvent::Idle, on_outcome);
    let mut now = 0;
    for cell in &mut cells {
        now += BYTE;
        cell.at = u32::try_from(now / 1_000).expect("the line is short");
        now += if cell.ends > 0 { PAUSE } else { 0 };
    }
    Ok(cells)
}
