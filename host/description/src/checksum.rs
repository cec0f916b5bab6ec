//! Checksums by name or by their parameters: the CRCs of the catalogue, and common sums.

use framelock_formats::layout::{Algorithm, ByteOrder, Checksum, Crc, Encoding};

use toml::Spanned;

use crate::entries::{ChecksumEntry, parsed, parsed_if_any};
use crate::number::NumberType;
use crate::problem::{Located, Mistake, UnknownName};

const SUMS: &[(&str, Algorithm)] = &[
    ("sum", Algorithm::Sum),
    ("carry-sum", Algorithm::CarrySum),
    ("sum-words", Algorithm::SumWords),
    ("xor", Algorithm::Xor),
    ("xor-words", Algorithm::XorWords),
    ("fletcher-8", Algorithm::Fletcher),
];

/// Errors for names that sums had in earlier versions. Each error gives the keys to use instead.
const INVERTED: &str =
    "inverted-sum is now name = \"sum\" with xor = 0xFF, or xor = 0xFFFF for two bytes";
const NEGATED: &str = "negated-sum is now name = \"sum\" with initial = 0xFF and xor = 0xFF, or both 0xFFFF for two bytes";

/// Lists entries of the CRC library's catalogue by their names.
macro_rules! catalogue {
    ($($name:ident)*) => {
        &[$((stringify!($name), {
            let crc = crc_catalog::$name;
            Crc {
                initial: crc.init as u32,
                reflected_in: crc.refin,
                reflected_out: crc.refout,
                xor_out: crc.xorout as u32,
                ..Crc::new(crc.width as u32, crc.poly as u32)
            }
        })),*]
    };
}

/// The CRCs of the catalogue that have 8 to 32 bits.
#[rustfmt::skip]
#[allow(clippy::unnecessary_cast, reason = "the catalogue has three types of numbers")]
const CATALOGUE: &[(&str, Crc)] = catalogue!(
    CRC_8_AUTOSAR CRC_8_BLUETOOTH CRC_8_CDMA2000 CRC_8_DARC CRC_8_DVB_S2 CRC_8_GSM_A CRC_8_GSM_B
    CRC_8_HITAG CRC_8_I_432_1 CRC_8_I_CODE CRC_8_LTE CRC_8_MAXIM_DOW CRC_8_MIFARE_MAD CRC_8_NRSC_5
    CRC_8_OPENSAFETY CRC_8_ROHC CRC_8_SAE_J1850 CRC_8_SMBUS CRC_8_TECH_3250 CRC_8_WCDMA
    CRC_10_ATM CRC_10_CDMA2000 CRC_10_GSM CRC_11_FLEXRAY CRC_11_UMTS CRC_12_CDMA2000 CRC_12_DECT
    CRC_12_GSM CRC_12_UMTS CRC_13_BBC CRC_14_DARC CRC_14_GSM CRC_15_CAN CRC_15_MPT1327
    CRC_16_ARC CRC_16_CDMA2000 CRC_16_CMS CRC_16_DDS_110 CRC_16_DECT_R CRC_16_DECT_X CRC_16_DNP
    CRC_16_EN_13757 CRC_16_GENIBUS CRC_16_GSM CRC_16_IBM_3740 CRC_16_IBM_SDLC
    CRC_16_ISO_IEC_14443_3_A CRC_16_KERMIT CRC_16_LJ1200 CRC_16_M17 CRC_16_MAXIM_DOW CRC_16_MCRF4XX
    CRC_16_MODBUS CRC_16_NRSC_5 CRC_16_OPENSAFETY_A CRC_16_OPENSAFETY_B CRC_16_PROFIBUS
    CRC_16_RIELLO CRC_16_SPI_FUJITSU CRC_16_T10_DIF CRC_16_TELEDISK CRC_16_TMS37157 CRC_16_UMTS
    CRC_16_USB CRC_16_XMODEM CRC_17_CAN_FD CRC_21_CAN_FD
    CRC_24_BLE CRC_24_FLEXRAY_A CRC_24_FLEXRAY_B CRC_24_INTERLAKEN CRC_24_LTE_A CRC_24_LTE_B
    CRC_24_OPENPGP CRC_24_OS_9 CRC_30_CDMA CRC_31_PHILIPS
    CRC_32_AIXM CRC_32_AUTOSAR CRC_32_BASE91_D CRC_32_BZIP2 CRC_32_CD_ROM_EDC CRC_32_CKSUM
    CRC_32_ISCSI CRC_32_ISO_HDLC CRC_32_JAMCRC CRC_32_MEF CRC_32_MPEG_2 CRC_32_XFER);

