//! A reader of messages from any source that implements `Read` of `embedded-io` or `embedded-io-async`.

#[cfg(feature = "embedded-io-async-v0.7")]
use core::{future::poll_fn, pin::pin, task::Poll};

#[cfg(feature = "embedded-io-async-v0.7")]
use crate::LineEvent;
use crate::{Line, Parser};

/// Reads messages from `source`, for example a UART driver, through a buffer of `N` bytes.
///
/// No byte is lost if `source` returns an error: the reader has already parsed all earlier bytes, and pending bytes
/// stay pending. The next call continues with the next byte.
///
/// # Examples
/// ```
/// # #[cfg(feature = "embedded-io-v0.7")] {
/// use framelock::motion::{Bin, Setpoint};
/// use framelock::{Reader, Receiver};
/// let uart: &[u8] = b"noiseAB\0abc\rAB\0xyz\rAB";
/// let mut reader = Reader::<_, _, 16>::new(uart, Receiver::<Bin>::new());
/// assert_eq!(reader.next_message(), Ok(Some(Setpoint::from(*b"abc"))));
/// assert_eq!(reader.next_message(), Ok(Some(Setpoint::from(*b"xyz"))));
/// assert_eq!(reader.next_message(), Ok(None));
/// assert_eq!(reader.line().counters().discarded.total(), 5);
/// # }
/// ```
///
/// Async, in any executor:
/// ```
/// # #[cfg(feature = "embedded-io-async-v0.7")] {
/// use embedded_io_async::Read;
/// use framelock::motion::{Bin, Setpoint};
/// use framelock::{LineEvent, Reader, Receiver};
///
/// async fn receive(uart: impl Read, mut actuate: impl FnMut(Setpoint)) {
///     let mut reader = Reader::<_, _, 16>::new(uart, Receiver::<Bin>::new());
///     loop {
///         match reader.next_message_async().await {
///             Ok(Some(setpoint)) => actuate(setpoint),
///             Ok(None) => return, // The end of the source.
///             Err(_) => reader.line_mut().event(LineEvent::Overrun),
///         }
///     }
/// }
///
/// let (uart, mut received) = (&b"noiseAB\0abc\rAB\0xyz\rAB"[..], Vec::new());
/// let receiving = receive(uart, |setpoint| received.push(setpoint));
/// // This source never waits, so one poll takes the place of an executor.
/// # use std::{pin::pin, task::{Context, Waker}};
/// assert!(pin!(receiving).poll(&mut Context::from_waker(Waker::noop())).is_ready());
/// assert_eq!(received, [Setpoint::from(*b"abc"), Setpoint::from(*b"xyz")]);
/// # }
/// ```
#[derive(Debug)]
pub struct Reader<R, P, const N: usize = 64> {
    source: R,
    line: Line<P>,
    buffer: [u8; N],
    /// The part of the buffer that the parser has not taken yet: `taken..filled`.
    taken: usize,
    filled: usize,
    /// Whether the line event of a pause needs another step.
    #[cfg(feature = "embedded-io-async-v0.7")]
    in_pause: bool,
}

impl<R, P: Parser, const N: usize> Reader<R, P, N> {
    /// Creates a reader that has read nothing. A buffer of zero bytes does not compile:
    /// ```compile_fail,E0080
    /// use framelock::{Reader, Receiver, motion::Bin};
    /// let reader = Reader::<_, _, 0>::new(&b"AB"[..], Receiver::<Bin>::new());
    /// ```
    #[must_use]
    pub fn new(source: R, parser: P) -> Self {
        const { assert!(N > 0, "a reader needs a buffer") };
        Self {
            source,
            line: Line::new(parser),
            buffer: [0; N],
            taken: 0,
            filled: 0,
            #[cfg(feature = "embedded-io-async-v0.7")]
            in_pause: false,
        }
    }

    /// Returns the line, for its counters.
    #[must_use]
    pub const fn line(&self) -> &Line<P> {
        &self.line
    }

    /// Returns the line, for reporting a line event that the driver has noticed.
    pub const fn line_mut(&mut self) -> &mut Line<P> {
        &mut self.line
    }

    /// Returns the source. Loses the bytes that the reader has read from the source but has not parsed yet.
    #[must_use]
    pub fn into_source(self) -> R {
        self.source
    }

