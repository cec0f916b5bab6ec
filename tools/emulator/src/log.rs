//! The firmware's log. Fetches bytes from SEGGER RTT, as a debug probe does, and decodes them with the defmt
//! texts in the ELF.
//!
//! RTT's control block `_SEGGER_RTT` is SEGGER's `SEGGER_RTT_CB`. It begins with "SEGGER RTT" padded to 16 bytes, the
//! number of up-channels and the number of down-channels. Then it has six words for each up-channel: name, buffer,
//! size, write offset, read offset, flags. Firmware with defmt logs to the first up-channel.

use defmt_decoder::{DecodeError, Table};

use crate::board::Board;
use crate::image::Image;
use crate::memory::Memory;

const MAGIC: &[u8; 16] = b"SEGGER RTT\0\0\0\0\0\0";
/// The offset of the first up-channel.
const CHANNEL: u32 = 24;

impl Board {
    /// Returns the log's lines since the last call, each with its level and text. Firmware without defmt has no log.
    /// Bytes that cannot be decoded are reported in a line.
    ///
    /// # Panics
    /// Panics if the image has no ELF (see [`Image::of_code`]), or if the decoder cannot read the ELF, for example
    /// because it does not support the version of defmt's format.
    pub fn log(&mut self) -> Vec<String> {
        let table = self.log_table.get_or_init(|| {
            Table::parse(&self.image.elf).expect("the texts of the firmware's log")
        });
        self.log_bytes
            .extend(take_rtt(&self.memory, &self.image).unwrap_or_default());
        // A zero ends each of the log's frames.
        let whole = self.log_bytes.iter().rposition(|byte| *byte == 0);
        let bytes: Vec<u8> = self
            .log_bytes
            .drain(..whole.map_or(0, |last| last + 1))
            .collect();
        let mut lines = Vec::new();
        let Some(table) = table else {
            return lines;
        };
        let mut decoder = table.new_stream_decoder();
        decoder.received(&bytes);
        loop {
            match decoder.decode() {
                Ok(frame) => {
                    let level = frame.level().map_or("", |level| level.as_str());
                    let level = level.to_uppercase();
                    lines.push(format!("{level:5} {}", frame.display_message()));
                }
                Err(DecodeError::UnexpectedEof) => return lines,
                Err(DecodeError::Malformed) => {
                    lines.push("(log bytes that are no defmt frame)".to_owned());
                }
            }
        }
    }
}

/// Takes the bytes that the firmware has written to RTT since the last call. Returns `None` if the firmware has
/// no RTT or has not prepared it yet.
fn take_rtt(memory: &Memory, image: &Image) -> Option<Vec<u8>> {
    let control = image.symbol("_SEGGER_RTT").ok()?.address;
    let mut magic = [0; 16];
    memory.read(control, &mut magic)?;
    if magic != *MAGIC || memory.word(control + 16)? == 0 {
        return None;
    }
    let word = |n: u32| memory.word(control + CHANNEL + 4 * n);
    let (buffer, size, write, read) = (word(1)?, word(2)?, word(3)?, word(4)?);
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
    memory.write(control + CHANNEL + 16, &write.to_le_bytes())?;
    Some(taken)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Symbol;
    use crate::memory::RAM_START;

    /// The test prepares RTT's control block and reads it like a debug probe.
    #[test]
    fn rtt_is_read_across_the_end_of_its_buffer() {
        let (memory, control, buffer) = (Memory::new(), RAM_START, RAM_START + 0x100);
        let symbol = Symbol {
            name: "_SEGGER_RTT".to_owned(),
            address: control,
            size: 48,
            function: false,
        };
        let image = Image::of_code(Vec::new(), vec![symbol]);
        assert_eq!(take_rtt(&memory, &image), None);
        let words = [1, 0, 0, buffer, 8, 2, 6, 0].map(u32::to_le_bytes).concat();
        let written = [
            memory.write(control, &[MAGIC, &*words].concat()),
            memory.write(buffer, b"cdXXXXab"),
        ];
        assert_eq!(written, [Some(()); 2]);
        assert_eq!(take_rtt(&memory, &image), Some(b"abcd".to_vec()));
        assert_eq!(take_rtt(&memory, &image), Some(Vec::new()));
    }
}
