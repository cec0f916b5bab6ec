//! UBX, NMEA and RTCM 3 on one line.

use framelock::Format;

use crate::layout::{CheckedLayout, Layout};
use crate::{AnyOf, nmea, rtcm, ubx};

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

impl<const LONGEST: usize> Gnss<LONGEST> {
    const ALL: AnyOf<'static> = AnyOf(&[
        ubx::Ubx::<LONGEST>::LAYOUT,
        Self::up_to(&nmea::LAYOUT),
        Self::up_to(&rtcm::LAYOUT),
    ]);

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
}

impl<const LONGEST: usize> Format for Gnss<LONGEST> {
    crate::classify_by!(ubx::Ubx::<LONGEST>::LAYOUT, |_format| Self::ALL);
    type Message<'a> = Message<'a>;

    #[inline]
    fn decode<'a>(&self, frame: &'a [u8]) -> Message<'a> {
        match Self::ALL.decode(frame) {
            (0, frame) => Message::Ubx(ubx::Ubx::<LONGEST>.decode(frame)),
            (1, frame) => Message::Nmea(nmea::Nmea.decode(frame)),
            (_, frame) => Message::Rtcm(rtcm::Rtcm.decode(frame)),
        }
    }
}
