//! The rivals for SBUS: `sbus`, `uf-sbus` and `sbus-rs`.

use sbus::{SBusPacket, SBusPacketParser};
use sbus_rs::StreamingParser;
use uf_sbus::SbusParser;

use crate::contender::{Contender, Entry};
use crate::streams::{Payload, Protocol};

pub(crate) const PROTOCOL: Protocol = Protocol {
    name: "SBUS",
    sync_dense: &[0x0F, 0, 0x0F, 0],
    length_at: 1,
    longest: 25,
    frame,
    key: |frame| key(channels(&frame[1..23])),
};

/// Makes a frame. Sixteen channels of eleven bits fill the payload.
fn frame(payload: &mut Payload) -> Vec<u8> {
    [&[0x0F][..], &payload.bytes(22), &[0, 0]].concat()
}

/// Unpacks the channels bit by bit. The first channel has the lowest bits.
fn channels(bytes: &[u8]) -> [u16; 16] {
    let bit = |place: usize| u16::from(bytes[place / 8] >> (place % 8) & 1);
    std::array::from_fn(|channel| {
        (0..11)
            .map(|place| bit(channel * 11 + place) << place)
            .sum()
    })
}

pub(crate) fn contenders() -> Vec<Entry> {
    vec![
        Entry::ours::<50, _>("framelock", framelock_formats::sbus::Sbus, |message| {
            key(message.channels)
        }),
        Entry::rival("uf-sbus", UfSbus::default, |packet| key(packet.channels)),
        Entry::rival("sbus-rs", SbusRs::default, |packet| key(packet.channels)),
        Entry::rival("sbus", Sbus::default, |packet| {
            key(private_channels(&packet))
        }),
    ]
}

/// Returns the channels, which the crate `sbus` shows only in its debug output.
fn private_channels(packet: &SBusPacket) -> [u16; 16] {
    let text = format!("{packet:?}");
    let list = text.split(['[', ']']).nth(1).expect("a list");
    let channels: Vec<u16> = list
        .split(", ")
        .map(|number| number.parse().expect("a number"))
        .collect();
    channels.try_into().expect("sixteen")
}

fn key(channels: [u16; 16]) -> Vec<u8> {
    channels.into_iter().flat_map(u16::to_le_bytes).collect()
}

/// `sbus`.
struct Sbus(SBusPacketParser);

impl Default for Sbus {
    fn default() -> Self {
        Self(SBusPacketParser::new())
    }
}

impl Contender for Sbus {
    type Message<'a> = SBusPacket;

    fn feed(&mut self, bytes: &[u8], mut found: impl FnMut(SBusPacket)) {
        self.0.push_bytes(bytes);
        while let Some(packet) = self.0.try_parse() {
            found(packet);
        }
    }
}

/// `uf-sbus`.
#[derive(Default)]
struct UfSbus(SbusParser);

impl Contender for UfSbus {
    type Message<'a> = uf_sbus::SbusPacket;

    fn feed(&mut self, bytes: &[u8], found: impl FnMut(uf_sbus::SbusPacket)) {
        self.0.iter_packets(bytes).flatten().for_each(found);
    }
}

/// `sbus-rs`.
#[derive(Default)]
struct SbusRs(StreamingParser);

impl Contender for SbusRs {
    type Message<'a> = sbus_rs::SbusPacket;

    fn feed(&mut self, bytes: &[u8], found: impl FnMut(sbus_rs::SbusPacket)) {
        self.0.push_bytes(bytes).flatten().for_each(found);
    }
}
