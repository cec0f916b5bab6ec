//! Where the bytes come from: all at once, or at a pseudo-terminal as they come.

use std::io::Read;

use anyhow::Context;

/// The bytes to be sent.
pub(crate) enum Input {
    /// All of them.
    Bytes(Vec<u8>),
    /// As they come; in real time.
    #[cfg(unix)]
    Terminal(terminal::Terminal),
}

/// Opens what `--input` names.
pub(crate) fn open(name: Option<&str>) -> anyhow::Result<Input> {
    let mut bytes = Vec::new();
    match name {
        None => {}
        #[cfg(unix)]
        Some("pty") => return Ok(Input::Terminal(terminal::Terminal::open()?)),
        #[cfg(not(unix))]
        Some("pty") => anyhow::bail!("there are no pseudo-terminals here; use a file or -"),
        Some("-") => {
            let read = std::io::stdin().lock().read_to_end(&mut bytes);
            read.context("cannot read standard input")?;
        }
        Some(path) => {
            bytes = std::fs::read(path).with_context(|| format!("cannot read {path}"))?;
        }
    }
    Ok(Input::Bytes(bytes))
}

#[cfg(unix)]
pub(crate) mod terminal {
    //! A pseudo-terminal: its near end is a serial port for whoever opens it.

    use std::fs::File;
    use std::io::{ErrorKind, Read};
    use std::os::fd::OwnedFd;
    use std::sync::mpsc::{Receiver, TryRecvError, channel};

    use anyhow::{Context, bail};
    use rustix::fs::{Mode, OFlags};
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

    /// The far end, and what is written to the near end.
    pub(crate) struct Terminal {
        /// What to open.
        pub(crate) name: String,
        received: Receiver<std::io::Result<Vec<u8>>>,
        /// Held open, so that it goes on when one writer has gone and until the next comes.
        _near_end: OwnedFd,
    }

    impl Terminal {
        pub(crate) fn open() -> anyhow::Result<Self> {
            let no = "cannot open a pseudo-terminal";
            let far_end = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).context(no)?;
            grantpt(&far_end).context(no)?;
            unlockpt(&far_end).context(no)?;
            let name = ptsname(&far_end, Vec::new()).context(no)?;
            let flags = OFlags::RDWR | OFlags::NOCTTY;
            let near_end = rustix::fs::open(name.as_c_str(), flags, Mode::empty()).context(no)?;
            // Bytes as they are: no echo, no lines, no characters that mean something.
            let mut attributes = tcgetattr(&near_end).context(no)?;
            attributes.make_raw();
            tcsetattr(&near_end, OptionalActions::Now, &attributes).context(no)?;
            let (sender, received) = channel();
            let mut far_end = File::from(far_end);
            // It ends with the program: nothing waits for it.
            std::thread::spawn(move || {
                let mut buffer = [0; 4096];
                loop {
                    let read = match far_end.read(&mut buffer) {
                        Ok(count) => Ok(buffer.get(..count).unwrap_or_default().to_owned()),
                        Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                        Err(error) => Err(error),
                    };
                    let failed = read.is_err();
                    if sender.send(read).is_err() || failed {
                        return;
                    }
                }
            });
            Ok(Self {
                name: name.to_string_lossy().into_owned(),
                received,
                _near_end: near_end,
            })
        }

        /// What has come since.
        pub(crate) fn take(&mut self) -> anyhow::Result<Vec<u8>> {
            let mut bytes = Vec::new();
            loop {
                match self.received.try_recv() {
                    Ok(Ok(mut more)) => bytes.append(&mut more),
                    Ok(Err(error)) => bail!("the pseudo-terminal is gone ({error})"),
                    Err(TryRecvError::Empty) => return Ok(bytes),
                    Err(TryRecvError::Disconnected) => bail!("the pseudo-terminal is gone"),
                }
            }
        }
    }
}
