//! Reading messages from anything that implements `embedded-io`'s `Read`, or its async twin's.

use crate::{Line, Parser};

/// Reads messages from `source`, a UART driver for example, through a buffer of `N` bytes.
///
/// Nothing is lost on an error: what was read stays in the buffer, what is held stays held, and
/// the next call goes on where the last one stopped.
///
/// # Examples
/// ```
/// # #[cfg(feature = "embedded-io-v0.7")] {
/// use framelock::motion::{Bin, Setpoint};
/// use framelock::{Reader, Receiver};
/// let uart: &[u8] = b"noiseAB\0abc\rAB\0xyz\rAB";
/// let mut reader = Reader::<_, _, 16>::new(uart, Receiver::<Bin>::new());
/// assert_eq!(reader.read(|setpoint| setpoint), Ok(Some(Setpoint::from(*b"abc"))));
/// assert_eq!(reader.read(|setpoint| setpoint), Ok(Some(Setpoint::from(*b"xyz"))));
/// assert_eq!(reader.read(|setpoint| setpoint), Ok(None));
/// assert_eq!(reader.line().counters().discarded.total(), 5);
/// # }
/// ```
#[derive(Debug)]
pub struct Reader<R, P, const N: usize = 64> {
    source: R,
    line: Line<P>,
    buffer: [u8; N],
    /// The part of the buffer that the parser has not seen: `taken..filled`.
    taken: usize,
    filled: usize,
}

impl<R, P: Parser, const N: usize> Reader<R, P, N> {
    /// A reader that has read nothing. A buffer of no bytes does not compile.
    #[must_use]
    pub fn new(source: R, parser: P) -> Self {
        const { assert!(N > 0, "a reader needs a buffer") };
        Self {
            source,
            line: Line::new(parser),
            buffer: [0; N],
            taken: 0,
            filled: 0,
        }
    }

    /// The line's accounts, for its counters.
    #[must_use]
    pub const fn line(&self) -> &Line<P> {
        &self.line
    }

    /// The line's accounts, to report a line event that the driver told of.
    pub const fn line_mut(&mut self) -> &mut Line<P> {
        &mut self.line
    }

    /// The source; bytes read from it but not yet parsed are lost.
    #[must_use]
    pub fn into_source(self) -> R {
        self.source
    }

    /// What `on` makes of the next message that the buffer completes.
    fn next_in_buffer<T>(&mut self, on: &mut impl FnMut(P::Message<'_>) -> T) -> Option<T> {
        loop {
            if let Some(message) = self.line.poll() {
                return Some(on(message));
            }
            let rest = self.buffer.get(self.taken..self.filled);
            let &byte = rest?.first()?;
            self.taken = self.taken.wrapping_add(1);
            if let Some(message) = self.line.push(byte) {
                return Some(on(message));
            }
        }
    }
}

#[cfg(feature = "embedded-io-v0.7")]
impl<R: embedded_io::Read, P: Parser, const N: usize> Reader<R, P, N> {
    /// Blocks until a message is complete, and gives what `on` makes of it: the message itself, by
    /// `|message| message`, unless it borrows from the receiver's buffer. `None` at the end of the source.
    ///
    /// # Errors
    /// The source's own. Nothing is lost; call again to go on. If the error stands for a line
    /// event, report it to [`line_mut`](Self::line_mut) first.
    pub fn read<T>(
        &mut self,
        mut on: impl FnMut(P::Message<'_>) -> T,
    ) -> Result<Option<T>, R::Error> {
        loop {
            if let Some(made) = self.next_in_buffer(&mut on) {
                return Ok(Some(made));
            }
            (self.taken, self.filled) = (0, self.source.read(&mut self.buffer)?);
            if self.filled == 0 {
                return Ok(None);
            }
        }
    }
}

#[cfg(feature = "embedded-io-async-v0.7")]
impl<R: embedded_io_async::Read, P: Parser, const N: usize> Reader<R, P, N> {
    /// Waits until a message is complete, and gives what `on` makes of it, as the blocking `read` does. May be
    /// cancelled wherever the source's own `read` may.
    ///
    /// # Errors
    /// The source's own, as of the blocking `read`.
    pub async fn read_async<T>(
        &mut self,
        mut on: impl FnMut(P::Message<'_>) -> T,
    ) -> Result<Option<T>, R::Error> {
        loop {
            if let Some(made) = self.next_in_buffer(&mut on) {
                return Ok(Some(made));
            }
            (self.taken, self.filled) = (0, self.source.read(&mut self.buffer).await?);
            if self.filled == 0 {
                return Ok(None);
            }
        }
    }
}
