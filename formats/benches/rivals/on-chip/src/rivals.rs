//! Receivers of other crates, and a receiver that does nothing. An adapter uses its crate as the crate's documentation
//! shows, and adds nothing.

/// A receiver that does nothing. The benchmark subtracts the cost of this receiver from the costs of the others.
#[cfg(feature = "nothing")]
mod nothing {
    use core::hint::black_box;

    use crate::Receiver;

    struct Nothing;

    impl Receiver for Nothing {
        #[inline(never)]
        fn take(&mut self, byte: u8) -> u32 {
            black_box(byte);
            0
        }
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        crate::receive(Nothing)
    }
}

/// `sbus`.
#[cfg(feature = "sbus-sbus")]
mod sbus {
    use crate::Receiver;
    use core::hint::black_box;
    use sbus::SBusPacketParser;

    struct Rival(SBusPacketParser);

    impl Receiver for Rival {
        #[inline(never)]
        fn take(&mut self, byte: u8) -> u32 {
            self.0.push_bytes(&[byte]);
            let mut frames = 0;
            while let Some(packet) = self.0.try_parse() {
                black_box(&packet);
                frames += 1;
            }
            frames
        }
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        crate::receive(Rival(SBusPacketParser::new()))
    }
}

/// `sbus-rs`.
#[cfg(feature = "sbus-sbus-rs")]
mod sbus_rs {
    use crate::Receiver;
    use core::hint::black_box;
    use sbus_rs::StreamingParser;

    struct Rival(StreamingParser);

    impl Receiver for Rival {
        #[inline(never)]
        fn take(&mut self, byte: u8) -> u32 {
            match self.0.push_byte(byte) {
                Ok(Some(packet)) => {
                    black_box(&packet);
                    1
                }
                _ => 0,
            }
        }
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        crate::receive(Rival(StreamingParser::new()))
    }
}

/// `uf-sbus`.
#[cfg(feature = "sbus-uf-sbus")]
mod uf_sbus {
    use crate::Receiver;
    use core::hint::black_box;
    use uf_sbus::SbusParser;

    struct Rival(SbusParser);

    impl Receiver for Rival {
        #[inline(never)]
        fn take(&mut self, byte: u8) -> u32 {
            match self.0.push_byte(byte) {
                Some(Ok(packet)) => {
                    black_box(&packet);
                    1
                }
                _ => 0,
            }
        }
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        crate::receive(Rival(SbusParser::new()))
    }
}

/// `parse_rc_ibus`, which checks and decodes the 32 bytes that a textbook state machine finds.
#[cfg(feature = "ibus-parse_rc_ibus")]
mod parse_rc_ibus {
    use crate::Receiver;
    use core::hint::black_box;
    use parse_rc_ibus::IbusPacket;

    struct Textbook {
        bytes: [u8; 32],
        taken: usize,
    }

    impl Receiver for Textbook {
        #[inline(never)]
        fn take(&mut self, byte: u8) -> u32 {
            self.bytes[self.taken] = byte;
            self.taken = match (self.taken, byte) {
                (0, 0x20) => 1,
                (1, 0x40) => 2,
                (2.., _) => self.taken + 1,
                _ => 0,
            };
            if self.taken < 32 {
                return 0;
            }
            self.taken = 0;
            u32::from(black_box(&IbusPacket::try_from_bytes(&self.bytes)).is_ok())
        }
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        crate::receive(Textbook {
            bytes: [0; 32],
            taken: 0,
        })
    }
}

/// `crsf`.
#[cfg(feature = "crsf-crsf")]
mod crsf {
    use crate::Receiver;
    use core::hint::black_box;
    use crsf::{Packet, PacketError, PacketParser};

    struct Rival(PacketParser<64>);

    impl Receiver for Rival {
        #[inline(never)]
        fn take(&mut self, byte: u8) -> u32 {
            self.0.push_bytes(&[byte]);
            let mut frames = 0;
            while let Some(result) = self.0.next_raw_packet() {
                let Ok(raw) = result else { continue };
                match black_box(&Packet::from_raw(&raw)) {
                    Ok(_) | Err(PacketError::UnknownType { .. }) => frames += 1,
                    Err(_) => {}
                }
            }
            frames
        }
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        crate::receive(Rival(PacketParser::new()))
    }
}

/// `uf-crsf`.
#[cfg(feature = "crsf-uf-crsf")]
mod uf_crsf {
    use crate::Receiver;
    use core::hint::black_box;
    use uf_crsf::CrsfParser;

    struct Rival(CrsfParser);

    impl Receiver for Rival {
        #[inline(never)]
        fn take(&mut self, byte: u8) -> u32 {
            let mut bytes = &[byte][..];
            let mut frames = 0;
            while let Some(result) = self.0.next_raw_packet(&mut bytes) {
                frames += u32::from(black_box(&result).is_ok());
            }
            frames
        }
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        crate::receive(Rival(CrsfParser::new()))
    }
}

/// `ublox`.
#[cfg(feature = "ubx-ublox")]
mod ublox {
    use crate::Receiver;
    use core::hint::black_box;
    use ublox::proto23::PacketRef;
    use ublox::{FixedBuffer, Parser, ParserError, UbxProtocol, UbxUnknownPacketRef};

    /// A protocol version for `ublox` that states the longest payload and does not decode messages.
    struct FramesOnly;

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

    struct Rival(Parser<FixedBuffer<106>, FramesOnly>);

    impl Receiver for Rival {
        #[inline(never)]
        fn take(&mut self, byte: u8) -> u32 {
            let bytes = [byte];
            let mut packets = self.0.consume_ubx(&bytes);
            let mut frames = 0;
            while let Some(result) = packets.next() {
                frames += u32::from(black_box(&result).is_ok());
            }
            frames
        }
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        crate::receive(Rival(Parser::with_fixed_buffer()))
    }
}

/// `mavlink-core`.
#[cfg(feature = "mavlink2-mavlink-core")]
mod mavlink_core {
    use crate::{MESSAGES, Receiver};
    use core::convert::Infallible;
    use core::hint::black_box;
    use embedded_io::{ErrorType, Read};
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

    /// The byte that has arrived, or `None` if the crate has already read it.
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
            // The loop ends when the crate returns the source's error at the end of the bytes.
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

    #[cortex_m_rt::entry]
    fn main() -> ! {
        crate::receive(Rival(MavlinkReader::new(Source(None))))
    }
}
