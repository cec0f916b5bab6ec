//! The programmable peripheral interconnect: nRF52840 Product Specification, section "PPI".
//!
//! Twenty programmable channels with a fork each, and six groups. The channels 20 to 31, whose ends
//! are fixed, are not modelled. A task follows its event at once; on silicon it may be one cycle of
//! 16 MHz later.

/// Where PPI's registers are.
pub(crate) const BASE: u32 = 0x4001_F000;

const CHEN: u32 = 0x500;
const CHENSET: u32 = 0x504;
const CHENCLR: u32 = 0x508;
const CH: u32 = 0x510;
const CHG: u32 = 0x800;
const FORK: u32 = 0x910;
const CHANNELS: usize = 20;
const PROGRAMMABLE: u32 = (1 << CHANNELS) - 1;

#[derive(Clone, Copy, Debug, Default)]
struct Channel {
    event: u32,
    task: u32,
    fork: u32,
}

#[derive(Clone, Debug, Default)]
pub(crate) struct Ppi {
    enabled: u32,
    channels: [Channel; CHANNELS],
    groups: [u32; 6],
}

impl Ppi {
    /// The tasks that this event triggers, lowest channel first, each before its fork.
    pub(crate) fn tasks(&self, event: u32) -> impl Iterator<Item = u32> + use<> {
        let enabled = self.enabled;
        let channels = self.channels;
        (0..CHANNELS)
            .zip(channels)
            .filter(move |(n, channel)| enabled >> n & 1 == 1 && channel.event == event)
            .flat_map(|(_, channel)| [channel.task, channel.fork])
            .filter(|task| *task != 0)
    }

    pub(crate) fn read(&self, offset: u32) -> Option<u32> {
        match offset {
            CHEN | CHENSET | CHENCLR => Some(self.enabled),
            CH..CHG => {
                let channel = self.channels.get(((offset - CH) / 8) as usize)?;
                Some(if offset & 4 == CH & 4 {
                    channel.event
                } else {
                    channel.task
                })
            }
            CHG..FORK => self.groups.get(((offset - CHG) / 4) as usize).copied(),
            FORK.. => self
                .channels
                .get(((offset - FORK) / 4) as usize)
                .map(|channel| channel.fork),
            _ => None,
        }
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        match offset {
            CHEN if value & !PROGRAMMABLE == 0 => self.enabled = value,
            CHENSET if value & !PROGRAMMABLE == 0 => self.enabled |= value,
            CHENCLR => self.enabled &= !value,
            CH..CHG => {
                let channel = self.channels.get_mut(((offset - CH) / 8) as usize)?;
                if offset & 4 == CH & 4 {
                    channel.event = value;
                } else {
                    channel.task = value;
                }
            }
            CHG..FORK => *self.groups.get_mut(((offset - CHG) / 4) as usize)? = value,
            FORK.. => {
                self.channels.get_mut(((offset - FORK) / 4) as usize)?.fork = value;
            }
            _ => return None,
        }
        Some(())
    }

    /// `CHG\[n\].EN` at 8 n, `CHG\[n\].DIS` behind it.
    pub(crate) fn task(&mut self, offset: u32) -> Option<()> {
        let group = *self.groups.get((offset / 8) as usize)?;
        if offset & 4 == 0 {
            self.enabled |= group;
        } else {
            self.enabled &= !group;
        }
        Some(())
    }
}
