//! The receivers, their line events and their counters.

use core::mem::MaybeUninit;

use framelock::motion::{Bin, BinCrc8, Setpoint};
use framelock::{Counters, FixedFormat, Line, LineEvent, Receiver};

use crate::framelock_setpoint;
use crate::memory::{Content, Memory};

/// A receiver of BIN frames: 'A' 'B' reserved pitch roll yaw CR.
#[repr(C)]
pub struct framelock_receiver {
    aligned: MaybeUninit<u64>,
    opaque: [MaybeUninit<usize>; 18],
}

impl Memory for framelock_receiver {
    type Value = Line<Receiver<Bin>>;
}

/// A receiver of BIN-CRC8 frames: 'A' 'B' reserved pitch roll yaw crc CR.
#[repr(C)]
pub struct framelock_crc8_receiver {
    aligned: MaybeUninit<u64>,
    opaque: [MaybeUninit<usize>; 18],
}

impl Memory for framelock_crc8_receiver {
    type Value = Line<Receiver<BinCrc8>>;
}

/// Where each byte went, and how often things happened. The counters wrap.
///
/// At any time `bytes` is `frame_bytes`, all of `discarded_...` and `pending` together.
#[repr(C)]
pub struct framelock_counters {
    /// Bytes received.
    pub bytes: usize,
    /// Frames committed.
    pub frames: usize,
    /// Bytes in them.
    pub frame_bytes: usize,
    /// Bytes discarded because no frame begins with them.
    pub discarded_no_sync: usize,
    /// Bytes discarded because an 'A' was not followed by a 'B'.
    pub discarded_broken_sync: usize,
    /// Bytes discarded because there was no CR where it was due.
    pub discarded_terminator: usize,
    /// Bytes discarded because the checksum was wrong.
    pub discarded_check: usize,
    /// Bytes that were pending when a line event came.
    pub discarded_line_event: usize,
    /// Bytes that may yet be part of a frame.
    pub pending: usize,
    /// Frames that ended a loss: the first one after bytes were discarded.
    pub resynchronisations: usize,
    /// How often `FRAMELOCK_FRAMING_ERROR` was reported.
    pub framing_errors: usize,
    /// How often `FRAMELOCK_PARITY_ERROR` was reported.
    pub parity_errors: usize,
    /// How often `FRAMELOCK_OVERRUN` was reported.
    pub overruns: usize,
    /// How often `FRAMELOCK_BREAK` was reported.
    pub breaks: usize,
    /// How often `FRAMELOCK_IDLE_LINE` was reported.
    pub idle_lines: usize,
}

impl framelock_counters {
    fn new(counters: &Counters, pending: usize) -> Self {
        let Counters {
            discarded, events, ..
        } = counters;
        Self {
            bytes: counters.bytes,
            frames: counters.frames,
            frame_bytes: counters.frame_bytes,
            discarded_no_sync: discarded.no_sync,
            discarded_broken_sync: discarded.broken_sync,
            discarded_terminator: discarded.terminator,
            discarded_check: discarded.check,
            discarded_line_event: discarded.line_event,
            pending,
            resynchronisations: counters.resynchronisations,
            framing_errors: events.framing,
            parity_errors: events.parity,
            overruns: events.overrun,
            breaks: events.line_break,
            idle_lines: events.idle,
        }
    }
}

/// Something that the UART or a timer noticed: one of the constants below. Any other is ignored.
pub type framelock_line_event = u8;
/// No stop bit where one was due: noise, or a wrong baud rate.
pub const FRAMELOCK_FRAMING_ERROR: framelock_line_event = 0;
/// A parity error.
pub const FRAMELOCK_PARITY_ERROR: framelock_line_event = 1;
/// Bytes were lost because nobody fetched them in time.
pub const FRAMELOCK_OVERRUN: framelock_line_event = 2;
/// The line was held low for longer than a byte.
pub const FRAMELOCK_BREAK: framelock_line_event = 3;
/// No byte for longer than the sender leaves between the bytes of a frame.
pub const FRAMELOCK_IDLE_LINE: framelock_line_event = 4;

/// Begins to receive. All counters are 0.
#[unsafe(no_mangle)]
pub extern "C" fn framelock_receiver_init(receiver: Option<&mut MaybeUninit<framelock_receiver>>) {
    init(receiver);
}

