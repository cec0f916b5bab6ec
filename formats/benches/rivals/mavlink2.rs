//! The rival for MAVLink 2: `mavlink-core`.

use std::io::Read;

use crc::{CRC_16_MCRF4XX, Crc};
use framelock_formats::layout::KnownMessage;
use framelock_formats::mavlink::Mavlink2;
use mavlink_core::error::ParserError;
use mavlink_core::{Dialect, MAVLinkMessageRaw, MavlinkReader, MavlinkVersion};

use crate::contender::{Contender, Entry};
use crate::streams::{Payload, Protocol};

pub(crate) const PROTOCOL: Protocol = Protocol {
    name: "MAVLink 2",
    sync_dense: &[0xFD, 0xFD, 28, 0, 0, 1, 30],
    length_at: 1,
    longest: 280,
    frame,
    key: |frame| frame[10..frame.len() - 2].to_vec(),
};

/// The messages that are sent, from MAVLink's `common.xml`: HEARTBEAT, SYS_STATUS, GPS_RAW_INT, ATTITUDE,
/// GLOBAL_POSITION_INT, RC_CHANNELS, VFR_HUD, STATUSTEXT. Each entry has the number, the CRC extra, and the length of
/// the longest payload.
const MESSAGES: [(u8, u8, u8); 8] = [
    (0, 50, 9),
    (1, 124, 43),
    (24, 24, 52),
    (30, 39, 28),
    (33, 104, 28),
    (65, 118, 42),
    (74, 20, 20),
    (253, 83, 54),
];

/// The longest message of `common.xml`, ENCAPSULATED_DATA. The receivers know this message, but no stream contains it.
const LONGEST: (u8, u8, u8) = (131, 223, 255);

/// The sent messages and the longest message, in ascending order of their numbers.
pub(crate) const DIALECT: &[KnownMessage] = &{
    let [a, b, c, d, e, f, g, h] = MESSAGES;
    [
        known(a),
        known(b),
        known(c),
        known(d),
        known(e),
        known(f),
        known(g),
        known(LONGEST),
        known(h),
    ]
};

const fn known((number, extra, most): (u8, u8, u8)) -> KnownMessage {
    KnownMessage::with_extra(number as u32, extra, most)
}

/// Returns the CRC extra of a message.
fn extra(id: u32) -> Option<u8> {
    let known = DIALECT.iter().find(|known| known.number == id)?;
    known.extra
}

fn frame(payload: &mut Payload) -> Vec<u8> {
    let (id, extra, length) = payload.one_of(&MESSAGES);
    let contents = payload.bytes(length.into());
    let mut frame = vec![0xFD, length, 0, 0, contents[1], 1, 1, id, 0, 0];
    frame.extend(contents);
    let crc = Crc::<u16>::new(&CRC_16_MCRF4XX);
    let mut digest = crc.digest();
    digest.update(&frame[1..]);
    digest.update(&[extra]);
    frame.extend(digest.finalize().to_le_bytes());
    frame
}

pub(crate) fn contenders() -> Vec<Entry> {
    vec![
        Entry::ours::<560, _>("framelock", Mavlink2(DIALECT), |message| {
            message.payload.to_vec()
        }),
        Entry::rival("mavlink-core", MavlinkCore::default, |message| {
            message.payload().to_vec()
        }),
    ]
}

/// The same messages for `mavlink-core`, which does not decode the frames.
struct Known;

impl Dialect for Known {
    type Message = ();
    type EncodeError = mavlink_core::error::EncoderError;

    fn message_id(&self, (): &()) -> u32 {
        0
    }

    fn extra_crc(&self, message_id: u32) -> Option<u8> {
        extra(message_id)
    }

    fn decode(&self, _: MavlinkVersion, _: u32, _: &[u8]) -> Result<(), ParserError> {
        Ok(())
    }

    fn encode(&self, _: MavlinkVersion, (): &(), _: &mut [u8]) -> Result<usize, Self::EncodeError> {
        Ok(0)
    }
}

/// The bytes that have arrived but have not been read yet.
#[derive(Default)]
struct Source {
    bytes: Vec<u8>,
    read: usize,
}

impl Read for Source {
    #[inline]
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        let count = (&self.bytes[self.read..]).read(into)?;
        self.read += count;
        Ok(count)
    }
}

/// The crate `mavlink-core`, with its buffer of 16 KiB.
struct MavlinkCore(MavlinkReader<Source>);

impl Default for MavlinkCore {
    fn default() -> Self {
        Self(MavlinkReader::new(Source::default()))
    }
}

impl Contender for MavlinkCore {
    type Message<'a> = MAVLinkMessageRaw;

    fn feed(&mut self, bytes: &[u8], mut found: impl FnMut(MAVLinkMessageRaw)) {
        let source = self.0.get_mut();
        source.bytes.clear();
        source.bytes.extend_from_slice(bytes);
        source.read = 0;
        // The loop ends when the crate returns the source's error at the end of the bytes.
        while let Ok(raw) = self
            .0
            .read_raw_message_with_dialect(&Known, MavlinkVersion::V2)
        {
            found(raw);
        }
    }
}
