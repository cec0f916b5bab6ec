//! The programmable peripheral interconnect: nRF52840 Product Specification, section "PPI".
//!
//! Models the twenty programmable channels, each with a fork, and the six groups. Channels 20 to
//! 31, whose events and tasks are fixed, are not modelled. A task follows its event immediately. On
//! silicon it may follow one cycle of 16 MHz later.

use crate::peripheral::{Common, Context, Peripheral};

const CHEN: u32 = 0x500;
const CHENSET: u32 = 0x504;
const CHENCLR: u32 = 0x508;
/// The offsets of the channels' events and tasks, the groups, and the forks.
const CHANNEL: u32 = 0x510;
const GROUP: u32 = 0x800;
const FORK: u32 = 0x910;
const CHANNELS: usize = 20;
const PROGRAMMABLE: u32 = (1 << CHANNELS) - 1;

#[derive(Debug)]
pub(crate) struct Ppi {
    common: Common,
    enabled: u32,
    /// Each channel's event and task.
    channels: [u32; 2 * CHANNELS],
    groups: [u32; 6],
    forks: [u32; CHANNELS],
}

impl Ppi {
    pub(crate) fn new() -> Self {
        Self {
            common: Common::new("PPI", 0x4001_F000, &[], &[], &[]),
            enabled: 0,
            channels: [0; 2 * CHANNELS],
            groups: [0; 6],
            forks: [0; CHANNELS],
        }
    }

    /// Returns the tasks that this event triggers. The lowest channel comes first, and each
    /// channel's task before its fork.
    pub(crate) fn tasks(&self, event: u32) -> impl Iterator<Item = u32> {
        let (channels, _) = self.channels.as_chunks();
        (0..)
            .zip(channels)
            .zip(self.forks)
            .filter(move |((n, [at, _]), _)| self.enabled >> n & 1 == 1 && *at == event)
            .flat_map(|((_, [_, task]), fork)| [*task, fork])
            .filter(|task| *task != 0)
    }

    fn word(&mut self, offset: u32) -> Option<&mut u32> {
        let (words, first) = match offset {
            FORK.. => (&mut self.forks[..], FORK),
            GROUP.. => (&mut self.groups[..], GROUP),
            _ => (&mut self.channels[..], CHANNEL),
        };
        words.get_mut((offset.checked_sub(first)? / 4) as usize)
    }
}

impl Peripheral for Ppi {
    fn common(&mut self) -> &mut Common {
        &mut self.common
    }

    fn read(&mut self, offset: u32, _: &Context) -> Option<u32> {
        match offset {
            CHEN | CHENSET | CHENCLR => Some(self.enabled),
            _ => self.word(offset).copied(),
        }
    }

    fn write(&mut self, offset: u32, value: u32, _: &mut Context) -> Option<()> {
        match offset {
            CHENSET if value & !PROGRAMMABLE == 0 => self.enabled |= value,
            CHENCLR => self.enabled &= !value,
            _ => *self.word(offset)? = value,
        }
        Some(())
    }

    /// The task `CHG\[n\].EN` is at 8 n, followed by `CHG\[n\].DIS`.
    fn task(&mut self, offset: u32, _: &mut Context) -> Option<()> {
        let group = *self.groups.get((offset / 8) as usize)?;
        if offset & 4 == 0 {
            self.enabled |= group;
        } else {
            self.enabled &= !group;
        }
        Some(())
    }
}
