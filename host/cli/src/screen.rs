//! A live view's terminal: taken over, its keys, and given back whatever happens.

use std::io::{self, IsTerminal};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use ratatui::{DefaultTerminal, Frame};

/// Between two drawings: some thirty in a second.
pub(crate) const DRAW_EVERY: Duration = Duration::from_millis(33);

/// Whether standard output is a terminal that can show a view: those inside editors say that they
/// can only show lines.
pub(crate) fn is_there() -> bool {
    io::stdout().is_terminal() && std::env::var_os("TERM").is_none_or(|name| name != "dumb")
}

/// Whether keys can be read although standard input is something else.
pub(crate) fn has_keys() -> bool {
    cfg!(windows) || std::fs::File::open("/dev/tty").is_ok()
}

/// The terminal while a view has it. As long as it lives, nothing else may be written there.
pub struct Screen {
    terminal: DefaultTerminal,
    is_ended: Arc<AtomicBool>,
}

impl Screen {
    /// Takes the terminal over, and Ctrl-C and its relatives as the end.
    ///
    /// # Errors
    /// There is no terminal, or signals cannot be watched for.
    pub fn take() -> Result<Self> {
        // On a terminal in raw mode Ctrl-C is a key; this is for signals from elsewhere.
        let is_ended = Arc::new(AtomicBool::new(false));
        let end = Arc::clone(&is_ended);
        ctrlc::set_handler(move || end.store(true, Ordering::Relaxed))
            .context("cannot watch for signals")?;
        let terminal = ratatui::try_init()
            .inspect_err(|_| ratatui::restore())
            .context("cannot take over the terminal")?;
        Ok(Self { terminal, is_ended })
    }

    /// Whether a signal has asked for the end.
    #[must_use]
    pub fn is_ended(&self) -> bool {
        self.is_ended.load(Ordering::Relaxed)
    }

    /// Draws the view anew.
    ///
    /// # Errors
    /// The terminal cannot be written to.
    pub fn draw(&mut self, draw: impl FnOnce(&mut Frame)) -> io::Result<()> {
        self.terminal.draw(draw).map(|_| ())
    }
}

/// Gives the terminal back. After a panic it is given back already, and once more would put the
/// prompt over the panic's message.
impl Drop for Screen {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            ratatui::restore();
        }
    }
}

/// Waits for the time to pass or for a key; only while a [`Screen`] lives.
pub(crate) fn key_within(time: Duration) -> io::Result<Option<KeyEvent>> {
    let until = Instant::now() + time;
    loop {
        let left = until.saturating_duration_since(Instant::now());
        if !event::poll(left)? {
            return Ok(None);
        }
        match event::read()? {
            Event::Key(key) if key.kind != KeyEventKind::Release => return Ok(Some(key)),
            // To be drawn anew at once.
            Event::Resize(..) => return Ok(None),
            _ => {}
        }
    }
}

/// Whether the key ends every view.
pub(crate) fn quits(key: KeyEvent) -> bool {
    match key.code {
        KeyCode::Char('c') => key.modifiers.contains(KeyModifiers::CONTROL),
        KeyCode::Char('q' | 'Q') | KeyCode::Esc => true,
        _ => false,
    }
}
