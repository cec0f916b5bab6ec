//! Runs the view on a terminal. One thread reads bytes, another reads keys.

use std::sync::mpsc::{self, TryRecvError};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Result;

use super::session::MonitorSession;
use super::view;
use crate::input::{Arrival, Input, for_each_arrival};
use crate::screen::{DRAW_EVERY, Screen, key_within};
use crate::serial::Device;

/// The number of messages that may wait in the channel. It is large enough for a serial line. A program that writes
/// into a pipe faster than the view reads has to wait.
const MOST_WAITING: usize = 64;

/// The longest time for which messages are handled before keys are checked again.
const LONGEST_CATCHING_UP: Duration = Duration::from_millis(50);

/// A message from the thread that reads the input.
enum News {
    Bytes(Vec<u8>),
    Gone(String),
    Back(Device),
    Failed(anyhow::Error),
}

/// Shows the line until the user quits or reading fails. Restores the terminal afterwards, even after
/// an error or a panic.
pub(super) fn run(session: &mut MonitorSession, input: Input<'static>) -> Result<()> {
    let mut screen = Screen::take()?;
    let beginning = Instant::now();
    let (sender, arrivals) = mpsc::sync_channel(MOST_WAITING);
    // If the reading thread still waits for input at the end, it ends with the process.
    thread::spawn(move || {
        // Sending fails after the view is gone. This is not an error.
        let send = |news| drop(sender.send((Instant::now(), news)));
        let outcome = for_each_arrival(input, |arrival| {
            send(match arrival {
                Arrival::Bytes(bytes) => News::Bytes(bytes.to_vec()),
                Arrival::Gone(error) => News::Gone(error.to_string()),
                Arrival::Back(device) => News::Back(device),
            });
            Ok(())
        });
        if let Err(failure) = outcome {
            send(News::Failed(failure));
        }
    });
    while !screen.is_ended() {
        let now = Instant::now();
        while now.elapsed() < LONGEST_CATCHING_UP {
            match arrivals.try_recv() {
                Ok((at, news)) => {
                    let at = at.saturating_duration_since(beginning);
                    match news {
                        News::Bytes(bytes) => session.receive(at, &bytes),
                        News::Gone(why) => session.lose_port(at, &why),
                        News::Back(device) => session.regain_port(device),
                        News::Failed(failure) => return Err(failure),
                    }
                }
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => {
                    session.has_ended = true;
                    break;
                }
            }
        }
        // Later arrivals are handled after the next drawing.
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
