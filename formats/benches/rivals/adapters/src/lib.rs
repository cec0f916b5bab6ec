//! The crates that are compared with framelock, behind one interface. An adapter uses its crate as the crate's
//! documentation shows, and adds only what the crate leaves to its user.
#![no_std]
#![allow(
    clippy::doc_markdown,
    clippy::indexing_slicing,
    clippy::cast_possible_truncation,
    reason = "MAVLink is a name; iBUS's adapter indexes its array as a textbook would; a portion has at most 64 bytes"
)]

#[cfg(feature = "std")]
extern crate std;

/// A receiver of a protocol's frames.
pub trait Contender {
    /// The data that the receiver returns to its user.
    type Message<'a>;

    /// Takes the next bytes of the stream, and calls `found` for each frame.
    fn feed(&mut self, bytes: &[u8], found: impl FnMut(Self::Message<'_>));

    /// Takes a single byte.
    #[inline]
    fn push(&mut self, byte: u8, found: impl FnMut(Self::Message<'_>)) {
        self.feed(&[byte], found);
    }
}

/// Defines adapters. Each has a feature, a name, a parser with its initial value, the messages, an expression that
/// takes bytes, and optionally an expression that takes a single byte.
macro_rules! adapters {
    ($(
        $(#[$doc:meta])*
        $feature:literal $name:ident($parser:ty) = $new:expr,
        <$a:lifetime> $message:ty, |$own:ident, $bytes:ident, $found:ident| $take:expr
        $(, |$byte:ident| $take_one:expr)?;
    )*) => {$(
        $(#[$doc])*
        #[cfg(feature = $feature)]
        pub struct $name($parser);

        #[cfg(feature = $feature)]
        impl Default for $name {
            fn default() -> Self {
                Self($new)
            }
        }

        #[cfg(feature = $feature)]
        impl Contender for $name {
            type Message<$a> = $message;

            #[inline]
            #[allow(unused_mut, reason = "some adapters pass it on")]
            fn feed(&mut self, $bytes: &[u8], mut $found: impl FnMut(Self::Message<'_>)) {
                let $own = &mut self.0;
                $take
            }

            $(
                #[inline]
                fn push(&mut self, $byte: u8, mut $found: impl FnMut(Self::Message<'_>)) {
                    let $own = &mut self.0;
                    $take_one
                }
            )?
        }
    )*};
}

adapters! {
    /// `sbus`.
    "sbus" Sbus(sbus::SBusPacketParser) = sbus::SBusPacketParser::new(),
    <'a> sbus::SBusPacket, |own, bytes, found| {
        own.push_bytes(bytes);
        while let Some(packet) = own.try_parse() {
            found(packet);
        }
    };

    /// `sbus-rs`.
    "sbus-rs" SbusRs(sbus_rs::StreamingParser) = sbus_rs::StreamingParser::new(),
    <'a> sbus_rs::SbusPacket, |own, bytes, found| {
        own.push_bytes(bytes).flatten().for_each(found);
    }, |byte| {
        if let Ok(Some(packet)) = own.push_byte(byte) {
            found(packet);
        }
    };

    /// `uf-sbus`.
    "uf-sbus" UfSbus(uf_sbus::SbusParser) = uf_sbus::SbusParser::new(),
    <'a> uf_sbus::SbusPacket, |own, bytes, found| {
        own.iter_packets(bytes).flatten().for_each(found);
    }, |byte| {
        if let Some(Ok(packet)) = own.push_byte(byte) {
            found(packet);
        }
    };

    /// `parse_rc_ibus`, which checks and decodes frames but does not find them. A textbook state machine waits for the
    /// bytes 0x20 and 0x40, takes thirty more bytes, and starts again, whether the frame is valid or not.
    "parse_rc_ibus" Textbook(([u8; 32], usize)) = ([0; 32], 0),
    <'a> parse_rc_ibus::IbusPacket, |own, bytes, found| {
        let (frame, taken) = own;
        for &byte in bytes {
            frame[*taken] = byte;
            *taken = match (*taken, byte) {
                (0, 0x20) => 1,
                (1, 0x40) => 2,
                (2.., _) => *taken + 1,
                _ => 0,
            };
            if *taken == 32 {
                *taken = 0;
                if let Ok(packet) = parse_rc_ibus::IbusPacket::try_from_bytes(frame) {
                    found(packet);
                }
            }
        }
    };

    /// `cobs`. Its decoder does not check packets, and does not wait for the first delimiter.
    "cobs" Cobs((cobs::DecoderState, Packet)) = (cobs::DecoderState::default(), Packet::EMPTY),
    <'a> &'a [u8], |own, bytes, found| {
        let (state, packet) = own;
        for &byte in bytes {
            match state.feed(byte) {
                Ok(cobs::DecodeResult::DataStart) => packet.length = 0,
                Ok(cobs::DecodeResult::DataContinue(byte)) if packet.push(byte) => {}
                Ok(cobs::DecodeResult::DataComplete) => found(packet.bytes()),
                Ok(cobs::DecodeResult::NoData) => {}
                _ => *state = cobs::DecoderState::default(),
            }
        }
    };

    /// `serial-line-ip`. Its decoder decodes one packet, which begins with a delimiter. So the adapter makes a new
    /// decoder after each packet, and after each error.
    "serial-line-ip" SerialLineIp((serial_line_ip::Decoder, Packet)) = (serial_line_ip::Decoder::new(), Packet::EMPTY),
    <'a> &'a [u8], |own, bytes, found| {
        let (decoder, packet) = own;
        for &byte in bytes {
            let free = &mut packet.buffer[packet.length..];
            match decoder.decode(&[byte], free) {
                Ok((1, written, false)) => packet.length += written.len(),
                Ok((1, _, true)) => {
                    if packet.length > 0 {
                        found(packet.bytes());
                    }
                    (*decoder, packet.length) = (serial_line_ip::Decoder::new(), 0);
                }
                _ => (*decoder, packet.length) = (serial_line_ip::Decoder::new(), 0),
            }
        }
    };

    /// `crsf`. It does not check raw packets, so the adapter decodes each packet. If the crate does not know the kind
    /// of a packet, the packet counts as delivered. The crate panics on a packet of channels or link statistics that is
    /// too short. After a lost byte, such a packet may arrive with a correct check, so the adapter does not decode
    /// packets that are too short.
    "crsf" Crsf(crsf::PacketParser<64>) = crsf::PacketParser::new(),
    <'a> crsf::RawPacket, |own, bytes, found| {
        own.push_bytes(bytes);
        while let Some(result) = own.next_raw_packet() {
            let Ok(raw) = result else { continue };
            if matches!(raw.data(), [_, _, 0x16, payload @ .., _] if payload.len() < 22)
                || matches!(raw.data(), [_, _, 0x14, payload @ .., _] if payload.len() < 10)
            {
                continue;
            }
            match crsf::Packet::from_raw(&raw) {
                Ok(_) | Err(crsf::PacketError::UnknownType { .. }) => found(raw),
                Err(_) => {}
            }
        }
    };

    /// `uf-crsf`, whose raw packets are already checked.
    "uf-crsf" UfCrsf(uf_crsf::CrsfParser) = uf_crsf::CrsfParser::default(),
    <'a> uf_crsf::parser::RawCrsfPacket<'a>, |own, bytes, found| {
        let mut rest = bytes;
        while let Some(result) = own.next_raw_packet(&mut rest) {
            if let Ok(raw) = result {
                found(raw);
            }
        }
    };

    /// `ublox`.
    "ublox" Ublox(ublox::Parser<ublox::FixedBuffer<UBX_LONGEST>, ubx::FramesOnly>) = ublox::Parser::with_fixed_buffer(),
    <'a> ublox::UbxPacket<'a>, |own, bytes, found| {
        let mut packets = own.consume_ubx(bytes);
        while let Some(result) = packets.next() {
            if let Ok(packet) = result {
                found(packet);
            }
        }
    };
}

/// The length of the longest packet of COBS and SLIP that framelock's receivers accept.
pub const PACKET_LONGEST: usize = 64;

/// The buffer of a packet, for decoders that have none.
#[cfg(any(feature = "cobs", feature = "serial-line-ip"))]
pub struct Packet {
    buffer: [u8; PACKET_LONGEST + 1],
    length: usize,
}

#[cfg(any(feature = "cobs", feature = "serial-line-ip"))]
impl Packet {
    const EMPTY: Self = Self {
        buffer: [0; PACKET_LONGEST + 1],
        length: 0,
    };

    /// Adds a byte. Returns whether there was room.
    #[cfg(feature = "cobs")]
    fn push(&mut self, byte: u8) -> bool {
        let place = self.buffer.get_mut(self.length);
        self.length += usize::from(place.is_some());
        place.map(|place| *place = byte).is_some()
    }

    fn bytes(&self) -> &[u8] {
        &self.buffer[..self.length.min(self.buffer.len())]
    }
}

/// The length of the longest UBX frame that the receivers accept. Its payload has 0x62 bytes, and 0x62 is also a sync
/// byte. So the length byte of one false start can be a sync byte of another false start, and false starts are as dense
/// as possible.
pub const UBX_LONGEST: usize = 0x62 + 8;

#[cfg(feature = "ublox")]
mod ubx {
    use ublox::proto23::PacketRef;
    use ublox::{ParserError, UbxProtocol, UbxUnknownPacketRef};

    /// A protocol version for `ublox` that states the longest payload and does not decode messages. With the crate's
    /// own protocol versions, the crate would also decode messages, and would wait for the end of false frames of over
    /// a thousand bytes.
    pub struct FramesOnly;

    impl UbxProtocol for FramesOnly {
        type PacketRef<'a> = PacketRef<'a>;
        const MAX_PAYLOAD_LEN: u16 = 0x62;

        fn match_packet(
            class: u8,
            msg_id: u8,
            payload: &[u8],
        ) -> Result<PacketRef<'_>, ParserError> {
            Ok(PacketRef::Unknown(UbxUnknownPacketRef {
                payload,
                class,
                msg_id,
            }))
        }
    }
}

#[cfg(feature = "mavlink-core")]
pub mod mavlink2 {
    //! `mavlink-core`.

