//! The live view on a terminal: its clock, its keys, and its end.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};

use super::simulation::Simulation;
use super::view;

/// Between two drawings: some thirty in a second.
const DRAW_EVERY: Duration = Duration::from_millis(33);

/// What is at most made up for between two drawings: who stopped the process for a while does not
/// want to find the rest over.
const LONGEST_STEP: Duration = Duration::from_millis(250);

/// Shows the simulation until it is over or somebody ends it, `speed` times as fast as it would
/// be. The terminal is as before afterwards, whatever happens.
pub(super) fn run(simulation: &mut Simulation, speed: f64) -> Result<()> {
    // On a terminal in raw mode Ctrl-C is a key; this is for signals from elsewhere.
    let is_ended = Arc::new(AtomicBool::new(false));
    let end = Arc::clone(&is_ended);
    ctrlc::set_handler(move || end.store(true, Ordering::Relaxed))
        .context("cannot watch for signals")?;

    let mut terminal = ratatui::try_init().context("cannot take over the terminal")?;
    let _restored = Restored;
    let mut drawn_at = Instant::now();
    let mut is_paused = false;
    while !simulation.is_over() && !is_ended.load(Ordering::Relaxed) {
        terminal.draw(|frame| view::draw(frame, simulation, is_paused))?;
        match key_within(DRAW_EVERY)? {
            Some(Key::Quit) => break,
            Some(Key::Pause) => is_paused = !is_paused,
            None => {}
        }
        let elapsed = drawn_at.elapsed();
        drawn_at += elapsed;
        if !is_paused {
            let step = elapsed.min(LONGEST_STEP).mul_f64(speed);
            simulation.advance_to(simulation.now() + step);
        }
    }
    Ok(())
}

/// Gives the terminal back when it goes out of scope. After a panic it is given back already, and
/// once more would put the prompt over the panic's message.
struct Restored;

impl Drop for Restored {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            ratatui::restore();
        }
    }
}

/// What the user wants.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Key {
    Quit,
    Pause,
}

/// Waits for the time to pass or for a key that means something.
fn key_within(time: Duration) -> io::Result<Option<Key>> {
    let until = Instant::now() + time;
    loop {
        let left = until.saturating_duration_since(Instant::now());
        if !event::poll(left)? {
            return Ok(None);
        }
        match event::read()? {
            Event::Key(key) => {
                if let Some(key) = meaning(key) {
                    return Ok(Some(key));
                }
            }
            // To be drawn anew at once.
            Event::Resize(..) => return Ok(None),
            _ => {}
        }
    }
}

fn meaning(key: KeyEvent) -> Option<Key> {
    if key.kind == KeyEventKind::Release {
        return None;
    }
    match key.code {
        KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => Some(Key::Quit),
        KeyCode::Char('q' | 'Q') | KeyCode::Esc => Some(Key::Quit),
        KeyCode::Char(' ') => Some(Key::Pause),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_mean_what_the_view_says() {
        let plain = |code| meaning(KeyEvent::new(code, KeyModifiers::NONE));
        assert_eq!(plain(KeyCode::Char('q')), Some(Key::Quit));
        assert_eq!(plain(KeyCode::Esc), Some(Key::Quit));
        assert_eq!(plain(KeyCode::Char(' ')), Some(Key::Pause));
        assert_eq!(plain(KeyCode::Char('c')), None);
        let control = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
        assert_eq!(meaning(control), Some(Key::Quit));
    }
}