/// Returns the aliases of the catalogue, each with the CRC's main name.
fn aliases() -> impl Iterator<Item = (&'static str, &'static str)> {
    let lines = include_str!("checksum-aliases.txt").lines();
    lines.filter_map(|line| line.split_once(" = "))
}

/// Returns a name as CRC catalogues spell it: `CRC-8/DVB-S2` for `CRC_8_DVB_S2`.
fn spelled(name: &str) -> String {
    match *name.splitn(3, '_').collect::<Vec<_>>() {
        ["CRC", width, rest] => format!("CRC-{width}/{}", rest.replace('_', "-")),
        _ => name.to_owned(),
    }
}

/// Returns the letters and digits of a name, in lower case. The result is the same for every spelling of a name, such
/// as `CRC-16/MODBUS` and `crc16_modbus`.
fn plain(name: &str) -> String {
    let letters = name.chars().filter(char::is_ascii_alphanumeric);
    letters.collect::<String>().to_ascii_lowercase()
}

/// Returns the algorithm with this name.
fn named(name: &str) -> Result<Algorithm<'static>, Mistake> {
    match name {
        "inverted-sum" => return Err(INVERTED.into()),
        "negated-sum" => return Err(NEGATED.into()),
        _ => {}
    }
    let alias = aliases().find(|(alias, _)| plain(alias) == plain(name));
    let wanted = plain(alias.map_or(name, |(_, name)| name));
    let crcs = CATALOGUE
        .iter()
        .map(|(name, crc)| (*name, Algorithm::Crc(*crc)));
    let mut all = SUMS.iter().copied().chain(crcs);
    if let Some((_, algorithm)) = all.clone().find(|(name, _)| plain(name) == wanted) {
        return Ok(algorithm);
    }
    let aliases = aliases().map(|(alias, _)| alias);
    let mut names: Vec<&str> = all.by_ref().map(|(name, _)| name).chain(aliases).collect();
    names.sort_by_cached_key(|name| strsim::damerau_levenshtein(&plain(name), &wanted));
    let names = names.into_iter().map(spelled);
    Err(UnknownName::new(name, names).into())
}

/// Returns the checksum with these entries.
pub(crate) fn read(entry: &Spanned<ChecksumEntry>) -> Result<Checksum<'static>, Located> {
    let (span, entry) = (entry.span(), entry.get_ref());
    let (bytes, encoding) = parsed(&entry.r#type, encoding)?;
    let algorithm = parsed_if_any(entry.name.as_ref(), named)?;
    let (initial, xor, reflected) = (entry.initial, entry.xor, entry.reflected);
    let has_parameters = initial.or(xor).is_some();
    let is_crc = matches!(algorithm, None | Some(Algorithm::Crc(_)));
    let algorithm = match (algorithm, entry.width, entry.polynomial) {
        (Some(algorithm), None, None) if reflected.is_none() && !(is_crc && has_parameters) => {
            algorithm
        }
        (None, Some(width), Some(polynomial)) => Algorithm::Crc(Crc {
            initial: initial.unwrap_or(0),
            reflected_in: reflected.unwrap_or(false),
            reflected_out: reflected.unwrap_or(false),
            xor_out: xor.unwrap_or(0),
            ..Crc::new(width, polynomial)
        }),
        _ => {
            let rule = "give a name, or a CRC's width and polynomial, then initial, reflected and xor; a sum by name may \
                        have initial and xor";
            return Err(Located::new(span, rule));
        }
    };
    Ok(Checksum {
        algorithm,
        initial: initial.filter(|_| !is_crc).unwrap_or(0),
        xor_out: xor.filter(|_| !is_crc).unwrap_or(0),
        over_hex_digits: entry.over.is_some(),
        bytes,
        encoding,
        at: entry.at,
        from: entry.from,
        to: entry.to.unwrap_or(entry.at.saturating_sub(1)),
    })
}