    use framelock_formats::layout::KnownMessage;
    use mavlink_core::error::{EncoderError, ParserError};
    use mavlink_core::{Dialect, MAVLinkMessageRaw, MavlinkReader, MavlinkVersion};

    use crate::Contender;

    /// Messages from MAVLink's `common.xml`, in ascending order of their numbers: HEARTBEAT, SYS_STATUS, GPS_RAW_INT,
    /// ATTITUDE, GLOBAL_POSITION_INT, RC_CHANNELS, VFR_HUD, ENCAPSULATED_DATA, STATUSTEXT. Each entry has the number,
    /// the CRC extra, and the length of the longest payload.
    pub const MESSAGES: &[KnownMessage] = &[
        KnownMessage::with_extra(0, 50, 9),
        KnownMessage::with_extra(1, 124, 43),
        KnownMessage::with_extra(24, 24, 52),
        KnownMessage::with_extra(30, 39, 28),
        KnownMessage::with_extra(33, 104, 28),
        KnownMessage::with_extra(65, 118, 42),
        KnownMessage::with_extra(74, 20, 20),
        KnownMessage::with_extra(131, 223, 255),
        KnownMessage::with_extra(253, 83, 54),
    ];

    /// The known messages as a dialect of `mavlink-core`. Frames are not decoded.
    struct Known;