/// Takes the next byte. If it completes a frame, writes its setpoint and returns true. If not, leaves
/// `setpoint` as it is and returns false.
#[unsafe(no_mangle)]
pub extern "C" fn framelock_receiver_push(
    receiver: Option<&mut framelock_receiver>,
    byte: u8,
    setpoint: Option<&mut MaybeUninit<framelock_setpoint>>,
) -> bool {
    push(receiver, byte, setpoint)
}

/// Drops what is pending, so that no frame has bytes from before the event, and counts it. Do not push a
/// byte that is known to be bad: report the event in its place.
#[unsafe(no_mangle)]
pub extern "C" fn framelock_receiver_line_event(
    receiver: Option<&mut framelock_receiver>,
    event: framelock_line_event,
) {
    line_event(receiver, event);
}

/// Writes the counters and returns true; or false if there are none.
#[unsafe(no_mangle)]
pub extern "C" fn framelock_receiver_counters(
    receiver: Option<&framelock_receiver>,
    counters: Option<&mut MaybeUninit<framelock_counters>>,
) -> bool {
    count(receiver, counters)
}

/// As `framelock_receiver_init`.
#[unsafe(no_mangle)]
pub extern "C" fn framelock_crc8_receiver_init(
    receiver: Option<&mut MaybeUninit<framelock_crc8_receiver>>,
) {
    init(receiver);
}

/// As `framelock_receiver_push`.
#[unsafe(no_mangle)]
pub extern "C" fn framelock_crc8_receiver_push(
    receiver: Option<&mut framelock_crc8_receiver>,
    byte: u8,
    setpoint: Option<&mut MaybeUninit<framelock_setpoint>>,
) -> bool {
    push(receiver, byte, setpoint)
}

/// As `framelock_receiver_line_event`.
#[unsafe(no_mangle)]
pub extern "C" fn framelock_crc8_receiver_line_event(
    receiver: Option<&mut framelock_crc8_receiver>,
    event: framelock_line_event,
) {
    line_event(receiver, event);
}

/// As `framelock_receiver_counters`.
#[unsafe(no_mangle)]
pub extern "C" fn framelock_crc8_receiver_counters(
    receiver: Option<&framelock_crc8_receiver>,
    counters: Option<&mut MaybeUninit<framelock_counters>>,
) -> bool {
    count(receiver, counters)
}

// All of the above, for either format.

fn init<M, F>(receiver: Option<&mut MaybeUninit<M>>)
where
    M: Memory<Value = Line<Receiver<F>>>,
    F: FixedFormat,
{
    if let Some(receiver) = receiver {
        let line = Line::new(Receiver::new());
        M::write(receiver, Content::Something(line));
    }
}

fn push<M, F>(
    receiver: Option<&mut M>,
    byte: u8,
    setpoint: Option<&mut MaybeUninit<framelock_setpoint>>,
) -> bool
where
    M: Memory<Value = Line<Receiver<F>>>,
    F: FixedFormat<Message = Setpoint>,
{
    let line = receiver.and_then(M::value_mut);
    let Some(found) = line.and_then(|line| line.push(byte)) else {
        return false;
    };
    if let Some(setpoint) = setpoint {
        setpoint.write(found.into());
    }
    true
}

fn line_event<M, F>(receiver: Option<&mut M>, event: framelock_line_event)
where
    M: Memory<Value = Line<Receiver<F>>>,
    F: FixedFormat,
{
    let event = match event {
        FRAMELOCK_FRAMING_ERROR => LineEvent::Framing,
        FRAMELOCK_PARITY_ERROR => LineEvent::Parity,
        FRAMELOCK_OVERRUN => LineEvent::Overrun,
        FRAMELOCK_BREAK => LineEvent::Break,
        FRAMELOCK_IDLE_LINE => LineEvent::Idle,
        _ => return,
    };
    if let Some(line) = receiver.and_then(M::value_mut) {
        line.line_event(event, |_| ());
    }
}

fn count<M, F>(receiver: Option<&M>, counters: Option<&mut MaybeUninit<framelock_counters>>) -> bool
where
    M: Memory<Value = Line<Receiver<F>>>,
    F: FixedFormat,
{
    let (Some(line), Some(counters)) = (receiver.and_then(M::value), counters) else {
        return false;
    };
    counters.write(framelock_counters::new(line.counters(), line.pending()));
    true
}