/// Parses the type of a checksum: the number of its bytes, and their encoding in the frame.
fn encoding(name: &str) -> Result<(usize, Encoding), Mistake> {
    let digits = ["hex8", "hex16", "hex24", "hex32"];
    if let Some(place) = digits.iter().position(|hex| *hex == name) {
        return Ok((place + 1, Encoding::Hex));
    }
    let number = NumberType::parse_unsigned(name, &digits)?;
    let encoding = match number.order {
        ByteOrder::Little => Encoding::Little,
        ByteOrder::Big => Encoding::Big,
    };
    Ok((number.bytes, encoding))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use super::*;

    fn of(name: &str, bytes: &[u8]) -> u32 {
        let algorithm = named(name).unwrap();
        let of = |algorithm| {
            let checksum = Checksum {
                algorithm,
                ..Checksum::at_the_end(4)
            };
            checksum.of(bytes, None)
        };
        let sum = of(algorithm);
        if let Algorithm::Crc(crc) = algorithm {
            let table = crc.table_of_words();
            let crc = Crc {
                table: framelock_formats::layout::Table::Words(&table),
                ..crc
            };
            assert_eq!(of(Algorithm::Crc(crc)), sum, "{name}");
        }
        sum
    }

    #[test]
    fn every_name_gives_the_catalogues_check_value() {
        macro_rules! is {
            ($($name:ident)*) => {
                $(assert_eq!(
                    u64::from(of(&spelled(stringify!($name)), b"123456789")),
                    u64::from(crc_catalog::$name.check),
                );)*
            };
        }
        is!(CRC_8_AUTOSAR CRC_8_DVB_S2 CRC_8_MAXIM_DOW CRC_10_ATM CRC_11_UMTS CRC_12_UMTS CRC_13_BBC CRC_14_DARC
            CRC_15_CAN CRC_16_MCRF4XX CRC_16_ISO_IEC_14443_3_A CRC_17_CAN_FD CRC_21_CAN_FD CRC_24_LTE_A CRC_24_BLE
            CRC_30_CDMA CRC_31_PHILIPS CRC_32_ISO_HDLC CRC_32_XFER);
        assert_eq!(CATALOGUE.len(), 89);
        for (name, _) in CATALOGUE {
            of(&spelled(name), b"");
        }
    }

    #[test]
    fn other_names_for_the_same_are_names_too() {
        for (alias, name) in aliases() {
            assert_eq!(of(alias, b"123456789"), of(name, b"123456789"), "{alias}");
        }
        assert_eq!(of("CRC-16/BUYPASS", b"123456789"), 0xFEE8);
        assert_eq!(of("crc8", b"123456789"), 0xF4);
        assert_eq!(of("CRC-16", b"123456789"), 0xBB3D);
    }

    #[test]
    fn sums_are_what_they_are_called() {
        let bytes = [0x20, 0x40, 0xFF];
        assert_eq!(of("sum", &bytes), 0x15F);
        assert_eq!(of("carry-sum", &[0xFF; 5]), 0x4FB);
        assert_eq!(of("xor", &bytes), 0x9F);
        // The words are 4020 and 00FF.
        assert_eq!(of("sum-words", &bytes), 0x411F);
        assert_eq!(of("xor-words", &bytes), 0x40DF);
        // With the three bytes, the first sum becomes 20, then 60, then 5F. The second sum becomes 20, then 80, then
        // DF.
        assert_eq!(of("fletcher-8", &bytes), 0xDF5F);
    }

    #[test]
    fn an_unknown_name_gets_the_nearest() {
        let told = |name: &str| named(name).unwrap_err().to_string();
        assert!(told("CRC-8/DVB-S3").contains("are CRC-8/DVB-S2"));
        assert!(told("crc16-modbuss").contains("are CRC-16/MODBUS"));
        assert!(told("fletcher").contains("fletcher-8"));
    }
}
