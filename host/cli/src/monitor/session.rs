//! The state of a monitor, which handles arriving bytes and keys. The view shows this state.

use std::fs::File;
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use framelock::LineEvent;

use super::watch::Watch;
use crate::frame_writer::FrameWriter;
use crate::line_errors::{Marking, Marks};
use crate::process::time_of_day;
use crate::screen::quits;
use crate::serial::Device;

/// The limit on the number of file names that are tried for a recording.
const MOST_NAMES: u32 = 9_999;

/// A recording in a file: the bytes of the line, or its frames with their times.
pub(super) struct Recording {
    pub(super) path: PathBuf,
    pub(super) bytes: u64,
    has_frames: bool,
    file: BufWriter<File>,
}

impl Recording {
    /// Begins a recording in a new file, and never replaces a file. Records frames if the file's name
    /// ends in `.csv`, otherwise bytes.
    pub(super) fn begin(path: PathBuf, frame: &FrameWriter) -> io::Result<Self> {
        let mut file = BufWriter::new(File::create_new(&path)?);
        let has_frames = path.extension().is_some_and(|extension| extension == "csv");
        if has_frames {
            let mut header = Vec::new();
            frame.append_csv_header(&mut header, true);
            file.write_all(&header)?;
        }
        Ok(Self {
            path,
            bytes: 0,
            has_frames,
            file,
        })
    }

    /// Begins a recording in a new file in `directory`. Tries the names `framelock-1.bin`, `framelock-2.bin` and
    /// so on, and takes the first one that does not exist.
    fn begin_numbered(directory: &Path, frame: &FrameWriter) -> io::Result<Self> {
        (1..=MOST_NAMES)
            .map(|number| Self::begin(directory.join(format!("framelock-{number}.bin")), frame))
            .find(|outcome| !matches!(outcome, Err(error) if error.kind() == ErrorKind::AlreadyExists))
            .unwrap_or_else(|| Err(ErrorKind::AlreadyExists.into()))
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.file.write_all(bytes)?;
        self.bytes += bytes.len() as u64;
        Ok(())
    }
}

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
    pub(super) recording: Option<Recording>,
    /// Messages about finished recordings and about the port.
    pub(super) notes: Vec<String>,
    /// The directory for recordings that the user starts without giving a name.
    directory: PathBuf,
    pub(super) has_help: bool,
    pub(super) has_ended: bool,
    pub(super) is_gone: bool,
}

impl MonitorSession {
    pub(super) fn new(title: String, watch: Watch, recording: Option<Recording>) -> Self {
        Self {
            title,
            watch,
            frozen: None,
            marks: None,
            marking: None,
            recording,
            notes: Vec::new(),
            directory: PathBuf::new(),
            has_help: false,
            has_ended: false,
            is_gone: false,
        }
    }

    pub(super) fn is_paused(&self) -> bool {
        self.frozen.is_some()
    }

    /// Returns the state for the view. While the view is paused, watching and recording go on.
    pub(super) fn shown(&self) -> &Watch {
        self.frozen.as_ref().unwrap_or(&self.watch)
    }

    /// Takes bytes that arrived at the time `at`.
    pub(super) fn receive(&mut self, at: Duration, bytes: &[u8]) {
        let mut data = Vec::new();
        let mut take = |received| match received {
            Ok(byte) => {
                data.push(byte);
                self.watch.byte(at, byte);
            }
            Err(event) => self.watch.event(at, event),
        };
        match &mut self.marks {
            Some(marks) => marks.feed(bytes, take),
            None => bytes.iter().for_each(|&byte| take(Ok(byte))),
        }
        self.record_arrivals(&data);
    }

    /// Records the frames that have arrived if this is a recording of frames, otherwise these bytes.
    fn record_arrivals(&mut self, bytes: &[u8]) {
        let mut rows = Vec::new();
        let Watch { frame, arrived, .. } = &mut self.watch;
        let wants_rows = self.recording.as_ref().is_some_and(|it| it.has_frames);
        for (place, bytes) in arrived.drain(..).filter(|_| wants_rows) {
            frame.append_csv(&mut rows, &place, &bytes);
        }
        self.record(|recording| recording.write(if wants_rows { &rows } else { bytes }));
    }

    /// Makes the port mark line errors, if the operating system supports this.
    pub(super) fn mark_errors(&mut self, device: Device, has_parity: bool) {
        self.marking = Marking::begin(device);
        self.marks = self.marking.as_ref().map(|_| Marks::new(has_parity));
    }

    /// Handles the loss of the port. No frame continues after the loss.
    pub(super) fn lose_port(&mut self, at: Duration, why: &str) {
        self.watch.event(at, LineEvent::Idle);
        self.record_arrivals(&[]);
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
        self.record_arrivals(&[]);
        // Flush, so that other programs can read everything that was recorded so far.
        self.record(|recording| recording.file.flush());
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
            KeyCode::Char('r') if self.recording.is_some() => self.end_recording(),
            KeyCode::Char('r') => {
                match Recording::begin_numbered(&self.directory, &self.watch.frame) {
                    Ok(recording) => self.recording = Some(recording),
                    Err(error) => {
                        let directory = self.directory.display();
                        self.notes
                            .push(format!("cannot record in {directory}: {error}"));
                    }
                }
            }
            _ => {}
        }
        true
    }

    /// Calls `write` with the recording, if there is one. After an error, the recording ends.
    fn record(&mut self, write: impl FnOnce(&mut Recording) -> io::Result<()>) {
        if let Some(recording) = &mut self.recording
            && let Err(error) = write(recording)
        {
            let (name, bytes) = (recording.path.display(), recording.bytes);
            self.notes.push(format!(
                "recording in {name} ended after byte {bytes}: {error}"
            ));
            self.recording = None;
        }
    }

    fn end_recording(&mut self) {
        self.record(|recording| recording.file.flush());
        if let Some(Recording { path, bytes, .. }) = self.recording.take() {
            let name = path.display();
            self.notes.push(format!("{bytes} bytes recorded in {name}"));
        }
    }

    /// Ends the session. Returns the lines to print after the view is gone.
    pub(super) fn finish(mut self) -> Vec<String> {
        self.end_recording();
        let counters = self.watch.line.counters();
        let events = &counters.events;
        let mut told = vec![format!(
            "{}: bytes {}, frames {}, bytes discarded {}, resynchronisations {}, line errors {}",
            self.title,
            counters.bytes,
            counters.frames,
            counters.discarded.total(),
            counters.resynchronisations,
            events.framing + events.parity + events.overrun + events.line_break,
        )];
        told.append(&mut self.notes);
        told
    }
}

#[cfg(test)]
pub(super) mod tests;
