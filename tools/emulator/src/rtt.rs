//! SEGGER RTT, as a debug probe fetches it: the control block `_SEGGER_RTT` in RAM, and its up-channels.
//!
//! The layout is that of SEGGER's `SEGGER_RTT_CB`: "SEGGER RTT" padded to 16 bytes, the numbers of up-
//! and down-channels, then for each up-channel: name, buffer, size, write offset, read offset, flags.

use crate::board::Board;
use crate::memory::Memory;

const MAGIC: &[u8; 16] = b"SEGGER RTT\0\0\0\0\0\0";
const CHANNELS: u32 = 24;
const CHANNEL_SIZE: u32 = 24;

impl Board {
    /// Takes what the firmware has written to an RTT up-channel since; empty if it has none yet.
    pub fn take_rtt(&mut self, channel: u32) -> Vec<u8> {
        let memory = self.memory().clone();
        let control = self.image().symbol("_SEGGER_RTT").ok();
        let taken = control.and_then(|control| take(&memory, control.address, channel));
        taken.unwrap_or_default()
    }
}

fn take(memory: &Memory, control: u32, channel: u32) -> Option<Vec<u8>> {
    let mut magic = [0; 16];
    memory.read(control, &mut magic)?;
    if magic != *MAGIC || channel >= memory.word(control + 16)? {
        return None;
    }
    let block = control + CHANNELS + channel * CHANNEL_SIZE;
    let (buffer, size) = (memory.word(block + 4)?, memory.word(block + 8)?);
    let (write, read) = (memory.word(block + 12)?, memory.word(block + 16)?);
    if write >= size || read >= size {
        return None;
    }
    let pieces = if read <= write {
        [(read, write), (0, 0)]
    } else {
        [(read, size), (0, write)]
    };
    let mut taken = Vec::new();
    for (from, to) in pieces {
        let mut piece = vec![0; (to - from) as usize];
        memory.read(buffer + from, &mut piece)?;
        taken.append(&mut piece);
    }
    memory.write(block + 16, &write.to_le_bytes())?;
    Some(taken)
}
