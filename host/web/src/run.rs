//! Runs the machines along the line from the beginning to any position.

use anyhow::Result;
use framelock::LineEvent;
use framelock_receiving::{AnyLine, Policy, Protocol};
use wasm_bindgen::prelude::wasm_bindgen;

use crate::line::{Cell, line};
use crate::machine::Machine;
use crate::said;
use crate::scenario::{Action, Scenario};

/// The number of steps of silence after the last byte, and the length of a step in milliseconds. The
/// silence is long enough for the failsafe to park the actuators.
const SILENT_STEPS: usize = 32;
const SILENT_STEP: u32 = 50;

/// If no byte arrives for this number of milliseconds, the idle-gap rule drops the pending bytes. This time is three
/// byte times, plus the time in which the next byte arrives.
const IDLE_AFTER: u32 = 35;

/// The distance between saved states, in bytes.
const SAVED_EVERY: usize = 1 << 10;

/// The machines at one position on the line.
#[derive(Clone)]
pub(crate) struct State {
    pub(crate) position: usize,
    /// The time in milliseconds.
    pub(crate) now: u32,
    pub(crate) machines: Vec<Machine>,
    /// The number of consecutive bytes, up to the latest byte, that arrived as they were sent.
    as_sent: usize,
    /// The time from which the line counts as idle unless a byte arrives.
    idle_at: Option<u32>,
}

/// A scenario, its line and the saved states of its machines. The page's script calls these
/// methods.
#[wasm_bindgen]
pub struct Run {
    scenario: Scenario,
    pub(crate) protocol: Protocol,
    pub(crate) cells: Vec<Cell>,
    /// The states at the beginning and after every [`SAVED_EVERY`] bytes, so that any position is reached in few steps.
    saved: Vec<State>,
}

#[wasm_bindgen]
#[allow(
    clippy::must_use_candidate,
    reason = "calling a method only for its result is harmless"
)]
impl Run {
    /// Opens the scenario of an address, and runs the machines along the whole line.
    ///
    /// # Errors
    /// Returns an error if the address is malformed.
    pub fn open(address: &str) -> Result<Run, String> {
        Self::of(address).map_err(|error| said(&error))
    }

    /// Returns the number of bytes on the line.
    pub fn bytes(&self) -> usize {
        self.cells.len()
    }

    /// Returns the last position: the end of all bytes and of the silence after them.
    pub fn positions(&self) -> usize {
        self.cells.len() + SILENT_STEPS
    }

    /// Returns the description of the frames.
    pub fn description(&self) -> String {
        self.protocol.text.clone()
    }

    /// Returns the position that the address contains.
    pub fn position(&self) -> usize {
        self.scenario.at
    }

    /// Returns the address with some keys set to other values, such as `at=12&idle=on`.
    ///
    /// # Errors
    /// Returns an error if there is no such key, or the key cannot have that value.
    pub fn with(&self, pairs: &str) -> Result<String, String> {
        let mut scenario = self.scenario.clone();
        scenario.apply(pairs).map_err(|error| said(&error))?;
        Ok(scenario.to_string())
    }

    /// Returns the address after an edit of the byte at `place`: `drop` loses the byte, `flip`
    /// inverts the bits in `value`, and `insert` inserts the byte `value` before it.
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

    /// Returns the view at `position` as JSON, with the line's cells `from..to`.
    pub fn view(&self, position: usize, from: usize, to: usize) -> String {
        self.json(position, from..to).to_string()
    }
}

impl Run {
    /// Opens the scenario of an address, and runs the machines along the whole line.
    fn of(address: &str) -> Result<Self> {
        let scenario: Scenario = address.parse()?;
        let protocol = scenario.protocol()?;
        // The lecture's machine does not receive all frames.
        let lecture = AnyLine::new(&protocol, Policy::Lecture).ok();
        let framelock = AnyLine::new(&protocol, Policy::Framelock)?;
        let lines = lecture.into_iter().chain([framelock]);
        let machines = lines.map(|line| Machine::new(line, protocol.clone()));
        let mut state = State {
            machines: machines.collect(),
            position: 0,
            now: 0,
            as_sent: 0,
            idle_at: None,
        };
        let mut run = Self {
            cells: line(&scenario, &protocol)?,
            scenario,
            protocol,
            saved: Vec::new(),
        };
        while state.position < run.cells.len() {
            if state.position.is_multiple_of(SAVED_EVERY) {
                run.saved.push(state.clone());
            }
            run.step(&mut state);
        }
        run.saved.push(state);
        Ok(run)
    }

    /// Returns the last saved state at or before a position.
    pub(crate) fn saved_before(&self, position: usize) -> State {
        let mut states = self.saved.iter().rev();
        let before = states.find(|state| state.position <= position);
        before.expect("the beginning is saved").clone()
    }

    /// Advances by one byte or by one step of silence.
    pub(crate) fn step(&self, state: &mut State) {
        let place = state.position;
        state.position += 1;
        for machine in &mut state.machines {
            machine.fates.clear();
        }
        if let Some(cell) = self.cells.get(place) {
            state.now = cell.at;
            self.carry(state, place, cell);
        } else {
            state.now += SILENT_STEP;
            match self.protocol.description.ending_event() {
                // The next break ends the last packet.
                Some(LineEvent::Break) => state.event(LineEvent::Break),
                _ => state.idle(),
            }
        }
        for machine in &mut state.machines {
            machine.poll(state.now);
        }
    }

    /// Passes the byte at this place to the machines, if it arrives.
    fn carry(&self, state: &mut State, place: usize, cell: &Cell) {
        let is_as_sent = cell.sent.is_some() && cell.sent == cell.received;
        state.as_sent = if is_as_sent { state.as_sent + 1 } else { 0 };
        if cell.begins && self.protocol.description.ending_event() == Some(LineEvent::Break) {
            state.event(LineEvent::Break);
        }
        if let Some(byte) = cell.received {
            state.idle();
            // Pauses neither begin nor end packets.
            let is_packet = self.protocol.description.format().packets().is_some();
            let ends_frames = self.protocol.description.ending_event() == Some(LineEvent::Idle);
            let has_gap_rule = ends_frames || self.scenario.idle && !is_packet;
            state.idle_at = has_gap_rule.then_some(cell.at + IDLE_AFTER);
            let whole = (1..=state.as_sent)
                .contains(&cell.ends)
                .then_some(cell.ends);
            for machine in &mut state.machines {
                machine.push(place, byte, cell.at, whole);
            }
        }
    }
}

impl State {
    /// Reports an idle line to the machines if the line has been idle for long enough.
    fn idle(&mut self) {
        if self.idle_at.take_if(|at| *at < self.now).is_some() {
            self.event(LineEvent::Idle);
        }
    }

    /// Reports a line event to the machines.
    fn event(&mut self, event: LineEvent) {
        self.machines
            .iter_mut()
            .for_each(|machine| machine.line_event(event));
    }
}
