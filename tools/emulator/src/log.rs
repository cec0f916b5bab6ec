//! defmt logs: the bytes from RTT, made readable with the texts in the ELF.

use defmt_decoder::{DecodeError, StreamDecoder, Table};

use crate::error::{Error, Result};

/// The log's texts, as the ELF has them.
pub struct LogTable {
    table: Option<Table>,
}

impl LogTable {
    /// Reads the ELF. Firmware without defmt has an empty table, and no log.
    ///
    /// # Errors
    /// If the ELF is broken, or was made with another version of defmt's format.
    pub fn parse(elf: &[u8]) -> Result<Self> {
        let table = Table::parse(elf).map_err(|error| Error::Image(format!("{error:#}")))?;
        Ok(Self { table })
    }

    /// A decoder for one stream of bytes.
    #[must_use]
    pub fn decoder(&self) -> LogDecoder<'_> {
        LogDecoder {
            decoder: self.table.as_ref().map(Table::new_stream_decoder),
        }
    }
}

/// Makes log lines from bytes.
pub struct LogDecoder<'table> {
    decoder: Option<Box<dyn StreamDecoder + Send + Sync + 'table>>,
}

impl LogDecoder<'_> {
    /// Takes the next bytes; returns the lines that are complete with them: level and text. What
    /// cannot be decoded is said as a line.
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
                    // Without separators between frames there is no way on.
                    if lines.len() > bytes.len() {
                        break;
                    }
                }
            }
        }
        lines
    }
}
