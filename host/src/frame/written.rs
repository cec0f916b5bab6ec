//! Frames as people and programs read them: JSON, comma-separated values, columns of text.

use std::borrow::Cow;
use std::io::{self, Write};

use super::Frame;

impl Frame {
    /// The header of comma-separated values.
    pub(crate) fn write_csv_header(&self, output: &mut impl Write) -> io::Result<()> {
        write!(output, "offset")?;
        if !self.has_setpoints() {
            write!(output, ",length")?;
        }
        for column in &self.columns {
            write!(output, ",{}", column.name)?;
        }
        writeln!(output)
    }

    /// The length of a frame, to be written where frames differ in it.
    fn length(&self, frame: &[u8]) -> Option<usize> {
        (!self.has_setpoints()).then_some(frame.len())
    }

    /// Writes a frame as comma-separated values; its last byte is at `offset`.
    pub(crate) fn write_csv(
        &self,
        output: &mut impl Write,
        offset: usize,
        frame: &[u8],
    ) -> io::Result<()> {
        write!(output, "{offset}")?;
        if let Some(length) = self.length(frame) {
            write!(output, ",{length}")?;
        }
        for field in self.described.values(frame) {
            let mut texts = field.texts();
            for _ in 0..field.count {
                write!(output, ",{}", quoted(&texts.next().unwrap_or_default()))?;
            }
        }
        writeln!(output)
    }

    /// Writes a frame as a JSON object.
    pub(crate) fn write_json(
        &self,
        output: &mut impl Write,
        offset: usize,
        frame: &[u8],
    ) -> io::Result<()> {
        write!(output, "{{\"offset\":{offset}")?;
        if let Some(length) = self.length(frame) {
            write!(output, ",\"length\":{length}")?;
        }
        for field in self.described.values(frame) {
            if let Some(value) = &field.value {
                write!(output, ",\"{}\":{value}", field.name)?;
            }
        }
        write!(output, "}}")
    }

    /// Writes a frame's length and its fields, in columns if they are small.
    pub(crate) fn write_text(&self, output: &mut impl Write, frame: &[u8]) -> io::Result<()> {
        if let Some(length) = self.length(frame) {
            write!(output, "   length {length:>3}")?;
        }
        let fields = self.described.values(frame);
        for field in fields.filter(|field| field.value.is_some()) {
            write!(output, "   {field}")?;
        }
        Ok(())
    }
}

/// Text between commas, in quotation marks if it could be taken for more.
fn quoted(text: &str) -> Cow<'_, str> {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\"")).into()
    } else {
        text.into()
    }
}
