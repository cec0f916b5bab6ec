//! The rivals for CRSF: `crsf` and `uf-crsf`.

use crc::{CRC_8_DVB_S2, Crc};
use crsf::{Packet, PacketError, PacketParser, RawPacket};
use framelock_formats::crsf::{Crsf, Message};
use uf_crsf::CrsfParser;

use crate::contender::{Contender, Entry};
use crate::streams::{Payload, Protocol};

pub(crate) const PROTOCOL: Protocol = Protocol {
    name: "CRSF",
    sync_dense: &[0xC8, 0xC8, 24, 12, 0x16, 62],
    length_at: 1,
    longest: 64,
    frame,
    key: inside,
};

/// Makes a frame of a random kind: channels, link statistics, GPS, battery, attitude, or a parameter entry. The longest
/// parameter entry fills the longest frame.
fn frame(payload: &mut Payload) -> Vec<u8> {
    let (kind, length) = payload.one_of(&[
        (0x16, 22),
        (0x16, 22),
        (0x16, 22),
        (0x14, 10),
        (0x02, 15),
        (0x08, 8),
        (0x1E, 6),
        (0x2B, 37),
        (0x2B, 60),
    ]);
    let mut checked = vec![kind];
    checked.extend(payload.bytes(length));
    let check = Crc::<u8>::new(&CRC_8_DVB_S2).checksum(&checked);
    let behind = u8::try_from(checked.len() + 1).expect("at most 62");
    [&[0xC8, behind], &checked[..], &[check]].concat()
}

pub(crate) fn contenders() -> Vec<Entry> {
    let ours = |message: Message| [&[message.kind], message.payload].concat();
    vec![
        Entry::ours::<128, _>("framelock", Crsf, ours),
        Entry::rival("uf-crsf", UfCrsf::default, |raw| inside(raw.as_slice())),
        Entry::rival("crsf", CrsfCrate::default, |raw| inside(raw.data())),
    ]
}

/// Returns the kind and the payload.
fn inside(frame: &[u8]) -> Vec<u8> {
    frame[2..frame.len() - 1].to_vec()
}

/// The crate `crsf`. It does not check raw packets, so the adapter decodes each packet. If the crate does not know the
/// kind of a packet, the packet counts as delivered. The crate panics on a packet of channels or link statistics that
/// is too short. After a lost byte, such a packet may arrive with a correct check, so the adapter does not decode
/// packets that are too short.
struct CrsfCrate(PacketParser<64>);

impl Default for CrsfCrate {
    fn default() -> Self {
        Self(PacketParser::new())
    }
}

impl Contender for CrsfCrate {
    type Message<'a> = RawPacket;

    fn feed(&mut self, bytes: &[u8], mut found: impl FnMut(RawPacket)) {
        self.0.push_bytes(bytes);
        while let Some(result) = self.0.next_raw_packet() {
            let Ok(raw) = result else { continue };
            if matches!(raw.data(), [_, _, 0x16, payload @ .., _] if payload.len() < 22)
                || matches!(raw.data(), [_, _, 0x14, payload @ .., _] if payload.len() < 10)
            {
                continue;
            }
            match Packet::from_raw(&raw) {
                Ok(_) | Err(PacketError::UnknownType { .. }) => found(raw),
                Err(_) => {}
            }
        }
    }
}

/// The crate `uf-crsf`, whose raw packets are already checked.
#[derive(Default)]
struct UfCrsf(CrsfParser);

impl Contender for UfCrsf {
    type Message<'a> = uf_crsf::parser::RawCrsfPacket<'a>;

    fn feed(&mut self, mut bytes: &[u8], mut found: impl FnMut(Self::Message<'_>)) {
        while let Some(result) = self.0.next_raw_packet(&mut bytes) {
            if let Ok(raw) = result {
                found(raw);
            }
        }
    }
}
