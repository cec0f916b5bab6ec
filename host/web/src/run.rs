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

/// If no byte arrives for this number of milliseconds, the line counts as idle. This time is just over four byte times:
/// a pause of three byte times, and the byte after it.
const IDLE_AFTER: u32 = 35;

/// The machines at one position on the line.
pub(crate) struct State {
    position: usize,
    /// The time in milliseconds.
    pub(crate) now: u32,
    pub(crate) machines: Vec<Machine>,
    /// The number of consecutive bytes, up to the latest byte, that arrived as they were sent.
    as_sent: usize,
    /// The time from which the line counts as idle unless a byte arrives.
    idle_at: Option<u32>,
}

/// A scenario and its line. The page's script calls these methods.
#[wasm_bindgen]
pub struct Run {
    scenario: Scenario,
    pub(crate) protocol: Protocol,
    pub(crate) cells: Vec<Cell>,
}

#[wasm_bindgen]
#[allow(
    clippy::must_use_candidate,
    reason = "calling a method only for its result is harmless"
)]
impl Run {
    /// Opens the scenario of an address.
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

    /// Returns the last position, which is the end of the silence after the bytes.
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

    /// Returns the address after setting the keys in `pairs`, for example `at=12&idle=on`.
    ///
    /// # Errors
    /// Returns an error if there is no such key, or the key cannot have that value.
    pub fn with(&self, pairs: &str) -> Result<String, String> {
        let mut scenario = self.scenario.clone();
        scenario.apply(pairs).map_err(|error| said(&error))?;
        Ok(scenario.to_string())
    }

    /// Returns the address after an edit of the byte at `place`: `flip` inverts the bits in `value`, and `insert`
    /// inserts the byte `value` before it. `drop` loses the byte, restores a lost byte, or removes an inserted byte.
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
    fn of(address: &str) -> Result<Self> {
        let scenario: Scenario = address.parse()?;
        let protocol = scenario.protocol()?;
        Ok(Self {
            cells: line(&scenario, &protocol)?,
            scenario,
            protocol,
        })
    }

    /// Returns the machines at this position.
    pub(crate) fn at(&self, position: usize) -> State {
        // The lecture's machine receives only BIN frames.
        let policies = [Policy::Lecture, Policy::Framelock].into_iter();
        let lines = policies.filter_map(|policy| AnyLine::new(&self.protocol, policy).ok());
        let machines = lines.map(|line| Machine::new(line, self.protocol.clone()));
        let mut state = State {
            machines: machines.collect(),
            position: 0,
            now: 0,
            as_sent: 0,
            idle_at: None,
        };
        while state.position < position {
            self.step(&mut state);
        }
        state
    }

    /// Advances by one byte or by one step of silence.
    fn step(&self, state: &mut State) {
        let place = state.position;
        state.position += 1;
        for machine in &mut state.machines {
            machine.decided_before = machine.fates.len();
        }
        if let Some(cell) = self.cells.get(place) {
            state.now = cell.at;
            self.carry(state, cell);
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

    /// Passes a byte to the machines, if it arrives.
    fn carry(&self, state: &mut State, cell: &Cell) {
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
                machine.push(byte, cell.at, whole);
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
