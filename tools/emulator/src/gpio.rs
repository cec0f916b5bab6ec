//! GPIO ports P0 and P1: nRF52840 Product Specification, section "GPIO". Outputs are set by OUTSET, OUTCLR and `PIN_CNF`
//! only.

use crate::peripheral::{Common, Context, Peripheral};
use crate::trace::Pins;

const OUTSET: u32 = 0x508;
const OUTCLR: u32 = 0x50C;
const IN: u32 = 0x510;
const PIN_CNF: u32 = 0x700;
const PIN_CNF_LAST: u32 = 0x77C;
/// The offset of P1's registers from P0's, in the same block.
const P1: u32 = 0x300;

/// Both ports: the pins of P0, and then those of P1.
#[derive(Debug)]
pub(crate) struct Gpio {
    common: Common,
    out: u64,
    /// `PIN_CNF`, whose lowest bit makes the pin an output.
    configuration: [u32; 64],
}

impl Gpio {
    pub(crate) fn new() -> Self {
        Self {
            common: Common::new("GPIO", 0x5000_0000, &[], &[], &[]),
            out: 0,
            // After a reset, the input buffers are disconnected.
            configuration: [2; 64],
        }
    }

    /// Returns the pins that have such a configuration.
    fn pins(&self, are: fn(u32) -> bool) -> u64 {
        let configurations = (0..64).zip(self.configuration);
        let pins = configurations.filter(|(_, configuration)| are(*configuration));
        pins.fold(0, |pins, (pin, _)| pins | 1 << pin)
    }

    fn outputs(&self) -> u64 {
        self.pins(|configuration| configuration & 1 == 1)
    }

    /// Returns the values of IN. A pin is read only if its input buffer is connected. An output then reads its own level.
    /// An input reads the level of the line, if it is wired to the line, or otherwise the level of its pull-up.
    fn levels(&self, context: &Context) -> u64 {
        let line = u64::from(context.line.level_at(context.now)) << context.line_pin;
        let inputs = line | self.pins(pulls_up) & !(1 << context.line_pin);
        let buffered = self.pins(|configuration| configuration & 2 == 0);
        let outputs = self.outputs();
        (self.out & outputs | inputs & !outputs) & buffered
    }

    /// Records the levels of the output pins.
    pub(crate) fn show(&self, context: &mut Context) {
        let pins = Pins {
            outputs: ports(self.outputs()),
            high: ports(self.out & self.outputs()),
        };
        if std::mem::replace(&mut context.pins, pins) != pins {
            context.pin_changes.push((context.now, pins));
        }
    }

    fn configuration(&mut self, port: u32, offset: u32) -> Option<&mut u32> {
        let pin = 32 * port + (offset - PIN_CNF) / 4;
        self.configuration.get_mut(pin as usize)
    }
}

impl Peripheral for Gpio {
    fn common(&mut self) -> &mut Common {
        &mut self.common
    }

    fn read(&mut self, offset: u32, context: &Context) -> Option<u32> {
        let (port, offset) = place(offset);
        let pins = match offset {
            OUTSET | OUTCLR => self.out,
            IN => self.levels(context),
            PIN_CNF..=PIN_CNF_LAST => return self.configuration(port, offset).copied(),
            _ => return None,
        };
        ports(pins).get(port as usize).copied()
    }

    fn write(&mut self, offset: u32, value: u32, context: &mut Context) -> Option<()> {
        let (port, offset) = place(offset);
        let pins = u64::from(value) << (32 * port);
        match offset {
            OUTSET => self.out |= pins,
            OUTCLR => self.out &= !pins,
            // SENSE (bits 16 and 17) is for wake-up and GPIOTE, which are not modelled.
            PIN_CNF..=PIN_CNF_LAST if value & 0x3_0000 == 0 => {
                *self.configuration(port, offset)? = value;
            }
            _ => return None,
        }
        self.show(context);
        Some(())
    }
}

fn pulls_up(configuration: u32) -> bool {
    configuration >> 2 & 3 == 3
}

/// Returns the pins of P0 and of P1.
#[expect(clippy::cast_possible_truncation, reason = "the two halves")]
fn ports(pins: u64) -> [u32; 2] {
    [pins as u32, (pins >> 32) as u32]
}

/// Returns the port's number, and the offset that the register has in P0.
fn place(offset: u32) -> (u32, u32) {
    // P0's last register is at 0x77C, P1's first one at 0x804.
    if offset <= PIN_CNF_LAST {
        (0, offset)
    } else {
        (1, offset - P1)
    }
}
