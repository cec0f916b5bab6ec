//! Where the bytes come from: a file, standard input, or a pseudo-terminal.

use std::fs::File;
use std::io::Read;
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};

use anyhow::{Context, Result};

/// What a thread reads, piece by piece.
pub(crate) struct Input {
    pieces: Receiver<std::io::Result<Vec<u8>>>,
    /// Whether they come in real time, so that the emulation must not run ahead.
    pub(crate) is_live: bool,
    pub(crate) has_ended: bool,
}

impl Input {
    /// What `--input` names.
    pub(crate) fn open(name: Option<&str>) -> Result<Self> {
        Ok(match name {
            None => Self::of(std::io::empty(), false),
            Some("-") => Self::of(std::io::stdin(), true),
            #[cfg(unix)]
            Some("pty") => Self::of(pseudo_terminal().context("no pseudo-terminal")?, true),
            Some(path) => {
                let file = File::open(path).with_context(|| format!("cannot read {path}"))?;
                Self::of(file, false)
            }
        })
    }

    fn of(mut from: impl Read + Send + 'static, is_live: bool) -> Self {
        // One piece at a time, so that a sender who is faster than the line has to wait.
        let (to, pieces) = sync_channel(1);
        // It ends with the program: nothing waits for it.
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
        Self {
            pieces,
            is_live,
            has_ended: false,
        }
    }

    /// The next bytes; none at the end, and none if they come live and have not come yet.
    pub(crate) fn next(&mut self) -> Result<Vec<u8>> {
        let received = if self.is_live {
            self.pieces.try_recv()
        } else {
            self.pieces.recv().map_err(|_| TryRecvError::Disconnected)
        };
        let piece = match received {
            Ok(piece) => piece.context("cannot read the input")?,
            Err(TryRecvError::Empty) => return Ok(Vec::new()),
            Err(TryRecvError::Disconnected) => Vec::new(),
        };
        self.has_ended = piece.is_empty();
        Ok(piece)
    }
}

/// The far end of a new pseudo-terminal. Its near end, whose name is printed, can be opened as a
/// serial port.
#[cfg(unix)]
fn pseudo_terminal() -> Result<File> {
    use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};

    let ends = nix::pty::openpty(None, None)?;
    // Bytes as they are: no echo, no lines, no characters that mean something.
    let mut attributes = tcgetattr(&ends.slave)?;
    cfmakeraw(&mut attributes);
    tcsetattr(&ends.slave, SetArg::TCSANOW, &attributes)?;
    let name = nix::unistd::ttyname(&ends.slave)?;
    eprintln!("the board's serial port is {}; Ctrl-C ends", name.display());
    // Held open, so that reading goes on when one writer has gone and until the next comes.
    std::mem::forget(ends.slave);
    Ok(ends.master.into())
}
