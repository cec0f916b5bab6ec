use crate::layout::{Algorithm, Checksum, Crc, Layout, Patterns};

/// What a [`Bin`](framelock::motion::Bin) frame looks like, for receivers of any layout.
pub const BIN: Layout<'static> = Layout {
    sync: Patterns::one(b"AB"),
    shortest: 7,
    longest: 7,
    terminator: Patterns::one(b"\r"),
    ..Layout::NONE
};

/// What a [`BinCrc8`](framelock::motion::BinCrc8) frame looks like, for receivers of any layout.
pub const BIN_CRC8: Layout<'static> = Layout {
    shortest: 8,
    longest: 8,
    checksum: Some(Checksum {
        algorithm: Algorithm::Crc(Crc {
            polynomial: 0x2F,
            initial: 0xFF,
            xor_out: 0xFF,
            ..Crc::ZERO
        }),
        at: -2,
        from: 2,
        to: -3,
        ..Checksum::at_the_end(1)
    }),
    ..BIN
};
