//! The part of the Embassy example's reception that touches no registers.

use framelock::motion::{Bin, Setpoint};
use framelock::{Line, LineEvent, Receiver};

/// A receiver that gets bytes in groups from a driver, and learns only the number of errors.
pub struct Reception {
    line: Line<Receiver<Bin>>,
    /// The number of errors that the receiver knows of.
    errors: u32,
    /// Whether the driver's buffer may contain bytes from before the last error.
    pub in_doubt: bool,
}

impl Reception {
    /// Creates a receiver. `errors` is the present number of errors.
    pub const fn new(errors: u32) -> Self {
        Self {
            line: Line::new(Receiver::new()),
            errors,
            in_doubt: false,
        }
    }

    /// Takes the bytes of a read, or `None` if no byte came in time. `errors` is the number of errors so far. Calls
    /// `frame` with each setpoint. Returns the line event, if there was one.
    pub fn take(
        &mut self,
        read: Option<&[u8]>,
        errors: u32,
        frame: impl FnMut(Setpoint),
    ) -> Option<LineEvent> {
        let event = if errors == self.errors {
            match read {
                Some(_) if self.in_doubt => return None,
                Some(bytes) => {
                    self.line.messages(bytes).for_each(frame);
                    return None;
                }
                // If pauses were not reported, an ambiguous payload could hide every later frame.
                None if self.line.pending() > 0 => LineEvent::Idle,
                None => {
                    self.in_doubt = false;
                    return None;
                }
            }
        } else {
            // The position of the error in the driver's buffer is not known, so drop the whole buffer.
            (self.errors, self.in_doubt) = (errors, true);
            LineEvent::Framing
        };
        self.line.event(event);
        Some(event)
    }

    /// Reports that the driver has lost bytes and was restarted.
    pub fn restart(&mut self, errors: u32) {
        (self.errors, self.in_doubt) = (errors, false);
        self.line.event(LineEvent::Overrun);
    }
}
