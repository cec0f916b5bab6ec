//! Arrivals: the bytes and line events of an input, in their order, with their times if the input has times.
//!
//! ```text
//!  bytes of a file, pipe or port ──────────────────┐
//!  hex: logs with times, dumps with offsets (text) ┤
//!  tables of a logic analyser (analyser) ──────────┼─► Arrival { time, bytes, event }
//!  MAVLink's .tlog (tlog) ─────────────────────────┘
//! ```

use std::io::{BufRead, BufReader};
use std::iter::{Peekable, from_fn};

use anyhow::{Context, Result};
use clap::ValueEnum;
use framelock::LineEvent;

use super::{CHUNK_LENGTH, Input, analyser, text, tlog};

/// Bytes that arrived together, and the line event after the bytes, if any.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct Arrival {
    /// The time in microseconds, if the input records times.
    pub(crate) time: Option<i64>,
    pub(crate) bytes: Vec<u8>,
    pub(crate) event: Option<LineEvent>,
}

impl Arrival {
    pub(super) fn new(time: Option<i64>, bytes: Vec<u8>) -> Self {
        let event = None;
        Self { time, bytes, event }
    }
}

/// The number of bytes of a file's beginning from which its notation is found.
const LOOKED_AT: usize = 8 * 1024;

/// The notation of an input's bytes.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum InputNotation {
    /// Raw bytes
    Bytes,
    /// Hex in text: logs, perhaps with times; dumps with offsets; annotations of sigrok
    Hex,
    /// A table of a logic analyser
    Csv,
    /// A log of `MAVLink` with the time of each frame
    Tlog,
}

impl InputNotation {
    /// Returns the notation of a file with this name and beginning. If the name ends neither in `.tlog` nor in `.hex`,
    /// a text is read as bytes unless it can only be a log, a dump or a table.
    fn of(name: &str, beginning: &[u8]) -> Self {
        let is_named = |ending: &str| name.to_ascii_lowercase().ends_with(ending);
        let length = beginning.len().min(LOOKED_AT);
        let text = String::from_utf8_lossy(&beginning[..length]);
        let is_text = text.chars().all(|c| c.is_whitespace() || !c.is_control());
        if is_named(".tlog") {
            Self::Tlog
        } else if analyser::is_table(&text) {
            Self::Csv
        } else if is_named(".hex") || is_text && text::is_log_or_dump(&text) {
            Self::Hex
        } else {
            Self::Bytes
        }
    }
}

/// The arrivals of an input.
pub(crate) struct Arrivals<'a> {
    /// The input's name in messages.
    pub(crate) name: String,
    /// Whether the input is a regular file.
    pub(crate) is_file: bool,
    pub(crate) notation: InputNotation,
    /// Whether the first arrival has a time.
    pub(crate) has_times: bool,
    /// A mask with the data bits of a byte.
    mask: u8,
    items: Peekable<Box<dyn Iterator<Item = Result<Arrival>> + 'a>>,
}

impl<'a> Arrivals<'a> {
    /// Reads an input in this notation. If `notation` is `None`, a file's name and beginning determine its notation,
    /// and other inputs are raw bytes.
    pub(crate) fn new(input: Input<'a>, notation: Option<InputNotation>) -> Result<Self> {
        let (name, is_file, mask) = (input.name.clone(), input.is_file, input.mask);
        let mut reader = BufReader::with_capacity(CHUNK_LENGTH, input);
        let notation = match notation {
            Some(notation) => notation,
            None if is_file => InputNotation::of(&name, reader.fill_buf()?),
            None => InputNotation::Bytes,
        };
        let items: Box<dyn Iterator<Item = Result<Arrival>> + 'a> = match notation {
            InputNotation::Bytes => Box::new(chunks(reader)),
            InputNotation::Hex => Box::new(text::arrivals(name.clone(), reader)),
            InputNotation::Csv => Box::new(analyser::arrivals(name.clone(), reader)?),
            InputNotation::Tlog => Box::new(tlog::arrivals(reader)),
        };
        let mut items = items.peekable();
        let is_timed = |first: &Result<Arrival>| matches!(first, Ok(Arrival { time: Some(_), .. }));
        // Raw bytes have no times, so do not wait for the first bytes.
        let has_times = notation != InputNotation::Bytes && items.peek().is_some_and(is_timed);
        Ok(Self {
            name,
            is_file,
            notation,
            has_times,
            mask,
            items,
        })
    }
}

impl Iterator for Arrivals<'_> {
    type Item = Result<Arrival>;

    fn next(&mut self) -> Option<Result<Arrival>> {
        let mut next = self.items.next()?;
        if let (Ok(arrival), ..=0x7F) = (&mut next, self.mask) {
            arrival.bytes.iter_mut().for_each(|byte| *byte &= self.mask);
        }
        Some(next)
    }
}

/// Calls `read` with each line, and with `None` at the end. Returns the arrivals that `read` returns.
pub(super) fn each<L>(
    name: String,
    lines: impl Iterator<Item = Result<(u64, L)>>,
    mut read: impl FnMut(Option<L>) -> Result<Option<Arrival>>,
) -> impl Iterator<Item = Result<Arrival>> {
    let lines = lines.map(Some).chain([None]);
    lines.filter_map(move |line| {
        let (number, line) = match line.transpose() {
            Ok(line) => line.unzip(),
            Err(error) => return Some(Err(error)),
        };
        let at_line = || format!("{name}: line {}", number.unwrap_or_default());
        read(line).with_context(at_line).transpose()
    })
}

/// Returns raw bytes as soon as they arrive.
fn chunks(mut reader: impl BufRead) -> impl Iterator<Item = Result<Arrival>> {
    from_fn(move || match reader.fill_buf() {
        Ok([]) => None,
        Ok(chunk) => {
            let bytes = chunk.to_vec();
            reader.consume(bytes.len());
            Some(Ok(Arrival::new(None, bytes)))
        }
        Err(error) => Some(Err(error.into())),
    })
}
