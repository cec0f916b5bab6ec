//! Demonstrates framelock without hardware: a simulated motion PC sends frames over a faulty line.
//!
//! The demonstration runs in virtual time, so the results do not depend on the way in which they are shown. The live
//! view advances in real time, and the plain text is printed without waiting. Both show the same numbers.

mod bytes;
mod demonstration;
mod plain;
mod script;
mod story;
mod view;

use std::io::{BufWriter, Write};
use std::time::{Duration, Instant};

use anyhow::Result;
use ratatui::crossterm::event::{KeyCode, KeyEvent};

use crate::output::Output;
use crate::screen::{self, DRAW_EVERY, Screen, key_within, quits};
use demonstration::Demonstration;

/// Show the story of a lost byte, without hardware. A simulated PC sends a motion seat's position over
/// a faulty line to the lecture's machine and to framelock, each followed by the failsafe.
///
/// The demo has four parts. First the seat stands still, and one lost byte makes the lecture's machine
/// deaf. Then the seat moves, over a line that loses and changes bytes. Then the PC is silent, and the
/// failsafe holds the seat and moves it to the middle. Then the seat moves again. A table of counts
/// ends the demo. On a terminal of at least 80 columns and 23 rows the demo runs live, for 20 seconds.
/// If standard output is not a terminal, it prints text without waiting.
#[derive(clap::Args)]
#[command(after_help = include_str!("help/demo.txt"))]
pub(crate) struct Arguments {}

/// Runs `framelock demo`.
pub(crate) fn run(_: &Arguments) -> Result<()> {
    let mut demonstration = Demonstration::new()?;
    let is_live = screen::is_there();
    if is_live {
        run_live(&mut demonstration)?;
    }
    let mut out = BufWriter::new(Output::standard()?);
    if !is_live {
        plain::run(&mut demonstration, &mut out)?;
    }
    plain::write_summary(&demonstration, &mut out)?;
    Ok(out.flush()?)
}

/// The longest time that the demonstration advances between two drawings. With this limit, a user who suspends and
/// resumes the process misses nothing.
const LONGEST_STEP: Duration = Duration::from_millis(250);

/// Shows the demonstration in real time, until the demonstration is over or the user quits. Restores the
/// terminal afterwards, even after an error or a panic.
fn run_live(demonstration: &mut Demonstration) -> Result<()> {
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
