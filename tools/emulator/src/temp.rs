//! TEMP: nRF52840 Product Specification, section "TEMP".
//!
//! Only the calibration, which erratum 66 has firmware copy from FICR. No temperature is measured, so
//! writing it has no effect, and reading it is refused.

use crate::peripheral::{Common, Context, Peripheral};

/// A0 to A5, B0 to B5, T0 to T4, with a gap behind each group.
const CALIBRATION: [std::ops::RangeInclusive<u32>; 3] =
    [0x520..=0x534, 0x540..=0x554, 0x560..=0x570];

#[derive(Clone, Debug)]
pub(crate) struct Temp;

impl Peripheral for Temp {
    fn common(&self) -> Common {
        Common::new("TEMP", &[], 0)
    }

    fn read(&self, _: u32, _: u64) -> Option<u32> {
        None
    }

    fn write(&mut self, offset: u32, _: u32, _: &mut Context) -> Option<()> {
        let known = CALIBRATION.iter().any(|group| group.contains(&offset));
        known.then_some(())
    }

    fn task(&mut self, _: u32, _: &mut Context) -> Option<()> {
        None
    }
}
