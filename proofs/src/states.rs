//! Arbitrary starting points for harnesses: histories of a stream, states of machines, and setpoints.

use framelock::any_format::part;
use framelock::lecture::{Lecture, State};
use framelock::motion::Setpoint;
use framelock::{FixedFormat, FrameBytes, Parser, Receiver};

/// The end of a stream. `last` holds the stream's last bytes, as many as a frame has, the newest one last. `since` is
/// the number of these bytes that came after the last delivered frame. (The receiver's state is the same whether all of
/// these bytes came after the frame, or all except the first.)
#[derive(Clone, Copy)]
pub(crate) struct History<const N: usize> {
    pub(crate) last: [u8; N],
    pub(crate) since: u8,
}

impl<const N: usize> History<N> {
    pub(crate) fn any() -> Self {
        Self {
            last: kani::any(),
            since: kani::any_where(|&since| usize::from(since) <= N),
        }
    }

    /// Appends a byte to the stream.
    pub(crate) fn then(mut self, byte: u8, committed: bool) -> Self {
        let mut place = 1;
        while place < N {
            self.last[place - 1] = self.last[place];
            place += 1;
        }
        self.last[N - 1] = byte;
        if committed {
            self.since = 0;
        } else if usize::from(self.since) < N {
            self.since += 1;
        }
        self
    }

    /// Returns the receiver after this stream. A delivered frame leaves the receiver in its state at reset. Let `N` be
    /// a frame's length. Only the last `N - 1` bytes after the delivered frame matter (`commits` in the engine's
    /// proofs).
    ///
    /// Either `push` or `push_with` has taken the last byte. Earlier calls make no difference, because only the last
    /// call decides whether the receiver's state has a note about the pending bytes (`one_byte` in the engine's
    /// proofs).
    pub(crate) fn receiver<F: FixedFormat<Frame = [u8; N]>>(&self) -> Receiver<F>
    where
        [u8; N]: FrameBytes,
    {
        let count = usize::from(self.since).min(N - 1);
        Receiver::holding(&self.last, count, kani::any())
    }
}

/// Returns a receiver in any state to which some stream leads.
pub(crate) fn any_receiver<F: FixedFormat<Frame = [u8; N]>, const N: usize>() -> Receiver<F>
where
    [u8; N]: FrameBytes,
{
    History::<N>::any().receiver()
}

/// Returns the lecture's machine in any state. Every value of the type is a reachable state.
pub(crate) fn any_lecture() -> Lecture {
    let state: usize = kani::any_where(|&state| state < State::ALL.len());
    Lecture {
        state: State::ALL[state],
        temp: any_setpoint(),
    }
}

pub(crate) fn any_setpoint() -> Setpoint {
    kani::any::<[u8; 3]>().into()
}

/// Returns whether seven bytes are a frame of BIN (F1).
pub(crate) fn is_bin(frame: [u8; 7]) -> bool {
    frame[0] == b'A' && frame[1] == b'B' && frame[6] == b'\r'
}

/// Returns whether eight bytes are a frame of BIN-CRC8 (F2).
pub(crate) fn is_bin_crc8(frame: [u8; 8]) -> bool {
    frame[0] == b'A'
        && frame[1] == b'B'
        && frame[6] == crate::reference::crc8(part(&frame, 2, 6))
        && frame[7] == b'\r'
}

/// A machine whose messages are setpoints.
pub(crate) trait OfSetpoints:
    for<'a> Parser<Message<'a> = Setpoint> + Copy + PartialEq + 'static
{
    /// The number of bytes in each frame of the machine.
    const LENGTH: usize;
}

impl OfSetpoints for Lecture {
    const LENGTH: usize = 7;
}

impl<F: FixedFormat<Message = Setpoint>> OfSetpoints for Receiver<F> {
    const LENGTH: usize = F::Frame::LENGTH;
}

/// Reads the setpoint from a frame of BIN or BIN-CRC8.
pub(crate) fn setpoint_of<const N: usize>(frame: [u8; N]) -> Setpoint {
    [frame[3], frame[4], frame[5]].into()
}

/// Pushes a frame. Returns how many frames were delivered before the pushed frame's last byte, and
/// the setpoint delivered with this byte.
pub(crate) fn receive<P: OfSetpoints, const N: usize>(
    parser: &mut P,
    frame: [u8; N],
) -> (u8, Option<Setpoint>) {
    let mut before = 0;
    let mut place = 0;
    while place < N - 1 {
        before += u8::from(parser.push(frame[place]).is_some());
        place += 1;
    }
    (before, parser.push(frame[N - 1]))
}
