//! P0 and P1: nRF52840 Product Specification, section "GPIO".

const OUT: u32 = 0x504;
const OUTSET: u32 = 0x508;
const OUTCLR: u32 = 0x50C;
const IN: u32 = 0x510;
const DIR: u32 = 0x514;
const DIRSET: u32 = 0x518;
const DIRCLR: u32 = 0x51C;
const PIN_CNF: u32 = 0x700;
const PIN_CNF_LAST: u32 = 0x77C;

/// Levels of the pins that are outputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pins {
    /// A bit for each pin of P0 and P1 that is an output.
    pub outputs: [u32; 2],
    /// A bit for each of these that is high.
    pub high: [u32; 2],
}

/// One port of 32 pins.
#[derive(Clone, Debug)]
pub(crate) struct Port {
    out: u32,
    dir: u32,
    /// `PIN_CNF` without its lowest bit, which is DIR's.
    configuration: [u32; 32],
}

impl Port {
    pub(crate) fn new() -> Self {
        Self {
            out: 0,
            dir: 0,
            // Input buffer disconnected.
            configuration: [2; 32],
        }
    }

    /// Pins driven as outputs, and of these the ones that are high.
    pub(crate) fn driven(&self) -> (u32, u32) {
        (self.dir, self.out & self.dir)
    }

    /// What IN reads: an output reads as itself, an input as its pull-up says, and both only with
    /// the input buffer connected. `outside` are the pins that something outside drives, and their
    /// levels.
    fn levels(&self, outside: (u32, u32)) -> u32 {
        let (driven, levels) = outside;
        (0..32)
            .zip(self.configuration)
            .filter(|(pin, configuration)| {
                let buffered = configuration & 2 == 0;
                let high = if self.dir >> pin & 1 == 1 {
                    self.out >> pin & 1 == 1
                } else if driven >> pin & 1 == 1 {
                    levels >> pin & 1 == 1
                } else {
                    configuration >> 2 & 3 == 3
                };
                buffered && high
            })
            .fold(0, |levels, (pin, _)| levels | 1 << pin)
    }

    /// Whether that pin is pulled up.
    pub(crate) fn pulls_up(&self, pin: u32) -> bool {
        let configuration = self.configuration.get(pin as usize);
        configuration.is_some_and(|configuration| configuration >> 2 & 3 == 3)
    }

    pub(crate) fn read(&self, offset: u32, outside: (u32, u32)) -> Option<u32> {
        Some(match offset {
            OUT | OUTSET | OUTCLR => self.out,
            IN => self.levels(outside),
            DIR | DIRSET | DIRCLR => self.dir,
            PIN_CNF..=PIN_CNF_LAST => {
                let pin = (offset - PIN_CNF) / 4;
                self.configuration.get(pin as usize)? | (self.dir >> pin & 1)
            }
            _ => return None,
        })
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        match offset {
            OUT => self.out = value,
            OUTSET => self.out |= value,
            OUTCLR => self.out &= !value,
            DIR => self.dir = value,
            DIRSET => self.dir |= value,
            DIRCLR => self.dir &= !value,
            // SENSE (bits 16 and 17) is for waking and GPIOTE, which are not modelled.
            PIN_CNF..=PIN_CNF_LAST if value & 0x3_0000 == 0 => {
                let pin = (offset - PIN_CNF) / 4;
                *self.configuration.get_mut(pin as usize)? = value & !1;
                self.dir = self.dir & !(1 << pin) | (value & 1) << pin;
            }
            _ => return None,
        }
        Some(())
    }
}
