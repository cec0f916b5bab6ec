//! `mavlink-core`.
#![no_std]
#![no_main]

use core::convert::Infallible;
use core::hint::black_box;
use embedded_io::{ErrorType, Read};
use framelock_rivals_on_chip::{MESSAGES, Receiver, receiver};
use mavlink_core::error::{EncoderError, ParserError};
use mavlink_core::{Dialect, MavlinkReader, MavlinkVersion};

struct Known;

impl Dialect for Known {
    type Message = ();
    type EncodeError = EncoderError;

    fn message_id(&self, (): &()) -> u32 {
        0
    }

    fn extra_crc(&self, message_id: u32) -> Option<u8> {
        let place = MESSAGES.binary_search_by_key(&message_id, |message| message.number);
        Some(MESSAGES.get(place.ok()?)?.extra)
    }

    fn decode(&self, _: MavlinkVersion, _: u32, _: &[u8]) -> Result<(), ParserError> {
        Ok(())
    }

    fn encode(&self, _: MavlinkVersion, (): &(), _: &mut [u8]) -> Result<usize, EncoderError> {
        Ok(0)
    }
}

/// A byte that has come, if it is not read yet.
struct Source(Option<u8>);

impl ErrorType for Source {
    type Error = Infallible;
}

impl Read for Source {
    fn read(&mut self, into: &mut [u8]) -> Result<usize, Infallible> {
        match (into, self.0.take()) {
            ([first, ..], Some(byte)) => {
                *first = byte;
                Ok(1)
            }
            _ => Ok(0),
        }
    }
}

struct Rival(MavlinkReader<Source>);

impl Receiver for Rival {
    #[inline(never)]
    fn take(&mut self, byte: u8) -> u32 {
        self.0.get_mut().0 = Some(byte);
        let mut frames = 0;
        // It ends with the error that the source has no more.
        while let Ok(raw) = self
            .0
            .read_raw_message_with_dialect(&Known, MavlinkVersion::V2)
        {
            black_box(&raw);
            frames += 1;
        }
        frames
    }
}

receiver!(Rival(MavlinkReader::new(Source(None))));
