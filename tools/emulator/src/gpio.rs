//! GPIO ports P0 and P1: nRF52840 Product Specification, section "GPIO". Sensing and GPIOTE are not
//! modelled.

use crate::peripheral::{ANY, Access, Common, Context, Peripheral};
use crate::trace::Pins;

const OUT: u32 = 0x504;
const OUTSET: u32 = 0x508;
const OUTCLR: u32 = 0x50C;
const IN: u32 = 0x510;
const PIN_CNF: u32 = 0x700;
/// The offset of P1's registers from P0's, in the same block.
const P1: u32 = 0x300;

/// Both ports.
#[derive(Debug)]
pub(crate) struct Gpio(Common);

impl Gpio {
    pub(crate) fn new() -> Self {
        let registers = [0, P1].into_iter().flat_map(|port| {
            let out = [
                (OUT + port, 0, ANY),
                (OUTSET + port, 0, Access::Set(OUT + port)),
                (OUTCLR + port, 0, Access::Clear(OUT + port)),
            ];
            // After a reset, the input buffers are disconnected. SENSE (bits 16 and 17) is not modelled.
            let pins =
                (0..32).map(move |pin| (configuration(port, pin), 2, Access::Plain(0..=0xFFFF)));
            pins.chain(out)
        });
        Self(Common::new("GPIO", 0x5000_0000, &[], registers))
    }

    /// Returns a mask of the port's pins for whose configuration `are` returns true.
    fn pins(&self, port: u32, are: fn(u32) -> bool) -> u32 {
        let pins = (0..32).filter(|pin| are(self.0[configuration(port, *pin)]));
        pins.fold(0, |pins, pin| pins | 1 << pin)
    }

    fn outputs(&self, port: u32) -> u32 {
        self.pins(port, |configuration| configuration & 1 == 1)
    }

    /// Returns the value of IN. A pin whose input buffer is disconnected reads as 0. An output reads its own level. An
    /// input that is wired to the line reads the line's level. Any other input reads as 1 if it has a pull-up, and as 0
    /// otherwise.
    fn levels(&self, port: u32, context: &Context) -> u32 {
        let wired = if context.line_pin / 32 * P1 == port {
            1 << (context.line_pin % 32)
        } else {
            0
        };
        let line = if context.line.level_at(context.now) {
            wired
        } else {
            0
        };
        let inputs = line | self.pins(port, |configuration| configuration >> 2 & 3 == 3) & !wired;
        let outputs = self.outputs(port);
        let buffered = self.pins(port, |configuration| configuration & 2 == 0);
        (self.0[OUT + port] & outputs | inputs & !outputs) & buffered
    }
}

/// Returns the offset of a pin's configuration. The lowest bit of this register makes the pin an output.
fn configuration(port: u32, pin: u32) -> u32 {
    PIN_CNF + port + 4 * pin
}

impl Peripheral for Gpio {
    fn common(&mut self) -> &mut Common {
        &mut self.0
    }

    fn read(&mut self, offset: u32, context: &Context) -> Option<u32> {
        match offset {
            IN => Some(self.levels(0, context)),
            _ if offset == IN + P1 => Some(self.levels(P1, context)),
            _ => self.0.load(offset),
        }
    }

    fn write(&mut self, offset: u32, value: u32, context: &mut Context) -> Option<()> {
        self.0.store(offset, value)?;
        let outputs = [0, P1].map(|port| self.outputs(port));
        let high = [0, P1].map(|port| self.0[OUT + port]);
        context.show(Pins {
            outputs,
            high: [high[0] & outputs[0], high[1] & outputs[1]],
        });
        Some(())
    }
}
