//! The terminal of a live view: takes it over, reads keys, and restores it after any outcome.

use std::io::{self, IsTerminal};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use ratatui::{DefaultTerminal, Frame};

/// The time between two drawings, for about thirty drawings per second.
pub(crate) const DRAW_EVERY: Duration = Duration::from_millis(33);

/// Returns whether standard output is a terminal that can show a view. Terminals inside editors set `TERM=dumb`,
/// because they can only show lines.
pub(crate) fn is_there() -> bool {
    io::stdout().is_terminal() && std::env::var_os("TERM").is_none_or(|name| name != "dumb")
}

/// Returns whether keys can be read even if standard input is not a terminal.
pub(crate) fn has_keys() -> bool {
    cfg!(windows) || std::fs::File::open("/dev/tty").is_ok()
}

/// The terminal while a view uses it. Nothing else may write to the terminal during that time.
pub struct Screen {
    terminal: DefaultTerminal,
    is_ended: Arc<AtomicBool>,
}

impl Screen {
    /// Takes the terminal over, and watches for the signals that end a process.
    ///
    /// # Errors
    /// Returns an error if there is no terminal, or signals cannot be watched for.
    pub fn take() -> Result<Self> {
        // In raw mode, Ctrl-C is a key. This handler is for signals from other processes.
        let is_ended = Arc::new(AtomicBool::new(false));
        let end = Arc::clone(&is_ended);
        ctrlc::set_handler(move || end.store(true, Ordering::Relaxed))
            .context("cannot watch for signals")?;
        let terminal = ratatui::try_init()
            .inspect_err(|_| ratatui::restore())
            .context("cannot take over the terminal")?;
        Ok(Self { terminal, is_ended })
    }

    /// Returns whether a signal has asked the process to end.
    #[must_use]
    pub fn is_ended(&self) -> bool {
        self.is_ended.load(Ordering::Relaxed)
    }

    /// Redraws the view.
    ///
    /// # Errors
    /// Returns an error if the terminal cannot be written to.
    pub fn draw(&mut self, draw: impl FnOnce(&mut Frame)) -> io::Result<()> {
        self.terminal.draw(draw).map(|_| ())
    }
}

/// Restores the terminal. After a panic, the terminal is already restored, and restoring it again would
/// put the prompt over the panic's message.
impl Drop for Screen {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            ratatui::restore();
        }
    }
}

/// Waits for a key, at most for this time. Call it only while a [`Screen`] exists.
pub(crate) fn key_within(time: Duration) -> io::Result<Option<KeyEvent>> {
    let until = Instant::now() + time;
    loop {
        let left = until.saturating_duration_since(Instant::now());
        if !event::poll(left)? {
            return Ok(None);
        }
        match event::read()? {
            Event::Key(key) if key.kind != KeyEventKind::Release => return Ok(Some(key)),
            // Return immediately, so that the view is redrawn.
            Event::Resize(..) => return Ok(None),
            _ => {}
        }
    }
}

/// Returns whether the key quits. The same keys quit every view.
pub(crate) fn quits(key: KeyEvent) -> bool {
    match key.code {
        KeyCode::Char('c') => key.modifiers.contains(KeyModifiers::CONTROL),
        KeyCode::Char('q' | 'Q') | KeyCode::Esc => true,
        _ => false,
    }
}
