//! What a monitor does with what comes and with keys; the view shows what is in here.

use std::path::PathBuf;
use std::time::Duration;

use framelock::{Parser, Setpoint};
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::recording::Recording;
use super::watch::{Report, Watch};
use crate::line_errors::{Marks, Received};
use crate::screen::quits;

/// What the user wants.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Key {
    Quit,
    Help,
    Pause,
    Record,
    Reset,
}

/// What a key means.
pub(super) fn meaning(key: KeyEvent) -> Option<Key> {
    if quits(key) {
        return Some(Key::Quit);
    }
    if key.modifiers.contains(KeyModifiers::CONTROL) {
        // Ctrl-Z is not meant to set the counters to zero.
        return None;
    }
    match key.code {
        KeyCode::Char('?' | 'h') => Some(Key::Help),
        KeyCode::Char(' ' | 'p') => Some(Key::Pause),
        KeyCode::Char('r') => Some(Key::Record),
        KeyCode::Char('z') => Some(Key::Reset),
        _ => None,
    }
}

/// A monitor at work.
pub(super) struct Session<P> {
    watch: Watch<P>,
    /// How bytes come: with marks, if the port reports line errors.
    marks: Option<Marks>,
    recording: Option<Recording>,
    /// What became of the recordings so far, for the end.
    recorded: Vec<String>,
    /// Where recordings that have no name go.
    directory: PathBuf,
    screen: Shown,
    /// The data of what came last, without marks.
    data: Vec<u8>,
}

/// What the view shows.
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is something that the view shows or not"
)]
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Shown {
    /// The line and how it is read.
    pub(super) title: String,
    pub(super) report: Report,
    pub(super) is_paused: bool,
    pub(super) has_help: bool,
    /// The input has ended.
    pub(super) has_ended: bool,
    pub(super) reports_line_errors: bool,
    pub(super) recording: RecordingState,
}

/// Whether the line is recorded.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) enum RecordingState {
    Off,
    On { name: String, bytes: u64 },
    Failed(String),
}

impl<P: Parser<Message = Setpoint> + Default + Copy> Session<P> {
    /// `recording` is one that is under way from the start.
    pub(super) fn new(
        title: String,
        watch: Watch<P>,
        reports_line_errors: bool,
        recording: Option<Recording>,
        directory: PathBuf,
    ) -> Self {
        let mut session = Self {
            marks: reports_line_errors.then(Marks::default),
            recorded: Vec::new(),
            directory,
            screen: Shown {
                title,
                report: watch.report(),
                is_paused: false,
                has_help: false,
                has_ended: false,
                reports_line_errors,
                recording: RecordingState::Off,
            },
            watch,
            recording,
            data: Vec::new(),
        };
        session.show_recording();
        session
    }

    /// Takes what the line brought, at the time `at`.
    pub(super) fn receive(&mut self, at: Duration, bytes: &[u8]) {
        self.data.clear();
        let (watch, data) = (&mut self.watch, &mut self.data);
        let mut take = |received| match received {
            Received::Byte(byte) => {
                data.push(byte);
                watch.byte(at, byte);
            }
            Received::Event(event) => watch.event(at, event),
        };
        match &mut self.marks {
            Some(marks) => marks.feed(bytes, take),
            None => bytes
                .iter()
                .map(|&byte| Received::Byte(byte))
                .for_each(&mut take),
        }
        if let Some(recording) = &mut self.recording
            && let Err(error) = recording.write(&self.data)
        {
            self.recording_failed(&error.to_string());
        }
    }

    /// Time passes.
    pub(super) fn advance_to(&mut self, now: Duration) {
        self.watch.advance_to(now);
        if let Some(recording) = &mut self.recording
            && let Err(error) = recording.flush()
        {
            self.recording_failed(&error.to_string());
        }
    }

    /// The input has ended.
    pub(super) fn end_of_input(&mut self) {
        self.screen.has_ended = true;
    }

    /// Does what a key asks for; gives false if that is the end.
    pub(super) fn key(&mut self, key: Key) -> bool {
        match key {
            // Out of the help first.
            Key::Quit if self.screen.has_help => self.screen.has_help = false,
            Key::Quit => return false,
            Key::Help => self.screen.has_help = !self.screen.has_help,
            Key::Pause => self.screen.is_paused = !self.screen.is_paused,
            Key::Reset => self.watch.reset_counters(),
            Key::Record if self.recording.is_some() => self.end_recording(),
            Key::Record => match Recording::begin_numbered(&self.directory) {
                Ok(recording) => self.recording = Some(recording),
                Err(error) => self.recording_failed(&error.to_string()),
            },
        }
        self.show_recording();
        true
    }

    fn end_recording(&mut self) {
        let Some(mut recording) = self.recording.take() else {
            return;
        };
        let name = recording.name();
        match recording.flush() {
            Ok(()) => self
                .recorded
                .push(format!("{} bytes recorded in {name}", recording.bytes())),
            Err(error) => {
                self.recording = Some(recording);
                self.recording_failed(&error.to_string());
            }
        }
        self.show_recording();
    }

    fn recording_failed(&mut self, reason: &str) {
        let told = match self.recording.take() {
            Some(recording) => format!(
                "recording in {} ended behind byte {}: {reason}",
                recording.name(),
                recording.bytes()
            ),
            None => format!("cannot record in {}: {reason}", self.directory.display()),
        };
        self.recorded.push(told.clone());
        self.screen.recording = RecordingState::Failed(told);
    }

    fn show_recording(&mut self) {
        if let Some(recording) = &self.recording {
            self.screen.recording = RecordingState::On {
                name: recording.name(),
                bytes: recording.bytes(),
            };
        } else if !matches!(self.screen.recording, RecordingState::Failed(_)) {
            self.screen.recording = RecordingState::Off;
        }
    }

    /// What the view is to show now. While it is paused the line is watched and recorded all the
    /// same.
    pub(super) fn shown(&mut self) -> &Shown {
        if !self.screen.is_paused {
            self.screen.report = self.watch.report();
        }
        self.show_recording();
        &self.screen
    }

    /// Ends it; gives what is to be told when the view is gone.
    pub(super) fn finish(mut self) -> Vec<String> {
        self.end_recording();
        let counters = self.watch.counters();
        let events = &counters.events;
        let mut told = vec![format!(
            "{}: bytes {}, frames {}, bytes discarded {}, resynchronisations {}, line errors {}",
            self.screen.title,
            counters.bytes,
            counters.frames,
            counters.discarded.total(),
            counters.resynchronisations,
            events.framing + events.parity + events.overrun + events.line_break,
        )];
        told.append(&mut self.recorded);
        told
    }
}

#[cfg(test)]
pub(super) mod tests;
