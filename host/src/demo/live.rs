//! The live view on a terminal: its clock, its keys, and its end.

use std::time::{Duration, Instant};

use anyhow::Result;
use ratatui::crossterm::event::{KeyCode, KeyEvent};

use super::simulation::Simulation;
use super::view;
use crate::screen::{DRAW_EVERY, Screen, key_within, quits};

/// What is at most made up for between two drawings: who stopped the process for a while does not
/// want to find the rest over.
const LONGEST_STEP: Duration = Duration::from_millis(250);

/// Shows the simulation until it is over or somebody ends it, `speed` times as fast as it would
/// be. The terminal is as before afterwards, whatever happens.
pub(super) fn run(simulation: &mut Simulation, speed: f64) -> Result<()> {
    let mut screen = Screen::take()?;
    let mut drawn_at = Instant::now();
    let mut is_paused = false;
    while !simulation.is_over() && !screen.is_ended() {
        screen.draw(|frame| view::draw(frame, simulation, is_paused))?;
        match key_within(DRAW_EVERY, meaning)? {
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

/// What the user wants.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Key {
    Quit,
    Pause,
}

fn meaning(key: KeyEvent) -> Option<Key> {
    match key.code {
        _ if quits(key) => Some(Key::Quit),
        KeyCode::Char(' ') => Some(Key::Pause),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use ratatui::crossterm::event::KeyModifiers;

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
