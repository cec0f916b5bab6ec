//! Demonstrates framelock without hardware: a simulated motion PC sends frames over a faulty line.
//!
//! The story is data, and it runs in virtual time. The live view repaints the picture in real time. Without a terminal,
//! the picture is printed at the end of each part.

mod picture;
mod story;

use std::io::{BufWriter, Write};
use std::time::{Duration, Instant};

use anyhow::Result;
use ratatui::crossterm::event::{KeyCode, KeyEvent};

use crate::output::Output;
use crate::screen::{self, DRAW_EVERY, Screen, key_within, quits};
use story::{END, STORY, Story};

/// Show the story of a lost byte, without hardware. A simulated PC sends a motion seat's position over
/// a faulty line to the lecture's machine and to framelock, each followed by the failsafe.
///
/// First the seat stands still, and one lost byte makes the lecture's machine deaf. Then the seat
/// moves, over a line that loses and changes bytes. Then the PC is silent, and the failsafe holds the
/// seat and moves it to the middle. Then the seat moves again. On a terminal of at least 80 columns
/// and 23 rows the demo runs live, for 20 seconds. If standard output is not a terminal, it prints the
/// picture at the end of each part, without waiting.
#[derive(clap::Args)]
#[command(after_help = include_str!("help/demo.txt"))]
pub(crate) struct Arguments {}

/// Runs `framelock demo`.
pub(crate) fn run(_: &Arguments) -> Result<()> {
    let mut story = Story::new()?;
    let is_live = screen::is_there();
    if is_live {
        run_live(&mut story)?;
    }
    let mut out = BufWriter::new(Output::standard()?);
    if is_live {
        picture::write(&story, &mut out)?;
    } else {
        let mut end = Duration::ZERO;
        for part in &STORY {
            end += part.length();
            story.advance_to(end);
            picture::write(&story, &mut out)?;
        }
    }
    picture::write_conclusion(&story, &mut out)?;
    Ok(out.flush()?)
}

/// The longest time that the story advances between two drawings. With this limit, a user who suspends and resumes the
/// process misses nothing.
const LONGEST_STEP: Duration = Duration::from_millis(250);

/// Shows the story in real time, until it is over or the user quits. Restores the terminal afterwards, even after an
/// error or a panic.
fn run_live(story: &mut Story) -> Result<()> {
    let mut screen = Screen::take()?;
    let mut drawn_at = Instant::now();
    let (mut is_paused, mut has_room) = (false, true);
    while story.time < END && !screen.is_ended() {
        screen.draw(|frame| has_room = picture::draw(frame, story, is_paused))?;
        if let Some(key) = key_within(DRAW_EVERY)?
            && !handle_key(key, &mut is_paused)
        {
            break;
        }
        let elapsed = drawn_at.elapsed();
        drawn_at += elapsed;
        if !is_paused && has_room {
            story.advance_to(story.time + elapsed.min(LONGEST_STEP));
        }
    }
    Ok(())
}

/// Handles a key, which may pause or resume. Returns false if the key quits.
fn handle_key(key: KeyEvent, is_paused: &mut bool) -> bool {
    *is_paused ^= key.code == KeyCode::Char(' ');
    !quits(key)
}

#[cfg(test)]
mod tests {
    use ratatui::crossterm::event::KeyModifiers;

    use super::*;

    #[test]
    fn keys_mean_what_the_view_says() {
        let none = KeyModifiers::NONE;
        let mut is_paused = false;
        for (code, modifiers, goes_on, pauses) in [
            (KeyCode::Char('c'), none, true, false),
            (KeyCode::Char(' '), none, true, true),
            (KeyCode::Char(' '), none, true, false),
            (KeyCode::Char('q'), none, false, false),
            (KeyCode::Esc, none, false, false),
            (KeyCode::Char('c'), KeyModifiers::CONTROL, false, false),
        ] {
            let outcome = handle_key(KeyEvent::new(code, modifiers), &mut is_paused);
            assert_eq!((outcome, is_paused), (goes_on, pauses), "{code}");
        }
    }
}
