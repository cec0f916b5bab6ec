//! Byte stuffing: how a sender marks the ends of packets whose content may have any bytes.

use crate::Format;

/// The way in which a sender separates packets.
///
/// The *delimiter* is a byte, a pair of bytes or a break, and never occurs within a sent packet. The sender replaces
/// or doubles the bytes of the packet that look like a delimiter. This is called *byte stuffing*. A
/// [`PacketReceiver`](crate::PacketReceiver) undoes the stuffing.
///
/// | protocol | stuffing |
/// |---|---|
/// | SLIP, KISS | [`Stuffing::SLIP`] |
/// | HDLC and PPP on a UART, `XBee` in API mode 2, S.Port | [`Stuffing::HDLC`] |
/// | Consistent Overhead Byte Stuffing | [`Stuffing::Cobs`] |
/// | DLE STX … DLE ETX | [`Stuffing::DLE`] |
/// | TSIP, Garmin: DLE, packet, DLE ETX | `Doubled { escape: 0x10, start: None, end: 0x03 }` |
/// | DMX512 | [`Stuffing::Break`] |
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Stuffing {
    /// The delimiter stands between packets. The escape byte and the code after it stand for one byte. `delimiter` and
    /// `escape` must differ.
    Escape {
        /// The byte between packets.
        delimiter: u8,
        /// The byte that begins an escape sequence.
        escape: u8,
        /// The codes that may follow the escape byte.
        codes: Codes,
    },
    /// Consistent Overhead Byte Stuffing. The delimiter is 0.
    Cobs,
    /// DLE framing: a packet begins with `escape start` and ends with `escape end`. Between them, `escape escape`
    /// stands for one escape byte. `escape`, `start` and `end` must differ.
    Doubled {
        /// The byte DLE.
        escape: u8,
        /// The code that begins a packet. `None`: each code except `escape` and `end` begins a packet, and is the
        /// packet's first byte.
        start: Option<u8>,
        /// The code that ends a packet.
        end: u8,
    },
    /// A break on the line ([`LineEvent::Break`](crate::LineEvent::Break)) stands between packets. All bytes stand for
    /// themselves.
    Break,
}

/// The codes that may follow the escape byte of [`Stuffing::Escape`].
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Codes {
    /// Each byte except the delimiter is a code. It stands for its XOR with this number.
    Xor(u8),
    /// Only these two codes may follow the escape byte.
    Pair {
        /// The code for the delimiter.
        delimiter: u8,
        /// The code for the escape byte.
        escape: u8,
    },
}

/// A format of packets between delimiters. [`classify`](Format::classify), [`decode`](Format::decode) and
/// [`LONGEST`](Format::LONGEST) concern unstuffed bytes, without delimiters.
///
/// * If a packet ends only with its delimiter, `classify` answers [`Incomplete`](crate::Classification::Incomplete)
///   until `LONGEST` bytes have arrived, and then rejects them. So `LONGEST` is one more than the number of bytes in
///   the longest packet. At the delimiter the receiver asks [`classify_before`](Format::classify_before), with
///   [`LineEvent::Idle`](crate::LineEvent::Idle), whether the whole packet is a frame.
/// * If a frame ends by itself, for example after a length that it states, implement only `classify`. Except in DLE
///   framing, the receiver delivers the frame with its last byte, and discards the bytes up to the next delimiter.
pub trait PacketFormat: Format {
    /// Returns the byte stuffing. Return a constant if you can, because the compiler then removes the code for other
    /// ways of stuffing.
    fn stuffing(&self) -> Stuffing;
}

impl Codes {
    /// Returns the code for the delimiter or the escape byte.
    const fn of(self, byte: u8, delimiter_byte: u8) -> u8 {
        match self {
            Self::Xor(with) => byte ^ with,
            Self::Pair { delimiter, .. } if byte == delimiter_byte => delimiter,
            Self::Pair { escape, .. } => escape,
        }
    }
}

/// The number of bytes after the code in the longest block of COBS.
const LONGEST_BLOCK: usize = 254;

impl Stuffing {
    /// SLIP and KISS: `C0` between packets, `DB DC` for `C0`, `DB DD` for `DB`.
    pub const SLIP: Self = Self::Escape {
        delimiter: 0xC0,
        escape: 0xDB,
        codes: Codes::Pair {
            delimiter: 0xDC,
            escape: 0xDD,
        },
    };