    /// Empties the buffer for the next read. If the program cancels this read, the reader must not parse the buffer's
    /// old bytes again.
    fn empty_buffer(&mut self) -> (&mut R, &mut [u8; N]) {
        (self.taken, self.filled) = (0, 0);
        (&mut self.source, &mut self.buffer)
    }

    /// Takes the number of bytes that a read has put into the buffer. Returns whether the source has ended.
    fn is_ended_by_read(&mut self, count: usize) -> bool {
        // A faulty driver may return a number that is greater than the buffer's size.
        self.filled = count.min(N);
        count == 0
    }

    /// Calls `on` with the next message that the buffer completes, and returns the result of `on`.
    fn next_in_buffer<T>(&mut self, on: &mut impl FnMut(P::Message<'_>) -> T) -> Option<T> {
        let mut rest = self.buffer.get(self.taken..self.filled)?;
        let message = self.line.next(&mut rest);
        self.taken = self.filled.wrapping_sub(rest.len());
        message.map(on)
    }
}

#[cfg(kani)]
impl<R, P, const N: usize> Reader<R, P, N> {
    /// Creates a reader that has not taken `buffer[taken..filled]` yet.
    pub const fn in_state(
        source: R,
        line: Line<P>,
        buffer: [u8; N],
        [taken, filled]: [usize; 2],
    ) -> Self {
        Self {
            source,
            line,
            buffer,
            taken,
            filled,
            #[cfg(feature = "embedded-io-async-v0.7")]
            in_pause: false,
        }
    }

    /// Returns `taken` and `filled`.
    pub const fn state(&self) -> [usize; 2] {
        [self.taken, self.filled]
    }
}

#[cfg(feature = "embedded-io-v0.7")]
impl<R: embedded_io::Read, P: Parser, const N: usize> Reader<R, P, N> {
    /// Blocks until a message is complete, and returns it. Returns `None` at the end of the source.
    ///
    /// Use this for messages that own their data. For messages that borrow from the receiver, use
    /// [`next_message_with`](Self::next_message_with).
    ///
    /// # Errors
    /// Returns the source's error. No byte is lost: call again to continue. If the error means that a line event
    /// occurred, report the event to [`line_mut`](Self::line_mut) before the next call.
    pub fn next_message<M>(&mut self) -> Result<Option<M>, R::Error>
    where
        P: for<'a> Parser<Message<'a> = M> + 'static,
    {
        self.next_message_with(|message| message)
    }

    /// Blocks until a message is complete, calls `on` with it, and returns the result of `on`. Returns `None` at the
    /// end of the source.
    ///
    /// # Errors
    /// See [`next_message`](Self::next_message).
    pub fn next_message_with<T>(
        &mut self,
        mut on: impl FnMut(P::Message<'_>) -> T,
    ) -> Result<Option<T>, R::Error> {
        loop {
            if let Some(made) = self.next_in_buffer(&mut on) {
                return Ok(Some(made));
            }
            let (source, buffer) = self.empty_buffer();
            let count = source.read(buffer)?;
            if self.is_ended_by_read(count) {
                return Ok(None);
            }
        }
    }
}

#[cfg(feature = "embedded-io-async-v0.7")]
impl<R: embedded_io_async::Read, P: Parser, const N: usize> Reader<R, P, N> {
    /// Waits until a message is complete, and returns it. Returns `None` at the end of the source.
    ///
    /// Use this for messages that own their data. For messages that borrow from the receiver, use
    /// [`next_message_async_with`](Self::next_message_async_with). Cancelling the future loses no byte if cancelling
    /// the source's `read` loses none.
    ///
    /// # Errors
    /// Returns the source's error. No byte is lost: call again to continue. If the error means that a line event
    /// occurred, report the event to [`line_mut`](Self::line_mut) before the next call.
    pub async fn next_message_async<M>(&mut self) -> Result<Option<M>, R::Error>
    where
        P: for<'a> Parser<Message<'a> = M> + 'static,
    {
        self.next_message_async_with(|message| message).await
    }

