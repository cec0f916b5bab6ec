//! Runs the live view on a terminal, with its clock and keys.

use std::time::{Duration, Instant};

use anyhow::Result;
use ratatui::crossterm::event::{KeyCode, KeyEvent};

use super::demonstration::Demonstration;
use super::view;
use crate::screen::{DRAW_EVERY, Screen, key_within, quits};

/// The longest time that the demonstration advances between two drawings. With this limit, a user who suspends and
/// resumes the process misses nothing.
const LONGEST_STEP: Duration = Duration::from_millis(250);

/// Shows the demonstration in real time, until the demonstration is over or the user quits. Restores the
/// terminal afterwards, even after an error or a panic.
pub(super) fn run(demonstration: &mut Demonstration) -> Result<()> {
    let mut screen = Screen::take()?;
    let mut drawn_at = Instant::now();
    let (mut is_paused, mut has_room) = (false, true);
    while !demonstration.is_over() && !screen.is_ended() {
        screen.draw(|frame| has_room = view::draw(frame, demonstration, is_paused))?;
        if let Some(key) = key_within(DRAW_EVERY)?
            && !goes_on(key, &mut is_paused)
        {
            break;
        }
        let elapsed = drawn_at.elapsed();
        drawn_at += elapsed;
        if !is_paused && has_room {
            let step = elapsed.min(LONGEST_STEP);
            demonstration.advance_to(demonstration.now + step);
        }
    }
    Ok(())
}

/// Handles a key, which may pause or resume. Returns false if the key quits.
fn goes_on(key: KeyEvent, is_paused: &mut bool) -> bool {
    *is_paused ^= key.code == KeyCode::Char(' ');
    !quits(key)
}

#[cfg(test)]
mod tests {
    use ratatui::crossterm::event::KeyModifiers;

    use super::*;

    #[test]
    fn keys_mean_what_the_view_says() {
        let mut is_paused = false;
        let mut press = |code, modifiers| {
            let goes_on = goes_on(KeyEvent::new(code, modifiers), &mut is_paused);
            (goes_on, is_paused)
        };
        let none = KeyModifiers::NONE;
        assert_eq!(press(KeyCode::Char('c'), none), (true, false));
        assert_eq!(press(KeyCode::Char(' '), none), (true, true));
        assert_eq!(press(KeyCode::Char(' '), none), (true, false));
        assert_eq!(press(KeyCode::Char('q'), none), (false, false));
        assert_eq!(press(KeyCode::Esc, none), (false, false));
        assert_eq!(
            press(KeyCode::Char('c'), KeyModifiers::CONTROL),
            (false, false)
        );
    }
}
