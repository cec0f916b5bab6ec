//! Frames as people and programs read them: JSON, comma-separated values, columns of text.

use std::io::{self, Write};
use std::time::Duration;

use csv::{IntoInnerError, WriterBuilder};

use super::Frame;

/// Room for most rows of comma-separated values; longer ones are written in pieces.
const ROW_LENGTH: usize = 256;

/// Where in a stream a frame's last byte is, and when it came, if that is to be written.
#[derive(Clone, Copy)]
pub(crate) struct Place {
    pub(crate) offset: usize,
    pub(crate) time: Option<Duration>,
}

impl Frame {
    /// The header of comma-separated values.
    pub(crate) fn write_csv_header(
        &self,
        output: &mut impl Write,
        has_time: bool,
    ) -> io::Result<()> {
        write!(output, "{}offset", if has_time { "time," } else { "" })?;
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

    /// Writes a frame as comma-separated values.
    pub(crate) fn write_csv(
        &self,
        output: &mut impl Write,
        place: &Place,
        frame: &[u8],
    ) -> io::Result<()> {
        let mut row = WriterBuilder::new()
            .buffer_capacity(ROW_LENGTH)
            .from_writer(Vec::new());
        if let Some(time) = place.time {
            row.write_field(format!("{:.6}", time.as_secs_f64()))?;
        }
        row.write_field(place.offset.to_string())?;
        if let Some(length) = self.length(frame) {
            row.write_field(length.to_string())?;
        }
        for field in self.described.values(frame) {
            let mut texts = field.texts();
            for _ in 0..field.count {
                row.write_field(&*texts.next().unwrap_or_default())?;
            }
        }
        row.write_record(None::<&[u8]>)?;
        let row = row.into_inner().map_err(IntoInnerError::into_error)?;
        output.write_all(&row)
    }

    /// Writes a frame as a JSON object.
    pub(crate) fn write_json(
        &self,
        output: &mut impl Write,
        place: &Place,
        frame: &[u8],
    ) -> io::Result<()> {
        write!(output, "{{")?;
        if let Some(time) = place.time {
            write!(output, "\"time\":{:.6},", time.as_secs_f64())?;
        }
        write!(output, "\"offset\":{}", place.offset)?;
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

    /// Writes a frame as columns for people to read.
    pub(crate) fn write_columns(
        &self,
        output: &mut impl Write,
        place: &Place,
        frame: &[u8],
    ) -> io::Result<()> {
        if let Some(time) = place.time {
            write!(output, "{:>13.6} s  ", time.as_secs_f64())?;
        }
        write!(output, "byte {:>10}", place.offset)?;
        self.write_text(output, frame)
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
