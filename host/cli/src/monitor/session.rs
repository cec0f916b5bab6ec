//! The state of a monitor, which handles arriving bytes and keys. The view shows this state.

use std::time::Duration;

use framelock::LineEvent;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::watch::Watch;
use crate::line_errors::{Marking, Marks};
use crate::process::time_of_day;
use crate::screen::quits;
use crate::serial::Device;

/// A running monitor.
pub(super) struct MonitorSession {
    /// The name of the line, its settings, and the receiver.
    pub(super) title: String,
    watch: Watch,
    /// A copy of the watch at the moment when the view was paused.
    frozen: Option<Watch>,
    /// The decoder of marks among the bytes, if the port reports line errors.
    pub(super) marks: Option<Marks>,
    /// Makes the port mark line errors, and restores the port's settings when dropped.
    marking: Option<Marking>,
    /// Messages about the port.
    pub(super) notes: Vec<String>,
    pub(super) has_help: bool,
    pub(super) has_ended: bool,
    pub(super) is_gone: bool,
}

impl MonitorSession {
    pub(super) fn new(title: String, watch: Watch) -> Self {
        Self {
            title,
            watch,
            frozen: None,
            marks: None,
            marking: None,
            notes: Vec::new(),
            has_help: false,
            has_ended: false,
            is_gone: false,
        }
    }

    pub(super) fn is_paused(&self) -> bool {
        self.frozen.is_some()
    }

    /// Returns the state for the view. While the view is paused, watching goes on.
    pub(super) fn displayed(&self) -> &Watch {
        self.frozen.as_ref().unwrap_or(&self.watch)
    }

    /// Takes bytes that arrived at the time `at`.
    pub(super) fn receive(&mut self, at: Duration, bytes: &[u8]) {
        let mut take = |received| match received {
            Ok(byte) => self.watch.byte(at, byte),
            Err(event) => self.watch.event(at, event),
        };
        match &mut self.marks {
            Some(marks) => marks.feed(bytes, take),
            None => bytes.iter().for_each(|&byte| take(Ok(byte))),
        }
    }

    /// Makes the port mark line errors, if the operating system supports this.
    pub(super) fn mark_errors(&mut self, device: Device, has_parity: bool) {
        self.marking = Marking::begin(device);
        self.marks = self.marking.as_ref().map(|_| Marks::new(has_parity));
    }

    /// Handles the loss of the port. No frame continues after the loss.
    pub(super) fn lose_port(&mut self, at: Duration, why: &str) {
        self.watch.event(at, LineEvent::Idle);
        self.notes.push(format!("{}: {why}", time_of_day()));
        // Close the device. As long as the device is open, the operating system may give the returning port another
        // name.
        self.marking = None;
        self.is_gone = true;
    }

    /// Handles the return of the port.
    pub(super) fn regain_port(&mut self, device: Device) {
        let has_parity = self
            .marks
            .is_some_and(|marks| marks.error == LineEvent::Parity);
        self.mark_errors(device, has_parity);
        self.notes
            .push(format!("{}: the port is back", time_of_day()));
        self.is_gone = false;
    }

    /// Advances to the time `now`.
    pub(super) fn advance_to(&mut self, now: Duration) {
        self.watch.advance_to(now);
    }

    /// Handles a key. Returns false if the key quits.
    pub(super) fn key(&mut self, key: KeyEvent) -> bool {
        if quits(key) {
            // If the help is open, the key only closes it.
            return std::mem::take(&mut self.has_help);
        }
        if key.modifiers.contains(KeyModifiers::CONTROL) {
            // Ignore other keys with Ctrl. Otherwise Ctrl-Z would set the counters to zero.
            return true;
        }
        match key.code {
            KeyCode::Char('?' | 'h') => self.has_help = !self.has_help,
            KeyCode::Char(' ' | 'p') if self.is_paused() => self.frozen = None,
            KeyCode::Char(' ' | 'p') => self.frozen = Some(self.watch.clone()),
            KeyCode::Char('z') => self.watch.reset_counters(),
            _ => {}
        }
        true
    }

    /// Ends the session. Returns the lines to print after the view is gone.
    pub(super) fn finish(mut self) -> Vec<String> {
        let counters = self.watch.line.counters();
        let events = &counters.events;
        let mut lines = vec![format!(
            "{}: bytes {}, frames {}, bytes discarded {}, resynchronisations {}, line errors {}",
            self.title,
            counters.bytes,
            counters.frames,
            counters.discarded.total(),
            counters.resynchronisations,
            events.framing + events.parity + events.overrun + events.line_break,
        )];
        lines.append(&mut self.notes);
        lines
    }
}

#[cfg(test)]
pub(super) mod tests;
