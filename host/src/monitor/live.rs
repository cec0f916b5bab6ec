//! The view on a terminal: bytes come on one thread, keys on another.

use std::sync::mpsc::{self, Receiver, TryRecvError};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Result;
use framelock::{Parser, Setpoint};

use super::session::{Session, meaning};
use super::view;
use crate::input::Input;
use crate::screen::{DRAW_EVERY, Screen, key_within};
use crate::stream::{Failure, for_each_chunk};

/// How much may wait to be watched: enough for a line, and a pipe waits beyond it.
const MOST_WAITING: usize = 64;

/// How long is spent on what waits before keys are looked at again.
const LONGEST_CATCHING_UP: Duration = Duration::from_millis(50);

/// What the thread that reads has to say.
enum Arrival {
    /// Bytes, and when they came.
    Bytes(Instant, Vec<u8>),
    /// No more will come.
    End(Result<(), Failure>),
}

/// Shows the line until somebody ends it or it is cut, which is the inner failure. The terminal is
/// as before afterwards, whatever happens.
pub(super) fn run<P>(session: &mut Session<P>, input: Input) -> Result<Result<(), Failure>>
where
    P: Parser<Message = Setpoint> + Default + Copy,
{
    let mut screen = Screen::take()?;
    let beginning = Instant::now();
    let arrivals = read(input);
    while !screen.is_ended() {
        let now = Instant::now();
        loop {
            match arrivals.try_recv() {
                Ok(Arrival::Bytes(at, bytes)) => {
                    session.receive(at.saturating_duration_since(beginning), &bytes);
                    if now.elapsed() > LONGEST_CATCHING_UP {
                        break;
                    }
                }
                Ok(Arrival::End(Ok(()))) => session.end_of_input(),
                Ok(Arrival::End(Err(failure))) => return Ok(Err(failure)),
                Err(TryRecvError::Empty | TryRecvError::Disconnected) => break,
            }
        }
        // What came behind this time waits for the next round.
        session.advance_to(now.saturating_duration_since(beginning));
        let shown = session.shown();
        screen.draw(|frame| view::draw(frame, shown))?;
        if let Some(key) = key_within(DRAW_EVERY, meaning)?
            && !session.key(key)
        {
            break;
        }
    }
    Ok(Ok(()))
}

/// Reads on a thread of its own, which ends with the process if it waits for input then.
fn read(input: Input) -> Receiver<Arrival> {
    let (sender, arrivals) = mpsc::sync_channel(MOST_WAITING);
    thread::spawn(move || {
        let outcome = for_each_chunk(&mut input.into_reader(), |chunk| {
            // Nobody listens any more once the view is gone.
            let _ = sender.send(Arrival::Bytes(Instant::now(), chunk.to_vec()));
            Ok(())
        });
        let _ = sender.send(Arrival::End(outcome));
    });
    arrivals
}