    /// HDLC and PPP on a UART, `XBee` in API mode 2, S.Port: `7E` between packets, `7D` and the byte XOR `20` for `7E`
    /// and `7D`.
    pub const HDLC: Self = Self::Escape {
        delimiter: 0x7E,
        escape: 0x7D,
        codes: Codes::Xor(0x20),
    };

    /// DLE framing: `10 02` before a packet, `10 03` after it, `10 10` for `10`.
    pub const DLE: Self = Self::Doubled {
        escape: 0x10,
        start: Some(0x02),
        end: 0x03,
    };

    /// Writes a delimiter, the stuffed packet, and a delimiter to the front of `into`. Returns the written bytes.
    ///
    /// Returns `None` if `into` is too short, if the packet is empty, or if the packet cannot be encoded. A packet
    /// cannot be encoded in two cases: if the code for one of its bytes would be the delimiter, or if the packet begins
    /// with `escape` or `end` in DLE framing without a `start`.
    ///
    /// `2 * packet.len() + 4` bytes are always enough. For COBS, `packet.len() + packet.len() / 254 + 3` bytes are
    /// enough. For [`Escape`](Self::Escape) the function replaces only delimiters and escape bytes. If a protocol's
    /// frames end by themselves, as in `XBee` and S.Port, do not send the last byte, a delimiter. For
    /// [`Break`](Self::Break) the function copies the packet, and the program sends the breaks.
    ///
    /// ```
    /// use framelock::Stuffing;
    /// let mut buffer = [0; 16];
    /// assert_eq!(Stuffing::SLIP.stuff(b"a\xC0b", &mut buffer), Some(&b"\xC0a\xDB\xDCb\xC0"[..]));
    /// assert_eq!(Stuffing::HDLC.stuff(b"a\x7Eb", &mut buffer), Some(&b"\x7Ea\x7D\x5Eb\x7E"[..]));
    /// assert_eq!(Stuffing::Cobs.stuff(b"a\0bc", &mut buffer), Some(&b"\0\x02a\x03bc\0"[..]));
    /// assert_eq!(Stuffing::DLE.stuff(b"a\x10b", &mut buffer), Some(&b"\x10\x02a\x10\x10b\x10\x03"[..]));
    /// assert_eq!(Stuffing::Cobs.stuff(&[1; 16], &mut buffer), None);
    /// ```
    #[must_use]
    pub fn stuff<'b>(&self, packet: &[u8], into: &'b mut [u8]) -> Option<&'b [u8]> {
        let mut output = Output { into, length: 0 };
        let (&first, behind_first) = packet.split_first()?;
        match *self {
            Self::Break => output.extend(packet)?,
            Self::Cobs => {
                output.push(0)?;
                output.push_blocks(packet)?;
                output.push(0)?;
            }
            Self::Escape {
                delimiter,
                escape,
                codes,
            } => {
                output.push(delimiter)?;
                for &byte in packet {
                    if byte == delimiter || byte == escape {
                        let code = Some(codes.of(byte, delimiter));
                        let code = code.filter(|&code| code != delimiter)?;
                        output.extend(&[escape, code])?;
                    } else {
                        output.push(byte)?;
                    }
                }
                output.push(delimiter)?;
            }
            Self::Doubled { escape, start, end } => {
                let (code, content) = match start {
                    Some(start) => (start, packet),
                    None => (first, behind_first),
                };
                if !self.begins_packet(code) {
                    return None;
                }
                output.extend(&[escape, code])?;
                for &byte in content {
                    output.push(byte)?;
                    if byte == escape {
                        output.push(byte)?;
                    }
                }
                output.extend(&[escape, end])?;
            }
        }
        let Output { into, length } = output;
        into.get(..length)
    }

    /// Returns the byte between packets, if a single byte separates them.
    pub(crate) const fn delimiter(self) -> Option<u8> {
        match self {
            Self::Escape { delimiter, .. } => Some(delimiter),
            Self::Cobs => Some(0),
            Self::Doubled { .. } | Self::Break => None,
        }
    }

    /// Returns whether this is the escape byte of DLE framing.
    #[inline]
    pub(crate) fn is_doubled(self, byte: u8) -> bool {
        matches!(self, Self::Doubled { escape, .. } if escape == byte)
    }

    /// Returns whether a packet of DLE framing begins with the escape byte and this code.
    #[inline]
    pub(crate) fn begins_packet(self, code: u8) -> bool {
        match self {
            Self::Doubled { escape, start, end } => {
                start.map_or(code != end, |start| code == start) && code != escape
            }
            _ => false,
        }
    }
}

