//! UBX, NMEA and RTCM 3 on one line.

use framelock::{Classification, Format, LineEvent};

use crate::any_of::{first, first_before, kind};
use crate::layout::{CheckedLayout, Layout};
use crate::{nmea, rtcm, ubx};

/// The protocols that satellite receivers send on one line: UBX, NMEA and RTCM 3.
///
/// `LONGEST` is the length in bytes of the longest frame of all three protocols. To choose it, see [`Ubx`](ubx::Ubx).
/// RTCM frames have up to 1 029 bytes.
///
/// # Examples
/// ```
/// use framelock::BufferedReceiver;
/// use framelock_formats::gnss::{Gnss, Message};
/// let mut receiver = BufferedReceiver::<_, [u8; 2200]>::new(Gnss::<1100>);
/// let mut texts = 0;
/// for byte in *b"$GPTXT,01,01,02,ok*49\r\n" {
///     if let Some(Message::Nmea(_)) = receiver.push(byte).map(|frame| frame.message()) {
///         texts += 1;
///     }
/// }
/// assert_eq!(texts, 1);
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Gnss<const LONGEST: usize>;

/// A frame of one of the three protocols.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Message<'a> {
    /// A UBX frame.
    Ubx(ubx::Message<'a>),
    /// The text of an NMEA sentence, between the first byte and the `*`.
    Nmea(&'a [u8]),
    /// An RTCM 3 frame.
    Rtcm(rtcm::Message<'a>),
}

/// The protocols, in the order in which they are tried.
const ALL: [Protocol; 3] = [Protocol::Ubx, Protocol::Nmea, Protocol::Rtcm];

#[derive(Clone, Copy)]
enum Protocol {
    Ubx,
    Nmea,
    Rtcm,
}

impl<const LONGEST: usize> Gnss<LONGEST> {
    const NMEA: CheckedLayout<'static> = Self::up_to(&nmea::LAYOUT);
    const RTCM: CheckedLayout<'static> = Self::up_to(&rtcm::LAYOUT);

    const fn up_to(layout: &CheckedLayout<'static>) -> CheckedLayout<'static> {
        let longest = if layout.layout().longest <= LONGEST {
            layout.layout().longest
        } else {
            LONGEST
        };
        Layout {
            longest,
            ..layout.layout()
        }
        .checked()
    }

    /// Classifies bytes as a frame of one protocol. Because each layout is a constant, the compiler specialises the
    /// code for each of them. Together, the three specialised versions are shorter than the general code, which
    /// [`AnyOf`](crate::AnyOf) uses.
    #[inline(never)]
    fn classify_as(protocol: Protocol, bytes: &[u8], seen: usize) -> Classification {
        match protocol {
            Protocol::Ubx => const { ubx::Ubx::<LONGEST>::LAYOUT }.classify_after(bytes, seen),
            Protocol::Nmea => const { Self::NMEA }.classify_after(bytes, seen),
            Protocol::Rtcm => const { Self::RTCM }.classify_after(bytes, seen),
        }
    }

    #[inline]
    fn starts_as(protocol: Protocol, byte: u8) -> bool {
        match protocol {
            Protocol::Ubx => ubx::LAYOUT.starts(byte),
            Protocol::Nmea => nmea::LAYOUT.starts(byte),
            Protocol::Rtcm => rtcm::LAYOUT.starts(byte),
        }
    }
}

impl<const LONGEST: usize> Format for Gnss<LONGEST> {
    const LONGEST: usize = LONGEST;
    type Message<'a> = Message<'a>;

    #[inline]
    fn classify(&self, bytes: &[u8]) -> Classification {
        self.classify_after(bytes, 0)
    }

    #[inline]
    fn classify_after(&self, bytes: &[u8], seen: usize) -> Classification {
        let starts = |it: &Protocol| {
            bytes
                .first()
                .is_some_and(|&byte| Self::starts_as(*it, byte))
        };
        first(&ALL, seen, starts, |it, seen| {
            Self::classify_as(*it, bytes, seen)
        })
    }

    #[inline]
    fn classify_before(&self, bytes: &[u8], _: LineEvent) -> Classification {
        first_before(&ALL, |it| (Self::classify_as(*it, bytes, 0), false))
    }

    #[inline]
    fn starts(&self, byte: u8) -> bool {
        ALL.iter().any(|it| Self::starts_as(*it, byte))
    }

    #[inline]
    fn decode<'a>(&self, frame: &'a [u8]) -> Message<'a> {
        let is_frame = Classification::Frame(frame.len());
        let starts = |it: &Protocol| {
            frame
                .first()
                .is_some_and(|&byte| Self::starts_as(*it, byte))
        };
        match kind(&ALL, starts, |it| {
            Self::classify_as(*it, frame, 0) == is_frame
        }) {
            0 => Message::Ubx(ubx::Ubx::<LONGEST>.decode(frame)),
            1 => Message::Nmea(nmea::Nmea.decode(frame)),
            _ => Message::Rtcm(rtcm::Rtcm.decode(frame)),
        }
    }
}
