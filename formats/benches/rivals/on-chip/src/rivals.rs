//! Receivers of other crates, and a receiver that does nothing. An adapter uses its crate as the crate's documentation
//! shows, and adds nothing.

/// Defines the entry point for a feature that selects a receiver: its type, its initial value, and how it takes a byte.
macro_rules! receiver {
    ($($feature:literal: $type:ty = $new:expr, |$own:ident, $byte:ident| $take:expr;)*) => {$(
        #[cfg(feature = $feature)]
        const _: () = {
            use core::hint::black_box;

            struct Rival($type);

            impl crate::Receiver for Rival {
                #[inline(never)]
                fn take(&mut self, $byte: u8) -> u32 {
                    let $own = &mut self.0;
                    $take
                }
            }

            #[cortex_m_rt::entry]
            fn main() -> ! {
                crate::receive(Rival($new))
            }
        };
    )*};
}

receiver! {
    // The benchmark subtracts the cost of this receiver from the costs of the others.
    "nothing": () = (), |_own, byte| {
        black_box(byte);
        0
    };
    "sbus-sbus": sbus::SBusPacketParser = sbus::SBusPacketParser::new(), |own, byte| {
        own.push_bytes(&[byte]);
        let mut frames = 0;
        while let Some(packet) = own.try_parse() {
            black_box(&packet);
            frames += 1;
        }
        frames
    };
    "sbus-sbus-rs": sbus_rs::StreamingParser = sbus_rs::StreamingParser::new(), |own, byte| {
        match own.push_byte(byte) {
            Ok(Some(packet)) => {
                black_box(&packet);
                1
            }
            _ => 0,
        }
    };
    "sbus-uf-sbus": uf_sbus::SbusParser = uf_sbus::SbusParser::new(), |own, byte| {
        match own.push_byte(byte) {
            Some(Ok(packet)) => {
                black_box(&packet);
                1
            }
            _ => 0,
        }
    };
    // This crate checks and decodes the 32 bytes that a textbook state machine finds.
    "ibus-parse_rc_ibus": ([u8; 32], usize) = ([0; 32], 0), |own, byte| {
        let (bytes, taken) = own;
        bytes[*taken] = byte;
        *taken = match (*taken, byte) {
            (0, 0x20) => 1,
            (1, 0x40) => 2,
            (2.., _) => *taken + 1,
            _ => 0,
        };
        if *taken < 32 {
            return 0;
        }
        *taken = 0;
        u32::from(black_box(&parse_rc_ibus::IbusPacket::try_from_bytes(bytes)).is_ok())
    };
    "crsf-crsf": crsf::PacketParser<64> = crsf::PacketParser::new(), |own, byte| {
        own.push_bytes(&[byte]);
        let mut frames = 0;
        while let Some(result) = own.next_raw_packet() {
            let Ok(raw) = result else { continue };
            match black_box(&crsf::Packet::from_raw(&raw)) {
                Ok(_) | Err(crsf::PacketError::UnknownType { .. }) => frames += 1,
                Err(_) => {}
            }
        }
        frames
    };
    "crsf-uf-crsf": uf_crsf::CrsfParser = uf_crsf::CrsfParser::new(), |own, byte| {
        let mut bytes = &[byte][..];
        let mut frames = 0;
        while let Some(result) = own.next_raw_packet(&mut bytes) {
            frames += u32::from(black_box(&result).is_ok());
        }
        frames
    };
    "ubx-ublox": ublox::Parser<ublox::FixedBuffer<106>, ubx::FramesOnly> = ublox::Parser::with_fixed_buffer(), |own, byte| {
        let bytes = [byte];
        let mut packets = own.consume_ubx(&bytes);
        let mut frames = 0;
        while let Some(result) = packets.next() {
            frames += u32::from(black_box(&result).is_ok());
        }
        frames
    };
    "mavlink2-mavlink-core": mavlink_core::MavlinkReader<mavlink::Source> =
        mavlink_core::MavlinkReader::new(mavlink::Source(None)), |own, byte| {
        own.get_mut().0 = Some(byte);
        let mut frames = 0;
        // The loop ends when the crate returns the source's error at the end of the bytes.
        while let Ok(raw) =
            own.read_raw_message_with_dialect(&mavlink::Known, mavlink_core::MavlinkVersion::V2)
        {
            black_box(&raw);
            frames += 1;
        }
        frames
    };
}

#[cfg(feature = "ubx-ublox")]
mod ubx {
    use ublox::proto23::PacketRef;
    use ublox::{ParserError, UbxProtocol, UbxUnknownPacketRef};

    /// A protocol version for `ublox` that states the longest payload and does not decode messages.
    pub(crate) struct FramesOnly;

    impl UbxProtocol for FramesOnly {
        type PacketRef<'a> = PacketRef<'a>;
        const MAX_PAYLOAD_LEN: u16 = 98;

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

#[cfg(feature = "mavlink2-mavlink-core")]
mod mavlink {
    use core::convert::Infallible;

    use embedded_io::{ErrorType, Read};
    use mavlink_core::error::{EncoderError, ParserError};
    use mavlink_core::{Dialect, MavlinkVersion};

    use crate::MESSAGES;

    pub(crate) struct Known;

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

    /// The byte that has arrived, or `None` if the crate has already read it.
    pub(crate) struct Source(pub(crate) Option<u8>);

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
}