/// The meaning of a byte inside a packet.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Meaning {
    /// Alone or together with the bytes before it, the byte stands for this byte of the packet.
    Content(u8),
    /// The byte alone stands for nothing: it is an escape byte, or the code of a COBS block that follows no zero.
    Prefix,
    /// The byte is between two packets.
    Delimiter,
    /// The second byte of `escape end`.
    End,
    /// The second byte of `escape start`.
    Start,
    /// The byte follows the escape byte, but is not a code.
    Broken,
}

/// The state of the stuffing inside a packet.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Unstuffing {
    /// The number of bytes that are missing in the block of COBS. In other stuffings, 1 after an escape byte and
    /// otherwise 0.
    pub(crate) missing: u8,
    /// Whether a zero separates the block of COBS from a block that follows.
    pub(crate) has_zero: bool,
}

impl Unstuffing {
    /// The state at the beginning of a packet.
    pub(crate) const NEW: Self = Self {
        missing: 0,
        has_zero: false,
    };

    /// Returns whether a packet may end here.
    #[inline]
    pub(crate) const fn is_complete(self) -> bool {
        self.missing == 0
    }

    /// Takes the next byte inside a packet.
    #[inline]
    pub(crate) fn take(&mut self, stuffing: Stuffing, byte: u8) -> Meaning {
        if stuffing.delimiter() == Some(byte) {
            return Meaning::Delimiter;
        }
        let is_missing = self.missing > 0;
        self.missing = self.missing.saturating_sub(1);
        match stuffing {
            Stuffing::Cobs if !is_missing => {
                let had_zero = self.has_zero;
                self.missing = byte.wrapping_sub(1);
                self.has_zero = usize::from(self.missing) < LONGEST_BLOCK;
                if had_zero {
                    Meaning::Content(0)
                } else {
                    Meaning::Prefix
                }
            }
            Stuffing::Escape { escape, .. } | Stuffing::Doubled { escape, .. }
                if !is_missing && byte == escape =>
            {
                self.missing = 1;
                Meaning::Prefix
            }
            Stuffing::Escape {
                delimiter,
                escape,
                codes,
            } if is_missing => match codes {
                Codes::Xor(with) => Meaning::Content(byte ^ with),
                Codes::Pair { .. } => {
                    let mut special = [delimiter, escape].into_iter();
                    let content = special.find(|&special| codes.of(special, delimiter) == byte);
                    content.map_or(Meaning::Broken, Meaning::Content)
                }
            },
            Stuffing::Doubled { escape, end, .. } if is_missing => match byte {
                _ if byte == escape => Meaning::Content(byte),
                _ if byte == end => Meaning::End,
                _ if stuffing.begins_packet(byte) => Meaning::Start,
                _ => Meaning::Broken,
            },
            _ => Meaning::Content(byte),
        }
    }
}

/// A buffer that is written from its front.
struct Output<'b> {
    into: &'b mut [u8],
    length: usize,
}

impl Output<'_> {
    /// Writes a byte. Returns `None` if the buffer is full.
    fn push(&mut self, byte: u8) -> Option<()> {
        *self.into.get_mut(self.length)? = byte;
        self.length = self.length.wrapping_add(1);
        Some(())
    }

    fn extend(&mut self, bytes: &[u8]) -> Option<()> {
        bytes.iter().try_for_each(|&byte| self.push(byte))
    }

    /// Writes the blocks of COBS. Each block is a code followed by bytes other than zero. The code is the block's
    /// length, including the code itself.
    fn push_blocks(&mut self, packet: &[u8]) -> Option<()> {
        let mut rest = packet;
        loop {
            let block = rest
                .iter()
                .take(LONGEST_BLOCK)
                .take_while(|&&byte| byte != 0);
            let length = block.count();
            let (block, behind) = rest.split_at_checked(length)?;
            let (&code, _) = length.wrapping_add(1).to_le_bytes().split_first()?;
            self.push(code)?;
            self.extend(block)?;
            rest = match behind {
                [] => return Some(()),
                // A block of the greatest length stands for its own bytes only, and for no zero after them.
                _ if length == LONGEST_BLOCK => behind,
                [_, behind @ ..] => behind,
            };
        }
    }
}