    /// Waits until a message is complete, calls `on` with it, and returns the result of `on`. Returns `None` at the end
    /// of the source.
    /// # Errors
    /// See [`next_message_async`](Self::next_message_async).
    pub async fn next_message_async_with<T>(
        &mut self,
        mut on: impl FnMut(P::Message<'_>) -> T,
    ) -> Result<Option<T>, R::Error> {
        loop {
            if let Some(made) = self.next_in_buffer(&mut on) {
                return Ok(Some(made));
            }
            let (source, buffer) = self.empty_buffer();
            let count = source.read(buffer).await?;
            if self.is_ended_by_read(count) {
                return Ok(None);
            }
        }
    }

    /// Does the same as [`next_message_async_with`](Self::next_message_async_with), and reports pauses. While an
    /// incomplete frame is pending, each read must end before the future that `silence` returns ends. Otherwise the
    /// line is idle: the reader reports [`LineEvent::Idle`], and returns the whole frames among the pending bytes, one
    /// in each call.
    ///
    /// `silence` returns a future that ends after the duration of a pause. In Embassy, for example, pass
    /// `|| Timer::after_millis(5)`. The reader drops the source's `read` at a pause, so dropping a `read` must lose no
    /// byte. Use no other function for reading: after a pause, only this function continues the line event.
    ///
    /// # Errors
    /// See [`next_message_async`](Self::next_message_async).
    ///
    /// # Examples
    /// ```
    /// use framelock::motion::{Bin, Setpoint};
    /// use framelock::{Reader, Receiver};
    /// # use std::{future::{pending, ready}, pin::pin, task::{Context, Poll, Waker}};
    /// # struct Uart(Vec<&'static [u8]>);
    /// # impl embedded_io_async::ErrorType for Uart { type Error = embedded_io_async::ErrorKind; }
    /// # impl embedded_io_async::Read for Uart {
    /// #     async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Self::Error> {
    /// #         match self.0.remove(0) {
    /// #             [] => pending().await,
    /// #             bytes => { buffer[..bytes.len()].copy_from_slice(bytes); Ok(bytes.len()) }
    /// #         }
    /// #     }
    /// # }
    /// # /// Ends at once: in this example each read that has to wait is a pause.
    /// # fn silence() -> impl Future<Output = ()> { ready(()) }
    /// // The beginning of a frame that has lost its end, then a pause, then a whole frame.
    /// let uart = Uart(vec![b"AB\0ab", b"", b"AB\0xyz\r"]);
    /// let mut reader = Reader::<_, _, 16>::new(uart, Receiver::<Bin>::new());
    /// let next = reader.next_message_or_pause(silence, |setpoint| setpoint);
    /// let setpoint = pin!(next).poll(&mut Context::from_waker(Waker::noop()));
    /// assert_eq!(setpoint, Poll::Ready(Ok(Some(Setpoint::from(*b"xyz")))));
    /// assert_eq!(reader.line().counters().events.idle, 1);
    /// ```
    pub async fn next_message_or_pause<S: Future<Output = ()>, T>(
        &mut self,
        mut silence: impl FnMut() -> S,
        mut on: impl FnMut(P::Message<'_>) -> T,
    ) -> Result<Option<T>, R::Error> {
        // A delimiter before a packet stays pending in a pause, so the same pause must not be reported again.
        let mut was_reported = false;
        loop {
            while self.in_pause {
                let mut made = None;
                self.in_pause = self.line.line_event_step(LineEvent::Idle, |found| {
                    if let Some(message) = found.message() {
                        made = Some(on(message));
                    }
                });
                if made.is_some() {
                    return Ok(made);
                }
            }
            if let Some(made) = self.next_in_buffer(&mut on) {
                return Ok(Some(made));
            }
            let is_pending = self.line.pending() > 0 && !was_reported;
            let (source, buffer) = self.empty_buffer();
            let read = source.read(buffer);
            let count = if is_pending {
                within(silence(), read).await
            } else {
                Some(read.await)
            };
            (self.in_pause, was_reported) = (count.is_none(), count.is_none());
            if let Some(count) = count {
                if self.is_ended_by_read(count?) {
                    return Ok(None);
                }
            }
        }
    }
}

/// Returns the output of `work`, or `None` if the `limit` ends first. Then drops `work`.
#[cfg(feature = "embedded-io-async-v0.7")]
async fn within<T>(limit: impl Future<Output = ()>, work: impl Future<Output = T>) -> Option<T> {
    let (mut limit, mut work) = (pin!(limit), pin!(work));
    poll_fn(|context| match work.as_mut().poll(context) {
        Poll::Ready(output) => Poll::Ready(Some(output)),
        Poll::Pending => limit.as_mut().poll(context).map(|()| None),
    })
    .await
}
