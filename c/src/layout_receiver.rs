//! The receiver of frames of any layouts.

use core::ffi::c_void;
use core::mem::MaybeUninit;

use framelock::{BufferedReceiver, Line};
use framelock_formats::AnyOf;

use crate::layout::{framelock_layout, framelock_made_layout};
use crate::memory::{Content, Memory, values, values_mut};
use crate::receiver::{count, framelock_counters, framelock_line_event, line_event};

/// A receiver of frames of any layouts.
#[repr(C)]
pub struct framelock_layout_receiver {
    opaque: [MaybeUninit<usize>; 26],
}

impl Memory for framelock_layout_receiver {
    type Value = Line<BufferedReceiver<AnyOf<'static, framelock_made_layout>, &'static mut [u8]>>;
}

/// A frame that was received. Its bytes are there until the next call with that receiver.
#[repr(C)]
pub struct framelock_frame {
    /// All of it, from the sync to the end.
    pub bytes: *const u8,
    /// How many bytes.
    pub length: usize,
    /// Which of the receiver's layouts it has: the first is 0.
    pub layout: usize,
}

/// Begins to receive frames of `count` layouts, which are tried in order until one fits. All counters
/// are 0. `made` is room for as many layouts, which the receiver uses from now on.
///
/// The buffer has `size` bytes: at least as many as the longest frame, better twice. If it has fewer, or a layout has
/// a pointer or a constant that cannot be, or contradicts itself, it returns false, and the receiver is not initialised.
#[unsafe(no_mangle)]
pub extern "C" fn framelock_layout_receiver_init(
    receiver: Option<&mut framelock_layout_receiver>,
    layouts: *const framelock_layout,
    made: *mut framelock_made_layout,
    count: usize,
    buffer: *mut u8,
    size: usize,
) -> bool {
    let Some(receiver) = receiver else {
        return false;
    };
    let layouts = make(layouts, made, count).zip(values_mut(buffer, size));
    let built =
        layouts.and_then(|(layouts, buffer)| BufferedReceiver::with_buffer(AnyOf(layouts), buffer));
    let is_built = built.is_some();
    receiver.write(built.map_or(Content::Nothing, |built| {
        Content::Something(Line::new(built))
    }));
    is_built
}

/// The layouts, made; nothing if one cannot be.
fn make(
    layouts: *const framelock_layout,
    made: *mut framelock_made_layout,
    count: usize,
) -> Option<&'static [framelock_made_layout]> {
    let made = values_mut(made, count)?;
    for (layout, made) in values(layouts, count)?.iter().zip(&mut *made) {
        made.write(Content::Something(layout.layout()?));
    }
    Some(made)
}

/// Takes the next byte. If that leads to a frame, says which and returns true. If not, leaves `frame` as it is and
/// returns false.
///
/// Behind a false beginning each call catches up by one: if no byte follows soon, call
/// `framelock_layout_receiver_poll` until it returns false.
#[unsafe(no_mangle)]
pub extern "C" fn framelock_layout_receiver_push(
    receiver: Option<&mut framelock_layout_receiver>,
    byte: u8,
    frame: Option<&mut MaybeUninit<framelock_frame>>,
) -> bool {
    let line = receiver.and_then(Memory::value_mut);
    deliver(
        line.and_then(|line| line.push(byte))
            .map(|found| found.message()),
        frame,
    )
}

/// Goes on with what `framelock_layout_receiver_push` has left, up to the next frame; returns as it does.
#[unsafe(no_mangle)]
pub extern "C" fn framelock_layout_receiver_poll(
    receiver: Option<&mut framelock_layout_receiver>,
    frame: Option<&mut MaybeUninit<framelock_frame>>,
) -> bool {
    let line = receiver.and_then(Memory::value_mut);
    deliver(
        line.and_then(Line::poll).map(|found| found.message()),
        frame,
    )
}

/// Calls `found`, unless it is NULL, with each frame that lies whole in what is pending; drops the rest, so that no
/// frame has bytes from before the event, and counts it. Do not push a byte that is known to be bad: report the
/// event in its place. `found` must not call functions with this receiver.
#[unsafe(no_mangle)]
pub extern "C" fn framelock_layout_receiver_line_event(
    receiver: Option<&mut framelock_layout_receiver>,
    event: framelock_line_event,
    found: Option<extern "C" fn(context: *mut c_void, frame: &framelock_frame)>,
    context: *mut c_void,
) {
    line_event(receiver, event, |one| {
        if let (Some(found), Some(frame)) = (found, one.message()) {
            found(context, &framelock_frame::new(frame.message()));
        }
    });
}

/// Writes the counters and returns true; or false if there are none.
#[unsafe(no_mangle)]
pub extern "C" fn framelock_layout_receiver_counters(
    receiver: Option<&framelock_layout_receiver>,
    counters: Option<&mut MaybeUninit<framelock_counters>>,
) -> bool {
    count(receiver, counters)
}

fn deliver(
    found: Option<(usize, &[u8])>,
    frame: Option<&mut MaybeUninit<framelock_frame>>,
) -> bool {
    let is_found = found.is_some();
    if let (Some(found), Some(frame)) = (found, frame) {
        frame.write(framelock_frame::new(found));
    }
    is_found
}

impl framelock_frame {
    fn new((layout, frame): (usize, &[u8])) -> Self {
        let (bytes, length) = (frame.as_ptr(), frame.len());
        Self {
            bytes,
            length,
            layout,
        }
    }
}
