//! The view on a terminal: bytes come on one thread, keys on another.

use std::sync::mpsc::{self, TryRecvError};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Result;

use super::session::Session;
use super::view;
use crate::input::{Input, for_each_chunk};
use crate::screen::{DRAW_EVERY, Screen, key_within};

/// How much may wait to be watched: enough for a line, and a pipe waits beyond it.
const MOST_WAITING: usize = 64;

/// How long is spent on what waits before keys are looked at again.
const LONGEST_CATCHING_UP: Duration = Duration::from_millis(50);

/// Shows the line until the user ends it or it is cut. The terminal is as before afterwards,
/// whatever happens.
pub(super) fn run(session: &mut Session, input: Input<'static>) -> Result<()> {
    let mut screen = Screen::take()?;
    let beginning = Instant::now();
    let (sender, arrivals) = mpsc::sync_channel(MOST_WAITING);
    // It ends with the process if it waits for input then.
    thread::spawn(move || {
        // Once the view is gone nothing receives it.
        let send = |arrival| drop(sender.send((Instant::now(), arrival)));
        let outcome = for_each_chunk(input, |chunk| {
            send(Ok(chunk.to_vec()));
            Ok(())
        });
        if let Err(failure) = outcome {
            send(Err(failure));
        }
    });
    while !screen.is_ended() {
        let now = Instant::now();
        while now.elapsed() < LONGEST_CATCHING_UP {
            match arrivals.try_recv() {
                Ok((at, Ok(bytes))) => {
                    session.receive(at.saturating_duration_since(beginning), &bytes);
                }
                Ok((_, Err(failure))) => return Err(failure),
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => {
                    session.has_ended = true;
                    break;
                }
            }
        }
        // What came behind this time waits for the next round.
        session.advance_to(now.saturating_duration_since(beginning));
        screen.draw(|frame| view::draw(frame, session))?;
        if let Some(key) = key_within(DRAW_EVERY)?
            && !session.key(key)
        {
            break;
        }
    }
    Ok(())
}
