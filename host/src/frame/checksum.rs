//! Checksums by name: those of the CRC catalogue, and the sums that people use instead.

use crc::Crc;
use serde::Deserialize;

/// A checksum.
#[derive(Deserialize)]
#[serde(try_from = "String")]
pub(super) enum Checksum {
    Crc8(Box<Crc<u8>>),
    Crc16(Box<Crc<u16>>),
    Crc32(Box<Crc<u32>>),
    /// The bytes added up.
    Sum,
    /// All bits of the sum inverted: 0xFFFF - sum in 16 bits.
    InvertedSum,
    /// What makes the sum zero.
    NegatedSum,
    Xor,
    /// Two sums of 8 bits: the second adds up what the first has been. The first is the low byte.
    Fletcher8,
}

/// What each name stands for.
type Entry = (&'static str, fn() -> Checksum);

const SUMS: &[Entry] = &[
    ("sum", || Checksum::Sum),
    ("inverted-sum", || Checksum::InvertedSum),
    ("negated-sum", || Checksum::NegatedSum),
    ("xor", || Checksum::Xor),
    ("fletcher-8", || Checksum::Fletcher8),
];

/// Entries of the catalogue, by the names that the library gives them.
macro_rules! catalogue {
    ($variant:ident<$width:ident>: $($name:ident)*) => {
        &[$((stringify!($name), || Checksum::$variant(Box::new(Crc::<$width>::new(&crc::$name))))),*]
    };
}

#[rustfmt::skip]
const CRC_8: &[Entry] = catalogue!(Crc8<u8>:
    CRC_8_AUTOSAR CRC_8_BLUETOOTH CRC_8_CDMA2000 CRC_8_DARC CRC_8_DVB_S2 CRC_8_GSM_A CRC_8_GSM_B
    CRC_8_HITAG CRC_8_I_432_1 CRC_8_I_CODE CRC_8_LTE CRC_8_MAXIM_DOW CRC_8_MIFARE_MAD CRC_8_NRSC_5
    CRC_8_OPENSAFETY CRC_8_ROHC CRC_8_SAE_J1850 CRC_8_SMBUS CRC_8_TECH_3250 CRC_8_WCDMA);

#[rustfmt::skip]
const CRC_16: &[Entry] = catalogue!(Crc16<u16>:
    CRC_16_ARC CRC_16_CDMA2000 CRC_16_CMS CRC_16_DDS_110 CRC_16_DECT_R CRC_16_DECT_X CRC_16_DNP
    CRC_16_EN_13757 CRC_16_GENIBUS CRC_16_GSM CRC_16_IBM_3740 CRC_16_IBM_SDLC
    CRC_16_ISO_IEC_14443_3_A CRC_16_KERMIT CRC_16_LJ1200 CRC_16_M17 CRC_16_MAXIM_DOW CRC_16_MCRF4XX
    CRC_16_MODBUS CRC_16_NRSC_5 CRC_16_OPENSAFETY_A CRC_16_OPENSAFETY_B CRC_16_PROFIBUS
    CRC_16_RIELLO CRC_16_SPI_FUJITSU CRC_16_T10_DIF CRC_16_TELEDISK CRC_16_TMS37157 CRC_16_UMTS
    CRC_16_USB CRC_16_XMODEM);

#[rustfmt::skip]
const CRC_32: &[Entry] = catalogue!(Crc32<u32>:
    CRC_32_AIXM CRC_32_AUTOSAR CRC_32_BASE91_D CRC_32_BZIP2 CRC_32_CD_ROM_EDC CRC_32_CKSUM
    CRC_32_ISCSI CRC_32_ISO_HDLC CRC_32_JAMCRC CRC_32_MEF CRC_32_MPEG_2 CRC_32_XFER);

/// A name in the catalogue's own spelling: `CRC-8/DVB-S2`.
fn spelled(name: &str) -> String {
    match *name.splitn(3, '_').collect::<Vec<_>>() {
        ["CRC", width, rest] => format!("CRC-{width}/{}", rest.replace('_', "-")),
        _ => name.to_owned(),
    }
}

/// A name without what people spell in different ways.
fn plain(name: &str) -> String {
    let kept = name.chars().filter(char::is_ascii_alphanumeric);
    kept.collect::<String>().to_ascii_lowercase()
}

impl TryFrom<String> for Checksum {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        let wanted = plain(&name);
        let mut entries = [SUMS, CRC_8, CRC_16, CRC_32].concat();
        if let Some((_, checksum)) = entries.iter().find(|(name, _)| plain(name) == wanted) {
            return Ok(checksum());
        }
        let distance = |name: &str| strsim::damerau_levenshtein(&plain(name), &wanted);
        entries.sort_by_key(|(name, _)| distance(name));
        let nearest = entries.iter().take(4).map(|(name, _)| spelled(name));
        Err(format!(
            "there is no checksum {name:?}; the nearest names are {}. Besides sum, inverted-sum, \
             negated-sum, xor and fletcher-8 there are the CRCs of 8, 16 and 32 bits of the \
             catalogue at https://reveng.sourceforge.io/crc-catalogue",
            nearest.collect::<Vec<_>>().join(", ")
        ))
    }
}

