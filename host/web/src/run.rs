//! The machines' way along the line, from the beginning to any position.

use framelock_receiving::{AnyLine, Policy, Protocol};
use wasm_bindgen::prelude::wasm_bindgen;

use crate::frame::protocol;
use crate::line::{Cell, line};
use crate::machine::Machine;
use crate::scenario::{Action, Scenario};

/// Behind the last byte the line is silent for so many steps of so many milliseconds: time enough for
/// the failsafe to park the actuators.
const SILENT_STEPS: usize = 32;
const SILENT_STEP: u32 = 50;

/// The idle-gap rule drops what is pending when the next byte has not come after so many
/// milliseconds: three byte times, and the byte's own.
const IDLE_AFTER: u32 = 35;

/// How far apart states are kept, in bytes.
const KEPT_EVERY: usize = 1 << 14;

/// The machines on their way.
#[derive(Clone)]
pub(crate) struct State {
    pub(crate) position: usize,
    /// In milliseconds.
    pub(crate) now: u32,
    pub(crate) machines: Vec<Machine>,
    /// How many of the last bytes arrived as they were sent.
    as_sent: usize,
    /// When the line will be idle, unless a byte comes.
    idle_at: Option<u32>,
}

/// A scenario, its line, and the machines' way along it: what the page's script calls.
#[wasm_bindgen]
pub struct Run {
    scenario: Scenario,
    pub(crate) protocol: Protocol,
    pub(crate) cells: Vec<Cell>,
    start: State,
    /// One each piece further on, as far as it has been decoded.
    kept: Vec<State>,
}

#[wasm_bindgen]
#[allow(
    clippy::must_use_candidate,
    reason = "nothing comes of calling them alone"
)]
impl Run {
    /// The scenario of an address, of which nothing has been decoded yet. `file`: the bytes to send, if
    /// it sends a file.
    ///
    /// # Errors
    /// The address is malformed, or it was made with another file.
    pub fn open(address: &str, file: &[u8]) -> Result<Run, String> {
        let scenario: Scenario = address.parse()?;
        let protocol = protocol(&scenario)?;
        // The lecture's machine does not receive all frames.
        let lecture = AnyLine::new(&protocol, Policy::Lecture).ok();
        let framelock = AnyLine::new(&protocol, Policy::Framelock)?;
        let lines = lecture.into_iter().chain([framelock]);
        let machines = lines.map(|line| Machine::new(line, protocol.setpoints));
        let machines = machines.collect();
        Ok(Self {
            cells: line(&scenario, &protocol, file)?,
            scenario,
            protocol,
            start: State {
                machines,
                position: 0,
                now: 0,
                as_sent: 0,
                idle_at: None,
            },
            kept: Vec::new(),
        })
    }

    /// Decodes a piece more, so that what lies behind can be seen at once; how many bytes have been
    /// decoded now.
    pub fn decode(&mut self) -> usize {
        let done = self.kept.len() * KEPT_EVERY;
        let until = self.cells.len().min(done + KEPT_EVERY);
        let mut state = self.kept_before(done);
        while state.position < until {
            self.step(&mut state);
        }
        self.kept.push(state);
        until
    }

    /// Bytes on the line.
    pub fn bytes(&self) -> usize {
        self.cells.len()
    }

    /// What describes the frames.
    pub fn description(&self) -> String {
        self.protocol.text.clone()
    }

    /// The position in the address.
    pub fn position(&self) -> usize {
        self.scenario.at
    }

    /// The address with some keys set to other values: `at=12&idle=on`.
    ///
    /// # Errors
    /// There is no such key, or it cannot have that value.
    pub fn with(&self, pairs: &str) -> Result<String, String> {
        let mut scenario = self.scenario.clone();
        scenario.apply(pairs)?;
        Ok(scenario.to_string())
    }

    /// The address after something has been done to the byte in a place: `drop`, `flip` those bits, or
    /// `insert` that value in front of it.
    pub fn edited(&self, place: usize, action: &str, value: u8) -> String {
        let action = match action {
            "insert" => Action::Insert(value),
            "flip" => Action::Flip(value),
            _ => Action::Drop,
        };
        let mut scenario = self.scenario.clone();
        scenario.edits.push((place, action));
        scenario.to_string()
    }

    /// What there is to see at a position, of some places on the line, as JSON.
    pub fn view(&self, position: usize, from: usize, to: usize) -> String {
        self.seen(position, from..to).to_string()
    }
}

impl Run {
    /// The last position: behind all bytes, and some silence.
    pub(crate) fn positions(&self) -> usize {
        self.cells.len() + SILENT_STEPS
    }

    /// The state at a position, or some way before it.
    pub(crate) fn kept_before(&self, position: usize) -> State {
        let nth = (position / KEPT_EVERY).checked_sub(1);
        let kept = nth.and_then(|nth| self.kept.get(nth));
        kept.unwrap_or(&self.start).clone()
    }

    /// Goes on by a byte, or a step of silence.
    pub(crate) fn step(&self, state: &mut State) {
        let place = state.position;
        state.position += 1;
        for machine in &mut state.machines {
            machine.fates.clear();
        }
        let Some(cell) = self.cells.get(place) else {
            state.now += SILENT_STEP;
            return state.idle();
        };
        state.now = cell.at;
        let is_as_sent = cell.sent.is_some() && cell.sent == cell.received;
        state.as_sent = if is_as_sent { state.as_sent + 1 } else { 0 };
        if let Some(byte) = cell.received {
            state.idle();
            state.idle_at = self.scenario.idle.then_some(cell.at + IDLE_AFTER);
            let length = cell.ends as usize;
            let whole = (1..=state.as_sent).contains(&length).then_some(length);
            for machine in &mut state.machines {
                machine.push(place, byte, cell.at, whole);
            }
        }
    }
}

impl State {
    /// Notices an idle line, if it was.
    fn idle(&mut self) {
        if let Some(at) = self.idle_at.take_if(|at| *at < self.now) {
            self.machines
                .iter_mut()
                .for_each(|machine| machine.idle(at));
        }
    }
}
