use framelock::Format;

use crate::layout::Layout;
use crate::{AnyOf, NMEA, Nmea, RTCM, Rtcm, RtcmMessage, UBX, Ubx, UbxMessage};

/// What satellite receivers send on one line: UBX, NMEA and RTCM 3.
///
/// `LONGEST` is the longest frame in bytes, of whatever protocol: see [`Ubx`]. RTCM frames have up to 1 029.
///
/// # Examples
/// ```
/// use framelock::BufferedReceiver;
/// use framelock_formats::{Gnss, GnssMessage};
/// let mut receiver = BufferedReceiver::<_, 2200>::new(Gnss::<1100>);
/// let mut texts = 0;
/// for byte in *b"$GPTXT,01,01,02,ok*49\r\n" {
///     if let Some(GnssMessage::Nmea(_)) = receiver.push(byte) {
///         texts += 1;
///     }
/// }
/// assert_eq!(texts, 1);
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Gnss<const LONGEST: usize>;

/// A frame of one of them.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum GnssMessage<'a> {
    /// A UBX frame.
    Ubx(UbxMessage<'a>),
    /// An NMEA sentence: what is between the first byte and the `*`.
    Nmea(&'a [u8]),
    /// An RTCM 3 frame.
    Rtcm(RtcmMessage<'a>),
}

impl<const LONGEST: usize> Gnss<LONGEST> {
    const ALL: AnyOf<'static> = AnyOf(&[Self::up_to(UBX), Self::up_to(NMEA), Self::up_to(RTCM)]);

    const fn up_to(layout: Layout<'static>) -> Layout<'static> {
        if layout.longest <= LONGEST {
            return layout;
        }
        Layout {
            longest: LONGEST,
            ..layout
        }
    }
}

impl<const LONGEST: usize> Format for Gnss<LONGEST> {
    crate::judged_by!(
        Layout {
            longest: LONGEST,
            ..Layout::NONE
        },
        |_format| Self::ALL
    );
    type Message<'a> = GnssMessage<'a>;

    #[inline]
    fn decode<'a>(&self, frame: &'a [u8]) -> GnssMessage<'a> {
        match Self::ALL.decode(frame) {
            (0, frame) => GnssMessage::Ubx(Ubx::<LONGEST>.decode(frame)),
            (1, frame) => GnssMessage::Nmea(Nmea.decode(frame)),
            (_, frame) => GnssMessage::Rtcm(Rtcm.decode(frame)),
        }
    }
}