impl Checksum {
    /// How many bytes it has; sums have as many as are kept of them.
    pub(super) fn length(&self) -> Option<usize> {
        match self {
            Self::Crc8(_) | Self::Xor => Some(1),
            Self::Crc16(_) | Self::Fletcher8 => Some(2),
            Self::Crc32(_) => Some(4),
            Self::Sum | Self::InvertedSum | Self::NegatedSum => None,
        }
    }

    /// The checksum of the bytes and what is appended to them. Of sums, the low bits are of use.
    pub(super) fn of(&self, bytes: &[u8], appended: Option<u8>) -> u64 {
        let appended = appended.as_slice();
        let each = || bytes.iter().chain(appended);
        let sum = || each().map(|&byte| u64::from(byte)).sum::<u64>();
        macro_rules! crc {
            ($crc:expr) => {{
                let mut digest = $crc.digest();
                digest.update(bytes);
                digest.update(appended);
                digest.finalize().into()
            }};
        }
        match self {
            Self::Crc8(crc) => crc!(crc),
            Self::Crc16(crc) => crc!(crc),
            Self::Crc32(crc) => crc!(crc),
            Self::Sum => sum(),
            Self::InvertedSum => !sum(),
            Self::NegatedSum => sum().wrapping_neg(),
            Self::Xor => each().fold(0, |xor, &byte| xor ^ u64::from(byte)),
            Self::Fletcher8 => {
                let (a, b) = each().fold((0_u8, 0_u8), |(a, b), &byte| {
                    let a = a.wrapping_add(byte);
                    (a, b.wrapping_add(a))
                });
                u16::from_le_bytes([a, b]).into()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use super::*;

    fn of(name: &str, bytes: &[u8]) -> u64 {
        Checksum::try_from(name.to_owned()).unwrap().of(bytes, None)
    }

    /// Every entry gives its catalogue's check value under its catalogue's name.
    #[test]
    fn names_are_the_catalogues() {
        for (name, check) in [
            ("CRC-8/DVB-S2", 0xBC),
            ("crc8_autosar", 0xDF),
            ("CRC-16/MCRF4XX", 0x6F91),
            ("CRC-16/ISO-IEC-14443-3-A", 0xBF05),
            ("CRC-32/ISO-HDLC", 0xCBF4_3926),
        ] {
            assert_eq!(of(name, b"123456789"), check, "{name}");
        }
        let all = [CRC_8, CRC_16, CRC_32].concat();
        assert_eq!(all.len(), 20 + 31 + 12);
        for (name, _) in all {
            of(&spelled(name), b"");
        }
    }

    #[test]
    fn sums_are_what_they_are_called() {
        let bytes = [0x20, 0x40, 0xFF];
        assert_eq!(of("sum", &bytes), 0x15F);
        assert_eq!(of("inverted-sum", &bytes) & 0xFFFF, 0xFFFF - 0x15F);
        assert_eq!(of("negated-sum", &bytes) & 0xFF, 0xA1);
        assert_eq!(of("xor", &bytes), 0x9F);
        // a: 20, 60, 5F; b: 20, 80, DF.
        assert_eq!(of("fletcher-8", &bytes), 0xDF5F);
    }

    #[test]
    fn an_unknown_name_gets_the_nearest() {
        let told = |name: &str| Checksum::try_from(name.to_owned()).err().unwrap();
        assert!(told("CRC-8/DVB-S3").contains("are CRC-8/DVB-S2"));
        assert!(told("crc16-modbuss").contains("are CRC-16/MODBUS"));
        assert!(told("fletcher").contains("fletcher-8"));
    }
}
