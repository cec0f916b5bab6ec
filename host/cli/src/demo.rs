//! Demonstrates framelock without hardware: a simulated motion PC sends frames over a faulty line.
//!
//! The demonstration follows a story, which is data and runs in virtual time. On a terminal that is large enough and
//! has colours, the picture is repainted in real time. Otherwise the picture is printed at the end of each part.

mod picture;
mod story;

use std::io::{self, BufWriter, IsTerminal, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use terminal_size::terminal_size;

use crate::output::Output;
use story::{END, STORY, Story};

/// Show the story of a lost byte, without hardware. A simulated PC sends a motion seat's position over
/// a faulty line to the lecture's machine and to framelock, each followed by the failsafe.
///
/// First the seat stands still, and one lost byte makes the lecture's machine deaf. Then the seat
/// moves, over a line that loses and changes bytes. Then the PC is silent, and the failsafe holds the
/// seat and moves it to the middle. Then the seat moves again. On a terminal of at least 80 columns
/// and 23 rows the demo runs live, for 20 seconds. Otherwise it prints the picture at the end of each
/// part, without waiting.
#[derive(clap::Args)]
#[command(after_help = include_str!("help/demo.txt"))]
pub(crate) struct Arguments {}

/// The time between two drawings, for about thirty drawings per second.
const DRAW_EVERY: Duration = Duration::from_millis(33);

/// The longest time that the story advances between two drawings. With this limit, a user who suspends and resumes the
/// process misses nothing.
const LONGEST_STEP: Duration = Duration::from_millis(250);

/// Runs `framelock demo`.
pub(crate) fn run(_: &Arguments) -> Result<()> {
    let mut story = Story::new()?;
    let is_live = can_run_live();
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

/// Returns whether standard output is a terminal with colours on which the picture fits.
fn can_run_live() -> bool {
    // On Windows, a terminal takes escape sequences only if the program asks for them.
    anstyle_query::windows::enable_ansi_colors();
    io::stdout().is_terminal()
        && anstyle_query::term_supports_ansi_color()
        && terminal_size().is_some_and(|(width, height)| width.0 >= 80 && height.0 >= 23)
}

/// Shows the story in real time, until it is over or a signal ends it.
fn run_live(story: &mut Story) -> Result<()> {
    let is_ended = Arc::new(AtomicBool::new(false));
    let end = Arc::clone(&is_ended);
    ctrlc::set_handler(move || end.store(true, Ordering::Relaxed))
        .context("cannot watch for Ctrl-C")?;
    let mut screen = Screen::take()?;
    let mut drawn_at = Instant::now();
    while story.time < END && !is_ended.load(Ordering::Relaxed) {
        screen.draw(&picture::painted(story))?;
        sleep(DRAW_EVERY);
        let elapsed = drawn_at.elapsed();
        drawn_at += elapsed;
        story.advance_to(story.time + elapsed.min(LONGEST_STEP));
    }
    Ok(())
}

/// The terminal's alternate screen, without the cursor. Dropping this value restores the terminal, also after a panic.
struct Screen(io::Stdout);

impl Screen {
    fn take() -> io::Result<Self> {
        let mut screen = Self(io::stdout());
        screen.0.write_all(b"\x1B[?1049h\x1B[?25l")?;
        Ok(screen)
    }

    /// Draws the lines over the previous ones.
    fn draw(&mut self, lines: &[String]) -> io::Result<()> {
        let text = lines.join("\x1B[K\r\n");
        write!(self.0, "\x1B[H{text}\x1B[J")?;
        self.0.flush()
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        // The terminal may be gone.
        let _ = self.0.write_all(b"\x1B[?25h\x1B[?1049l");
        let _ = self.0.flush();
    }
}
