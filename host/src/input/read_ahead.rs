//! Reading on another thread: ahead of whoever takes the bytes, and so that Ctrl-C can be the end.

use std::io::{self, BufRead, Read};
use std::ops::Range;
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread;

use crate::stream::Chunk;

/// A reader that can be told to end while it waits for input, on every operating system.
///
/// At most two chunks are read ahead.
pub(super) struct ReadAhead {
    events: Receiver<Event>,
    used: Sender<Box<Chunk>>,
    chunk: Box<Chunk>,
    unread: Range<usize>,
    ended: bool,
}

/// What ends the wait for the input.
pub(super) enum Event {
    /// The input gave something.
    Read(Box<Chunk>, io::Result<usize>),
    /// The user had enough.
    End,
}

impl ReadAhead {
    /// Also gives the means to end it.
    pub(super) fn new(mut input: impl Read + Send + 'static) -> (Self, Sender<Event>) {
        let (sender, events) = mpsc::channel();
        let (used, to_fill) = mpsc::channel::<Box<Chunk>>();
        let reader = Self {
            events,
            used,
            chunk: Chunk::new(),
            unread: 0..0,
            ended: false,
        };
        let end = sender.clone();
        for _ in 0..2 {
            reader.give_back(Chunk::new());
        }
        // It ends when the input does or nobody listens any more; if it waits for input then, it
        // waits until the process ends.
        thread::spawn(move || {
            for mut chunk in to_fill {
                let outcome = input.read(&mut chunk.0);
                if sender.send(Event::Read(chunk, outcome)).is_err() {
                    return;
                }
            }
        });
        (reader, end)
    }

    fn give_back(&self, chunk: Box<Chunk>) {
        // The thread is gone if it has read the end.
        let _ = self.used.send(chunk);
    }
}

impl Read for ReadAhead {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.fill_buf()?.read(buffer)?;
        self.consume(count);
        Ok(count)
    }
}

impl BufRead for ReadAhead {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.unread.is_empty() && !self.ended {
            match self.events.recv() {
                Ok(Event::Read(chunk, outcome)) => {
                    let used = std::mem::replace(&mut self.chunk, chunk);
                    self.give_back(used);
                    self.unread = 0..outcome?;
                    self.ended = self.unread.is_empty();
                }
                Ok(Event::End) => self.ended = true,
                Err(_) => return Err(io::Error::other("the thread that reads has failed")),
            }
        }
        Ok(self.chunk.0.get(self.unread.clone()).unwrap_or_default())
    }

    fn consume(&mut self, count: usize) {
        self.unread.start += count;
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use super::*;
    use crate::stream::CHUNK_LENGTH;

    /// Gives what is sent, and waits for more.
    struct Line(Receiver<io::Result<Vec<u8>>>);

    impl Read for Line {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            let bytes = self.0.recv().unwrap_or_else(|_| Ok(Vec::new()))?;
            bytes.as_slice().read(buffer)
        }
    }

    #[test]
    fn reads_to_the_end() {
        const LENGTH: u64 = 3 * CHUNK_LENGTH as u64 + 1;
        let (mut reader, _end) = ReadAhead::new(io::repeat(7).take(LENGTH));
        let mut read = Vec::new();
        reader.read_to_end(&mut read).unwrap();
        assert_eq!(read.len() as u64, LENGTH);
        assert!(read.iter().all(|&byte| byte == 7));
    }

    #[test]
    fn an_end_ends_a_reader_that_waits() {
        let (line, lines) = mpsc::channel();
        let (mut reader, end) = ReadAhead::new(Line(lines));
        line.send(Ok(b"before".to_vec())).unwrap();
        assert_eq!(reader.fill_buf().unwrap(), b"before");
        reader.consume(6);
        end.send(Event::End).unwrap();
        assert_eq!(reader.fill_buf().unwrap(), b"");
        line.send(Ok(b"behind".to_vec())).unwrap();
        assert_eq!(reader.fill_buf().unwrap(), b"");
    }

    #[test]
    fn reading_goes_on_behind_an_error() {
        let (line, lines) = mpsc::channel();
        let (mut reader, _end) = ReadAhead::new(Line(lines));
        line.send(Err(io::ErrorKind::TimedOut.into())).unwrap();
        line.send(Ok(b"behind".to_vec())).unwrap();
        let error = reader.fill_buf().unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::TimedOut);
        assert_eq!(reader.fill_buf().unwrap(), b"behind");
    }
}
