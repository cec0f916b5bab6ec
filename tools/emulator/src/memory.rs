//! Flash and RAM, and EasyDMA's access to RAM.

use std::sync::Arc;

use rsemu::core::space::RamStore;

/// The size of flash in bytes, from address 0: nRF52840 Product Specification, section "Memory".
pub const FLASH_SIZE: u32 = 1 << 20;
/// The first address of RAM.
pub const RAM_START: u32 = 0x2000_0000;
/// The size of RAM in bytes.
pub const RAM_SIZE: u32 = 256 << 10;

/// Flash and RAM. Clones share the same memory.
#[derive(Clone, Debug)]
pub struct Memory {
    pub(crate) flash: Arc<RamStore>,
    pub(crate) ram: Arc<RamStore>,
}

impl Memory {
    /// Creates erased flash (all ones), and RAM with zeros.
    #[must_use]
    pub(crate) fn new() -> Self {
        let [flash, ram] =
            [FLASH_SIZE, RAM_SIZE].map(|size| Arc::new(RamStore::new(u64::from(size))));
        // Cannot fail: the range is the whole store.
        let _ = flash.fill(0, u64::from(FLASH_SIZE), 0xFF);
        Self { flash, ram }
    }

    /// Reads from flash or RAM, as a debugger would. Returns `None` if the range is in neither.
    #[must_use]
    pub fn read(&self, address: u32, into: &mut [u8]) -> Option<()> {
        let (store, offset) = self.place(address)?;
        store.read_at(offset, into).ok()
    }

    /// Writes to flash or RAM, as a debugger would. Returns `None` if the range is in neither.
    #[must_use]
    pub fn write(&self, address: u32, bytes: &[u8]) -> Option<()> {
        let (store, offset) = self.place(address)?;
        store.write_at(offset, bytes).ok()
    }

    /// Reads a little-endian word. Returns `None` if the word is outside flash and RAM.
    #[must_use]
    pub fn word(&self, address: u32) -> Option<u32> {
        let mut bytes = [0; 4];
        self.read(address, &mut bytes)?;
        Some(u32::from_le_bytes(bytes))
    }

    fn place(&self, address: u32) -> Option<(&RamStore, u64)> {
        if address < FLASH_SIZE {
            return Some((&self.flash, u64::from(address)));
        }
        let offset = address.checked_sub(RAM_START)?;
        (offset < RAM_SIZE).then_some((&self.ram, u64::from(offset)))
    }

    /// Reads RAM for EasyDMA. EasyDMA cannot read other memory: section "EasyDMA".
    pub(crate) fn dma_read(&self, address: u32, into: &mut [u8]) -> Result<(), String> {
        dma(address, |offset| self.ram.read_at(offset, into).ok())
    }

    /// Writes RAM for EasyDMA. EasyDMA cannot write other memory: section "EasyDMA".
    pub(crate) fn dma_write(&self, address: u32, bytes: &[u8]) -> Result<(), String> {
        dma(address, |offset| self.ram.write_at(offset, bytes).ok())
    }
}

/// Calls `access` with the address's offset in RAM.
fn dma(address: u32, access: impl FnOnce(u64) -> Option<()>) -> Result<(), String> {
    let offset = address.checked_sub(RAM_START).map(u64::from);
    let refusal = || format!("EasyDMA to {address:#010x}, which is not RAM");
    offset.and_then(access).ok_or_else(refusal)
}
