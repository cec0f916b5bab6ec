//! The line: each byte sent, and the byte that arrives.

use framelock::{Found, LineEvent};
use framelock_receiving::{AnyLine, FrameFormat, Policy, Protocol};
use framelock_simulation::{ByteFaults, Event, FaultRates, Parameters, Seed, run};

use crate::frame::examples;
use crate::scenario::{Action, Scenario};

/// The time of a byte on the line and the pause after a frame, in microseconds. The line has 1200
/// baud, which is slow enough to watch.
const BYTE: u64 = 8_333;
const PAUSE: u64 = 5 * BYTE;

/// A byte on the line.
pub(crate) struct Cell {
    /// The byte sent, or `None` if nobody sent it.
    pub(crate) sent: Option<u8>,
    /// The byte that arrives, or `None` if the byte is lost.
    pub(crate) received: Option<u8>,
    /// If a sent frame ends with this byte, the length of that frame; otherwise 0.
    pub(crate) ends: u32,
    /// The time at which the byte ends, in milliseconds.
    pub(crate) at: u32,
}

impl Cell {
    fn new(sent: Option<u8>, received: u8, at: u32) -> Self {
        let (received, ends) = (Some(received), 0);
        Self {
            sent,
            received,
            ends,
            at,
        }
    }
}

/// Returns the line of a scenario.
pub(crate) fn line(scenario: &Scenario, protocol: &Protocol) -> Result<Vec<Cell>, String> {
    let bytes = match protocol.setpoints {
        _ if !scenario.own.is_empty() => scenario.own.clone(),
        Some(format) => simulated(scenario, format)?,
        None => examples(&protocol.description, scenario.frames, scenario.seed),
    };
    let mut cells = sent(&bytes, protocol)?;
    if scenario.lose + scenario.flip > 0.0 {
        let rates = FaultRates {
            drop: scenario.lose,
            flip: scenario.flip,
            ..FaultRates::default()
        };
        let (seed, trial) = (scenario.seed, 0);
        let mut faults = ByteFaults::new(rates, Seed { seed, trial });
        for cell in &mut cells {
            let carried = cell.sent.map(|byte| faults.carry(byte));
            cell.received = carried.and_then(|[_, received, _]| received);
        }
    }
    for (place, action) in &scenario.edits {
        edit(&mut cells, *place, *action);
    }
    Ok(cells)
}

fn edit(cells: &mut Vec<Cell>, place: usize, action: Action) {
    let Some(cell) = cells.get_mut(place) else {
        return;
    };
    let at = cell.at;
    match action {
        Action::Drop if cell.sent.is_none() => drop(cells.remove(place)),
        Action::Drop if cell.received.is_none() => cell.received = cell.sent,
        Action::Drop => cell.received = None,
        Action::Flip(bits) => cell.received = cell.received.map(|byte| byte ^ bits),
        Action::Insert(byte) => cells.insert(place, Cell::new(None, byte, at)),
    }
}

/// Returns the bytes as the sender sends them, with a pause after each frame. The frames are those
/// that the receiver finds on a line without faults.
fn sent(bytes: &[u8], protocol: &Protocol) -> Result<Vec<Cell>, String> {
    let cells = bytes.iter().map(|byte| Cell::new(Some(*byte), *byte, 0));
    let mut cells: Vec<Cell> = cells.collect();
    let mut receiver = AnyLine::new(protocol, Policy::Framelock)?;
    let mut settled = 0;
    let mut decided = |found: Found<&[u8]>| {
        settled += found.bytes();
        if let (Found::Frame { length, .. }, Some(last)) = (found, cells.get_mut(settled - 1)) {
            last.ends = u32::try_from(length).unwrap_or(u32::MAX);
        }
    };
    receiver.feed(bytes, &mut decided);
    // The line ends after the last byte.
    receiver.line_event(LineEvent::Idle, decided);
    let mut now = 0;
    for cell in &mut cells {
        now += BYTE;
        cell.at = u32::try_from(now / 1_000).unwrap_or(u32::MAX);
        now += if cell.ends > 0 { PAUSE } else { 0 };
    }
    Ok(cells)
}

/// Returns the bytes that the simulation's sender sends.
fn simulated(scenario: &Scenario, frame: FrameFormat) -> Result<Vec<u8>, String> {
    let parameters = Parameters {
        seed: scenario.seed,
        frame,
        payload: scenario.payload,
        frames: scenario.frames,
        rate: 10.0,
        ..Parameters::DEFAULT
    };
    let trial = run(&parameters, 0, true).map_err(|error| error.to_string())?;
    let events = trial.events.into_iter().flatten();
    let received = events.filter_map(|event| match event {
        Event::Byte { received, .. } => received,
        Event::Frame { .. } => None,
    });
    Ok(received.collect())
}
