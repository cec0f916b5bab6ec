//! The programmable peripheral interconnect: nRF52840 Product Specification, section "PPI".
//!
//! Models the twenty programmable channels, each with a fork, and the six groups. Channels 20 to
//! 31, whose events and tasks are fixed, are not modelled. A task follows its event immediately. On
//! silicon it may follow one cycle of 16 MHz later.

use crate::peripheral::{ANY, Access, Common, Context, Peripheral};

pub(crate) const PPI: u32 = 0x4001_F000;

const CHEN: u32 = 0x500;
/// The offsets of the channels' events and tasks, the groups, and the forks.
const CHANNEL: u32 = 0x510;
const GROUP: u32 = 0x800;
const FORK: u32 = 0x910;
const CHANNELS: u32 = 20;

#[derive(Debug)]
pub(crate) struct Ppi(Common);

impl Ppi {
    pub(crate) fn new() -> Self {
        let words = [(CHANNEL, 2 * CHANNELS), (GROUP, 6), (FORK, CHANNELS)].into_iter();
        let words = words.flat_map(|(first, count)| (first..first + 4 * count).step_by(4));
        let enables = [
            (CHEN, 0, Access::Plain(0..=(1 << CHANNELS) - 1)),
            (CHEN + 4, 0, Access::Set(CHEN)),
            (CHEN + 8, 0, Access::Clear(CHEN)),
        ];
        let registers = words.map(|offset| (offset, 0, ANY)).chain(enables);
        Self(Common::new("PPI", PPI, &[], registers))
    }
}

/// Returns the tasks that this event triggers, according to PPI's registers. The lowest channel comes first, and each
/// channel's task before its fork.
pub(crate) fn tasks(ppi: &Common, event: u32) -> Vec<u32> {
    let channels = (0..CHANNELS).filter(|n| ppi[CHEN] >> n & 1 == 1);
    let channels = channels.filter(|n| ppi[CHANNEL + 8 * n] == event);
    let tasks = channels.flat_map(|n| [ppi[CHANNEL + 8 * n + 4], ppi[FORK + 4 * n]]);
    tasks.filter(|task| *task != 0).collect()
}

impl Peripheral for Ppi {
    fn common(&mut self) -> &mut Common {
        &mut self.0
    }

    /// The task `CHG[n].EN` is at offset 8 n, and `CHG[n].DIS` at 8 n + 4.
    fn task(&mut self, offset: u32, _: &mut Context) -> Option<()> {
        let group = self.0.load(GROUP + offset / 8 * 4)?;
        self.0.store(CHEN + 4 + (offset & 4), group)
    }
}
