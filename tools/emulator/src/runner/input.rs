//! The source of the bytes: a file, standard input, or a pseudo-terminal.

use std::fs::File;
use std::io::Read;
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};

use anyhow::{Context, Result};

/// The input, which a thread reads piece by piece.
pub(crate) struct Input {
    pieces: Receiver<std::io::Result<Vec<u8>>>,
    /// Whether the bytes come in real time, so that the emulation must not run ahead.
    pub(crate) is_live: bool,
    pub(crate) has_ended: bool,
}

impl Input {
    /// Opens the input that `--input` names.
    pub(crate) fn open(name: Option<&str>) -> Result<Self> {
        let (mut from, is_live): (Box<dyn Read + Send>, bool) = match name {
            None => (Box::new(std::io::empty()), false),
            Some("-") => (Box::new(std::io::stdin()), true),
            #[cfg(unix)]
            Some("pty") => (
                Box::new(pseudo_terminal().context("no pseudo-terminal")?),
                true,
            ),
            Some(path) => {
                let file = File::open(path).with_context(|| format!("cannot read {path}"))?;
                (Box::new(file), false)
            }
        };
        // The channel holds one piece, so that a sender that is faster than the line has to wait.
        let (to, pieces) = sync_channel(1);
        // No code joins this thread. It ends with the program.
        std::thread::spawn(move || {
            let mut buffer = [0; 4096];
            loop {
                let read = from.read(&mut buffer);
                let is_last = !matches!(read, Ok(1..));
                let piece = read.map(|count| buffer.iter().copied().take(count).collect());
                if to.send(piece).is_err() || is_last {
                    return;
                }
            }
        });
        Ok(Self {
            pieces,
            is_live,
            has_ended: false,
        })
    }

    /// Returns the next bytes. Returns no bytes at the end, or if the input is live and none have arrived yet.
    pub(crate) fn next(&mut self) -> Result<Vec<u8>> {
        let piece = match self.pieces.try_recv() {
            Ok(piece) => piece,
            Err(TryRecvError::Empty) if self.is_live => return Ok(Vec::new()),
            // The thread sends an empty piece before it ends.
            Err(_) => self.pieces.recv()?,
        };
        let piece = piece.context("cannot read the input")?;
        self.has_ended = piece.is_empty();
        Ok(piece)
    }
}

/// Opens a new pseudo-terminal and returns its far end. Prints the name of its near end, which can
/// be opened as a serial port.
#[cfg(unix)]
fn pseudo_terminal() -> Result<File> {
    use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};

    let ends = nix::pty::openpty(None, None)?;
    // Pass bytes unchanged: no echo, no line editing, no control characters.
    let mut attributes = tcgetattr(&ends.slave)?;
    cfmakeraw(&mut attributes);
    tcsetattr(&ends.slave, SetArg::TCSANOW, &attributes)?;
    let name = nix::unistd::ttyname(&ends.slave)?;
    eprintln!("the board's serial port is {}; Ctrl-C ends", name.display());
    // Keep the near end open in this program. Otherwise reading would end when a writer closes the near end, before the
    // next writer opens it.
    std::mem::forget(ends.slave);
    Ok(ends.master.into())
}
