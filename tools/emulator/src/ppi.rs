//! The programmable peripheral interconnect: nRF52840 Product Specification, section "PPI".
//!
//! Models the twenty programmable channels, each with a fork, and the six groups. Channels 20 to
//! 31, whose events and tasks are fixed, are not modelled. A task follows its event immediately. On
//! silicon it may follow one cycle of 16 MHz later.

use crate::peripheral::{Common, Context, Peripheral, RegisterFile as _, registers};

const CHEN: u32 = 0x500;
const CHENSET: u32 = 0x504;
const CHENCLR: u32 = 0x508;
const CHANNELS: usize = 20;
const PROGRAMMABLE: u32 = (1 << CHANNELS) - 1;

registers! {
    /// Each channel's event and task.
    0x510 channels: [u32; 2 * CHANNELS] = [0; 2 * CHANNELS], 0..;
    0x800 groups: [u32; 6] = [0; 6], 0..;
    0x910 forks: [u32; CHANNELS] = [0; CHANNELS], 0..;
}

#[derive(Clone, Debug, Default)]
pub(crate) struct Ppi {
    enabled: u32,
    registers: Registers,
}

impl Ppi {
    /// Returns the tasks that this event triggers. The lowest channel comes first, and each
    /// channel's task before its fork.
    pub(crate) fn tasks(&self, event: u32) -> impl Iterator<Item = u32> {
        let (channels, _) = self.registers.channels.as_chunks();
        (0..)
            .zip(channels)
            .zip(self.registers.forks)
            .filter(move |((n, [at, _]), _)| self.enabled >> n & 1 == 1 && *at == event)
            .flat_map(|((_, [_, task]), fork)| [*task, fork])
            .filter(|task| *task != 0)
    }
}

impl Peripheral for Ppi {
    fn common(&self) -> Common {
        Common::new("PPI", &[], &[])
    }

    fn read(&mut self, offset: u32, _: &Context) -> Option<u32> {
        match offset {
            CHEN | CHENSET | CHENCLR => Some(self.enabled),
            _ => self.registers.read(offset),
        }
    }

    fn write(&mut self, offset: u32, value: u32, _: &mut Context) -> Option<()> {
        match offset {
            CHEN if value & !PROGRAMMABLE == 0 => self.enabled = value,
            CHENSET if value & !PROGRAMMABLE == 0 => self.enabled |= value,
            CHENCLR => self.enabled &= !value,
            _ => self.registers.write(offset, value)?,
        }
        Some(())
    }

    /// The task `CHG\[n\].EN` is at 8 n, followed by `CHG\[n\].DIS`.
    fn task(&mut self, offset: u32, _: &mut Context) -> Option<()> {
        let group = *self.registers.groups.get((offset / 8) as usize)?;
        if offset & 4 == 0 {
            self.enabled |= group;
        } else {
            self.enabled &= !group;
        }
        Some(())
    }
}
