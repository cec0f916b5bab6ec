//! GPIO ports P0 and P1: nRF52840 Product Specification, section "GPIO".

use crate::peripheral::{Common, Context, Peripheral};
use crate::trace::Pins;

const OUTSET: u32 = 0x508;
const OUTCLR: u32 = 0x50C;
const IN: u32 = 0x510;
const PIN_CNF: u32 = 0x700;
const PIN_CNF_LAST: u32 = 0x77C;
/// The offset of P1's registers from P0's, in the same block.
const P1: u32 = 0x300;

/// Both ports.
#[derive(Debug)]
pub(crate) struct Gpio {
    common: Common,
    ports: [Port; 2],
}

/// One port of 32 pins.
#[derive(Debug)]
struct Port {
    out: u32,
    /// `PIN_CNF`, whose lowest bit makes the pin an output.
    configuration: [u32; 32],
}

impl Port {
    /// Returns the pins that have such a configuration.
    fn pins(&self, are: fn(u32) -> bool) -> u32 {
        let configurations = (0..32).zip(self.configuration);
        let pins = configurations.filter(|(_, configuration)| are(*configuration));
        pins.fold(0, |pins, (pin, _)| pins | 1 << pin)
    }

    fn outputs(&self) -> u32 {
        self.pins(|configuration| configuration & 1 == 1)
    }

    /// Returns the value of IN. The argument has the pins that are driven from outside the chip, and the levels of
    /// these pins. A pin is read only if its input buffer is connected. An output then reads its own level. An input
    /// reads the level from outside, or the level of its pull-up if nothing drives the pin.
    fn levels(&self, (driven, levels): (u32, u32)) -> u32 {
        let inputs = levels & driven | self.pins(pulls_up) & !driven;
        let buffered = self.pins(|configuration| configuration & 2 == 0);
        let outputs = self.outputs();
        (self.out & outputs | inputs & !outputs) & buffered
    }

    fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        match offset {
            OUTSET => self.out |= value,
            OUTCLR => self.out &= !value,
            // SENSE (bits 16 and 17) is for wake-up and GPIOTE, which are not modelled.
            PIN_CNF..=PIN_CNF_LAST if value & 0x3_0000 == 0 => {
                let pin = (offset - PIN_CNF) / 4;
                *self.configuration.get_mut(pin as usize)? = value;
            }
            _ => return None,
        }
        Some(())
    }
}

impl Gpio {
    pub(crate) fn new() -> Self {
        // After a reset, the input buffers are disconnected.
        let port = || Port {
            out: 0,
            configuration: [2; 32],
        };
        Self {
            common: Common::new("GPIO", 0x5000_0000, &[], &[], &[]),
            ports: [port(), port()],
        }
    }

    /// Records the levels of the output pins, and sets an undriven line to the level of its pin's pull-up.
    pub(crate) fn show(&self, context: &mut Context) {
        let port = self.ports.get(context.line_pin as usize / 32);
        let pin = port.and_then(|port| port.configuration.get(context.line_pin as usize % 32));
        let high = pin.is_some_and(|configuration| pulls_up(*configuration));
        context.line.float(context.now, high);
        let pins = Pins {
            outputs: self.ports.each_ref().map(Port::outputs),
            high: self.ports.each_ref().map(|port| port.out & port.outputs()),
        };
        if std::mem::replace(&mut context.pins, pins) != pins {
            context.pin_changes.push((context.now, pins));
        }
    }
}

impl Peripheral for Gpio {
    fn common(&mut self) -> &mut Common {
        &mut self.common
    }

    fn read(&mut self, offset: u32, context: &Context) -> Option<u32> {
        let (n, offset) = port(offset);
        let port = self.ports.get(n)?;
        let (line_port, pin) = (context.line_pin / 32, context.line_pin % 32);
        let high = u32::from(context.line.level_at(context.now));
        let outside = if line_port as usize == n {
            (1 << pin, high << pin)
        } else {
            (0, 0)
        };
        match offset {
            OUTSET | OUTCLR => Some(port.out),
            IN => Some(port.levels(outside)),
            PIN_CNF.. => {
                let pin = (offset - PIN_CNF) / 4;
                port.configuration.get(pin as usize).copied()
            }
            _ => None,
        }
    }

    fn write(&mut self, offset: u32, value: u32, context: &mut Context) -> Option<()> {
        let (n, offset) = port(offset);
        self.ports.get_mut(n)?.write(offset, value)?;
        self.show(context);
        Some(())
    }
}

fn pulls_up(configuration: u32) -> bool {
    configuration >> 2 & 3 == 3
}

/// Returns the port's number, and the offset that the register has in P0.
fn port(offset: u32) -> (usize, u32) {
    // P0's last register is at 0x77C, P1's first one at 0x804.
    if offset <= PIN_CNF_LAST {
        (0, offset)
    } else {
        (1, offset - P1)
    }
}
