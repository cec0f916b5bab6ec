//! The receivers, their line events and their counters.

use core::mem::MaybeUninit;

use framelock::motion::{Bin, BinCrc8, Setpoint};
use framelock::{Counters, FixedFormat, Found, Line, LineEvent, Parser, Receiver};

use crate::framelock_setpoint;
use crate::memory::{Content, Memory};

/// A receiver of BIN frames: 'A' 'B' reserved pitch roll yaw CR.
#[repr(C)]
pub struct framelock_receiver {
    aligned: MaybeUninit<u64>,
    opaque: [MaybeUninit<usize>; 20],
}

impl Memory for framelock_receiver {
    type Value = Line<Receiver<Bin>>;
}

/// A receiver of BIN-CRC8 frames: 'A' 'B' reserved pitch roll yaw crc CR.
#[repr(C)]
pub struct framelock_crc8_receiver {
    aligned: MaybeUninit<u64>,
    opaque: [MaybeUninit<usize>; 20],
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
    pub bytes: u32,
    /// Frames committed.
    pub frames: u32,
    /// Bytes in them.
    pub frame_bytes: u32,
    /// Bytes discarded because no frame begins with them.
    pub discarded_no_sync: u32,
    /// Bytes discarded because a later byte of the sync was wrong.
    pub discarded_broken_sync: u32,
    /// Bytes discarded because fixed bits of the header were wrong, or its length was too short.
    pub discarded_header: u32,
    /// Bytes discarded because the header told a length above that of the longest frame.
    pub discarded_too_long: u32,
    /// Bytes discarded because the header told a message that there is not.
    pub discarded_unknown_message: u32,
    /// Bytes discarded because there was no terminator where it was due.
    pub discarded_terminator: u32,
    /// Bytes discarded because the checksum was wrong.
    pub discarded_check: u32,
    /// Bytes that were pending when a line event came.
    pub discarded_line_event: u32,
    /// Bytes that may yet be part of a frame.
    pub pending: usize,
    /// Frames that ended a loss: the first one after bytes were discarded.
    pub resynchronisations: u32,
    /// How often `FRAMELOCK_FRAMING_ERROR` was reported.
    pub framing_errors: u32,
    /// How often `FRAMELOCK_PARITY_ERROR` was reported.
    pub parity_errors: u32,
    /// How often `FRAMELOCK_OVERRUN` was reported.
    pub overruns: u32,
    /// How often `FRAMELOCK_BREAK` was reported.
    pub breaks: u32,
    /// How often `FRAMELOCK_IDLE_LINE` was reported.
    pub idle_lines: u32,
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
            discarded_header: discarded.bad_header,
            discarded_too_long: discarded.too_long,
            discarded_unknown_message: discarded.unknown_message,
            discarded_terminator: discarded.wrong_terminator,
            discarded_check: discarded.checksum_mismatch,
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
pub extern "C" fn framelock_receiver_init(receiver: Option<&mut framelock_receiver>) {
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
    line_event(receiver, event, |_| ());
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
pub extern "C" fn framelock_crc8_receiver_init(receiver: Option<&mut framelock_crc8_receiver>) {
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
    line_event(receiver, event, |_| ());
}

/// As `framelock_receiver_counters`.
#[unsafe(no_mangle)]
pub extern "C" fn framelock_crc8_receiver_counters(
    receiver: Option<&framelock_crc8_receiver>,
    counters: Option<&mut MaybeUninit<framelock_counters>>,
) -> bool {
    count(receiver, counters)
}

// All of the above, for any receiver.

fn init<F: FixedFormat>(receiver: Option<&mut impl Memory<Value = Line<Receiver<F>>>>) {
    if let Some(receiver) = receiver {
        receiver.write(Content::Something(Line::new(Receiver::new())));
    }
}

fn push<F: FixedFormat<Message = Setpoint>>(
    receiver: Option<&mut impl Memory<Value = Line<Receiver<F>>>>,
    byte: u8,
    setpoint: Option<&mut MaybeUninit<framelock_setpoint>>,
) -> bool {
    let line = receiver.and_then(Memory::value_mut);
    let Some(found) = line.and_then(|line| line.push(byte)) else {
        return false;
    };
    if let Some(setpoint) = setpoint {
        setpoint.write(found.into());
    }
    true
}

/// Gives what lies whole in what was pending to `found`.
pub(crate) fn line_event<P: Parser>(
    receiver: Option<&mut impl Memory<Value = Line<P>>>,
    event: framelock_line_event,
    found: impl FnMut(Found<P::Message<'_>>),
) {
    let event = match event {
        FRAMELOCK_FRAMING_ERROR => LineEvent::Framing,
        FRAMELOCK_PARITY_ERROR => LineEvent::Parity,
        FRAMELOCK_OVERRUN => LineEvent::Overrun,
        FRAMELOCK_BREAK => LineEvent::Break,
        FRAMELOCK_IDLE_LINE => LineEvent::Idle,
        _ => return,
    };
    if let Some(line) = receiver.and_then(Memory::value_mut) {
        line.line_event(event, found);
    }
}

pub(crate) fn count<P: Parser>(
    receiver: Option<&impl Memory<Value = Line<P>>>,
    counters: Option<&mut MaybeUninit<framelock_counters>>,
) -> bool {
    let (Some(line), Some(counters)) = (receiver.and_then(Memory::value), counters) else {
        return false;
    };
    counters.write(framelock_counters::new(line.counters(), line.pending()));
    true
}
