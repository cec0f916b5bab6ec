//! Connects the core's accesses outside flash and RAM to the peripherals' registers.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rsemu::core::error::BusError;
use rsemu::core::space::{AddressSpace, MemAttrs, MemOps, MemResult, Perms, Region};

use crate::chip::Chip;
use crate::memory::{Memory, RAM_START};

/// The chip, shared by the core's accesses and the board. The core's interface requires the lock. Only one thread uses
/// the chip, so no thread ever waits for the lock.
#[derive(Debug)]
pub(crate) struct Shared {
    chip: Mutex<Chip>,
    /// The instant at which the current instruction began.
    pub(crate) now: AtomicU64,
    /// True if the board must check the chip, because since its last check a register was written, an access was
    /// rejected, the chip was reset, or a test accessed a register or changed the board.
    pub(crate) touched: AtomicBool,
}

impl Shared {
    pub(crate) fn new(chip: Chip) -> Arc<Self> {
        Arc::new(Self {
            chip: Mutex::new(chip),
            now: AtomicU64::new(0),
            touched: AtomicBool::new(true),
        })
    }

    pub(crate) fn chip(&self) -> MutexGuard<'_, Chip> {
        self.chip.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Returns the chip's address map: nRF52840 Product Specification, section "Memory map".
pub(crate) fn address_space(shared: &Arc<Shared>, memory: &Memory) -> AddressSpace {
    let space = AddressSpace::new("nRF52840", 32);
    {
        let mut topology = space.topology();
        let registers = |start: u32, size: u32| {
            let window = Window {
                start,
                shared: Arc::clone(shared),
            };
            (
                Region::io("registers", u64::from(size), Arc::new(window)),
                u64::from(start),
            )
        };
        let regions = [
            (
                Region::ram("RAM", Arc::clone(&memory.ram)),
                u64::from(RAM_START),
            ),
            registers(0x1000_0000, 0x2000),
            registers(0x4000_0000, 0x80000),
            registers(0x5000_0000, 0x1000),
        ];
        let flash = Region::ram("flash", Arc::clone(&memory.flash));
        let read_only = Perms::READ.union(Perms::EXEC);
        // Cannot fail: the regions lie inside the space and do not overlap.
        let mapped = topology.map_with_perms(flash, 0, read_only);
        debug_assert!(mapped.is_ok(), "{mapped:?}");
        for (region, at) in regions {
            let mapped = topology.map(region, at);
            debug_assert!(mapped.is_ok(), "{mapped:?}");
        }
    }
    space
}

/// A range of registers.
#[derive(Debug)]
struct Window {
    start: u32,
    shared: Arc<Shared>,
}

impl Window {
    /// Accesses a register. Rejects an access to less than a word, because registers are words.
    fn access<T>(
        &self,
        offset: u64,
        length: usize,
        access: impl FnOnce(&mut Chip, u32) -> Option<T>,
    ) -> Result<T, BusError> {
        let address = self.start + u32::try_from(offset).expect("offsets are inside the region");
        let mut chip = self.shared.chip();
        chip.context.now = self.shared.now.load(Relaxed);
        let done = if length == 4 {
            access(&mut chip, address)
        } else {
            let refusal = format!("access to a part of the register at {address:#010x}");
            chip.context.refuse(refusal);
            None
        };
        if chip.context.refusal.is_some() {
            self.shared.touched.store(true, Relaxed);
        }
        done.ok_or(BusError::Unassigned)
    }
}

impl MemOps for Window {
    fn read(&self, offset: u64, into: &mut [u8], attributes: MemAttrs) -> MemResult {
        // Reject fetches, because registers contain no code.
        let length = if attributes.is_fetch() { 0 } else { into.len() };
        let value = self.access(offset, length, Chip::read)?;
        into.copy_from_slice(&value.to_le_bytes());
        Ok(())
    }

    fn write(&self, offset: u64, from: &[u8], _: MemAttrs) -> MemResult {
        let value = from.try_into().map_or(0, u32::from_le_bytes);
        self.shared.touched.store(true, Relaxed);
        self.access(offset, from.len(), |chip, address| {
            chip.write(address, value)
        })
    }
}
