//! The firmware's log. Fetches bytes from SEGGER RTT, as a debug probe does, and decodes them with the defmt
//! texts in the ELF.
//!
//! RTT's control block `_SEGGER_RTT` is SEGGER's `SEGGER_RTT_CB`. It begins with "SEGGER RTT" padded to 16 bytes, the
//! number of up-channels and the number of down-channels. Then it has six words for each up-channel: name, buffer,
//! size, write offset, read offset, flags.

use defmt_decoder::{DecodeError, StreamDecoder, Table};

use crate::board::Board;
use crate::error::{Error, Result};
use crate::memory::Memory;

const MAGIC: &[u8; 16] = b"SEGGER RTT\0\0\0\0\0\0";
const CHANNELS: u32 = 24;
const CHANNEL_SIZE: u32 = 24;

impl Board {
    /// Takes the bytes that the firmware has written to an RTT up-channel since the last call. Returns no bytes if the
    /// channel does not exist yet.
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

/// The log's texts from the ELF.
pub struct LogTable {
    table: Option<Table>,
}

impl LogTable {
    /// Reads the texts from the ELF. Firmware without defmt has an empty table and no log.
    ///
    /// # Errors
    /// Returns an error if the ELF is invalid, or uses another version of defmt's format.
    pub fn parse(elf: &[u8]) -> Result<Self> {
        let table = Table::parse(elf).map_err(|error| Error::Image(format!("{error:#}")))?;
        Ok(Self { table })
    }

    /// Returns a decoder for one stream of bytes.
    #[must_use]
    pub fn decoder(&self) -> LogDecoder<'_> {
        LogDecoder {
            decoder: self.table.as_ref().map(Table::new_stream_decoder),
        }
    }
}

/// Decodes bytes into log lines.
pub struct LogDecoder<'table> {
    decoder: Option<Box<dyn StreamDecoder + Send + Sync + 'table>>,
}

impl LogDecoder<'_> {
    /// Takes the next bytes. Returns the lines that these bytes complete, each with its level and text. Bytes
    /// that cannot be decoded are reported in a line.
    pub fn lines(&mut self, bytes: &[u8]) -> Vec<String> {
        let Some(decoder) = &mut self.decoder else {
            return Vec::new();
        };
        decoder.received(bytes);
        let mut lines = Vec::new();
        loop {
            match decoder.decode() {
                Ok(frame) => {
                    let level = frame.level().map_or("", |level| level.as_str());
                    lines.push(format!(
                        "{:5} {}",
                        level.to_uppercase(),
                        frame.display_message()
                    ));
                }
                Err(DecodeError::UnexpectedEof) => break,
                Err(DecodeError::Malformed) => {
                    lines.push("(log bytes that are no defmt frame)".to_owned());
                    // This encoding has no separators between frames, so the decoder cannot find the next frame.
                    if lines.len() > bytes.len() {
                        break;
                    }
                }
            }
        }
        lines
    }
}