    impl Dialect for Known {
        type Message = ();
        type EncodeError = EncoderError;

        fn message_id(&self, (): &()) -> u32 {
            0
        }

        fn extra_crc(&self, message_id: u32) -> Option<u8> {
            let place = MESSAGES.binary_search_by_key(&message_id, |message| message.number);
            MESSAGES.get(place.ok()?)?.extra
        }

        fn decode(&self, _: MavlinkVersion, _: u32, _: &[u8]) -> Result<(), ParserError> {
            Ok(())
        }

        fn encode(&self, _: MavlinkVersion, (): &(), _: &mut [u8]) -> Result<usize, EncoderError> {
            Ok(0)
        }
    }

    /// Up to `N` bytes that have arrived. The bytes from `begin` to `end` have not been read yet.
    struct Source<const N: usize> {
        bytes: [u8; N],
        begin: u8,
        end: u8,
    }

    #[cfg(feature = "std")]
    impl<const N: usize> std::io::Read for Source<N> {
        #[inline]
        fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
            let mut left = &self.bytes[self.begin.into()..self.end.into()];
            let count = left.read(into)?;
            self.begin += count as u8;
            Ok(count)
        }
    }

    #[cfg(feature = "embedded")]
    impl<const N: usize> embedded_io::ErrorType for Source<N> {
        type Error = core::convert::Infallible;
    }

    #[cfg(feature = "embedded")]
    impl<const N: usize> embedded_io::Read for Source<N> {
        #[inline]
        fn read(&mut self, into: &mut [u8]) -> Result<usize, Self::Error> {
            // On the chip, there is never more than one byte.
            match into {
                [first, ..] if self.begin < self.end => {
                    *first = self.bytes[0];
                    self.begin = self.end;
                    Ok(1)
                }
                _ => Ok(0),
            }
        }
    }

    /// `mavlink-core`, which gets the bytes in portions of at most `N` bytes.
    pub struct MavlinkCore<const N: usize>(MavlinkReader<Source<N>>);

    impl<const N: usize> Default for MavlinkCore<N> {
        fn default() -> Self {
            Self(MavlinkReader::new(Source {
                bytes: [0; N],
                begin: 0,
                end: 0,
            }))
        }
    }

    impl<const N: usize> MavlinkCore<N> {
        #[inline]
        fn receive(&mut self, count: u8, mut found: impl FnMut(MAVLinkMessageRaw)) {
            let source = self.0.get_mut();
            (source.begin, source.end) = (0, count);
            // When the source has no more bytes, the crate returns an error.
            while let Ok(raw) = self
                .0
                .read_raw_message_with_dialect(&Known, MavlinkVersion::V2)
            {
                found(raw);
            }
        }
    }

    impl<const N: usize> Contender for MavlinkCore<N> {
        type Message<'a> = MAVLinkMessageRaw;

        #[inline]
        fn feed(&mut self, bytes: &[u8], mut found: impl FnMut(MAVLinkMessageRaw)) {
            for portion in bytes.chunks(N) {
                self.0.get_mut().bytes[..portion.len()].copy_from_slice(portion);
                self.receive(portion.len() as u8, &mut found);
            }
        }

        #[inline]
        fn push(&mut self, byte: u8, found: impl FnMut(MAVLinkMessageRaw)) {
            self.0.get_mut().bytes[0] = byte;
            self.receive(1, found);
        }
    }
}
