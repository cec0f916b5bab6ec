//! Converts MAVLink's definitions, which are XML files, to the text of a description.
//!
//! The description has two kinds of frames, MAVLink 2 and MAVLink 1. Each kind has a view of every message whose number
//! it can carry. A kind without views is left out. In a frame, a message's fields are sorted by the sizes of their
//! types, the largest first. The extensions follow in the order of the definition, and MAVLink 1 has none.
//!
//! Source: <https://mavlink.io/en/guide/serialization.html>, "Field Reordering" and "CRC_EXTRA Calculation", and
//! <https://mavlink.io/en/guide/xml_schema.html>.

use std::cmp::Reverse;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};

use framelock_formats::layout::{Algorithm, Checksum, Crc};
use roxmltree::{Document, Node};

use crate::problem::ReadError;
use crate::{hex, read_text, shipped};

/// The types of values in a definition, each with the name of this type in a description.
const TYPES: &str = "char text, uint8_t u8, uint8_t_mavlink_version u8, int8_t i8, uint16_t u16le, int16_t i16le, \
    uint32_t u32le, int32_t i32le, uint64_t u64le, int64_t i64le, float f32le, double f64le";

/// Units of whole numbers in a definition, each with the factor and the unit in the description. Other units stay.
const UNITS: &str = "degE7 1e-7 deg, degE5 1e-5 deg, cdeg 0.01 deg, cdeg/s 0.01 deg/s, ddeg/s 0.1 deg/s, cdegC 0.01 degC, \
    mrad/s 0.001 rad/s, dam 10 m, dm 0.1 m, cm 0.01 m, mm 0.001 m, dm/s 0.1 m/s, cm/s 0.01 m/s, mm/s 0.001 m/s, cV 0.01 V, \
    mV 0.001 V, cA 0.01 A, mA 0.001 A, d% 0.1 %, c% 0.01 %, mgauss 0.001 gauss, cs 0.01 s, ds 0.1 s";

/// Names of numbers in a definition.
const NUMBERS: &str = "UINT8_MAX 255, UINT16_MAX 65535, UINT32_MAX 4294967295, UINT64_MAX 18446744073709551615, INT8_MAX \
    127, INT16_MAX 32767, INT32_MAX 2147483647, INT64_MAX 9223372036854775807, UINT8_MIN 0, UINT16_MIN 0, UINT32_MIN 0, \
    UINT64_MIN 0, INT8_MIN -128, INT16_MIN -32768, INT32_MIN -2147483648, INT64_MIN -9223372036854775808";

/// Names of columns that do not come from a message. A field with such a name gets an underscore at its end.
const TAKEN: &str =
    " offset length time kind sequence system component message signature compatible_flags ";

/// CRC-16/MCRF4XX, from which CRC_EXTRA is computed.
const CRC: Checksum = Checksum {
    algorithm: Algorithm::Crc(Crc {
        initial: 0xFFFF,
        reflected_in: true,
        reflected_out: true,
        ..Crc::new(16, 0x1021)
    }),
    ..Checksum::at_the_end(2)
};

/// The messages and the enums of a definition and of the definitions that it includes.
#[derive(Default)]
struct Definition<'d> {
    messages: BTreeMap<u32, Message<'d>>,
    enums: HashMap<&'d str, Enum<'d>>,
}

#[derive(Default)]
struct Enum<'d> {
    /// Whether a value is the sum of several entries.
    is_bitmask: bool,
    entries: BTreeMap<i64, &'d str>,
}

struct Message<'d> {
    name: &'d str,
    /// The fields in the order of a frame.
    fields: Vec<Field<'d>>,
    /// The number of fields that are not extensions. These fields come first.
    base: usize,
}

struct Field<'d> {
    name: &'d str,
    /// The type of the values in the definition.
    element: &'d str,
    /// The type of the values in the description.
    class: &'static str,
    /// The number of bytes in a value.
    bytes: usize,
    /// The number of values in an array.
    count: Option<u8>,
    node: Node<'d, 'd>,
}

/// Returns the description of the messages in a definition. `text` is the text of the file at `path`.
pub(crate) fn description(path: &Path, text: &str) -> Result<String, ReadError> {
    let (mut files, mut all) = (HashSet::new(), String::new());
    add_file(&mut files, &mut all, path, text)?;
    let all = format!("<all>{all}</all>");
    let document = parse(path, &all)?;
    let mut definition = Definition::default();
    for node in document.descendants() {
        match node.tag_name().name() {
            "enum" => definition.add_enum(node),
            "message" if definition.add_message(node).is_none() => {
                return Err(ReadError::Message {
                    file: path.display().to_string(),
                    name: node.attribute("name").unwrap_or_default().to_owned(),
                });
            }
            _ => {}
        }
    }
    if definition.messages.is_empty() {
        return Err(ReadError::NoMessage(path.display().to_string()));
    }
    let name = path.file_stem().unwrap_or_default().display();
    let first = format!("# MAVLink 2 and 1 with the messages of {name}\n");
    Ok([first, definition.kind(2), definition.kind(1)].concat())
}

/// Appends the elements of a file and of the files that it includes. Files may include each other in a circle.
fn add_file(
    files: &mut HashSet<PathBuf>,
    all: &mut String,
    path: &Path,
    text: &str,
) -> Result<(), ReadError> {
    if !files.insert(path.canonicalize().unwrap_or(path.into())) {
        return Ok(());
    }
    let document = parse(path, text)?;
    *all += &text[document.root_element().range()];
    let nodes = document.descendants();
    for node in nodes.filter(|node| node.has_tag_name("include")) {
        let included = path.with_file_name(node.text().unwrap_or_default().trim());
        add_file(files, all, &included, &read_text(&included)?)?;
    }
    Ok(())
}

fn parse<'d>(path: &Path, text: &'d str) -> Result<Document<'d>, ReadError> {
    let name = path.display().to_string();
    Document::parse(text).map_err(|error| ReadError::Xml { name, error })
}

impl<'d> Definition<'d> {
    /// Adds the entries of an enum. Several files may have entries of one enum.
    fn add_enum(&mut self, node: Node<'d, 'd>) {
        let name = node.attribute("name").unwrap_or_default();
        let all = self.enums.entry(name).or_default();
        all.is_bitmask |= node.attribute("bitmask") == Some("true");
        let mut next = 0;
        for entry in node.children() {
            let value = entry.attribute("value").map_or(Some(next), whole);
            if let (Some(value), Some(name)) = (value, entry.attribute("name")) {
                all.entries.entry(value).or_insert(name);
                next = value.saturating_add(1);
            }
        }
    }

    /// Adds a message. Returns `None` if the message is not valid, or if another message has its number.
    fn add_message(&mut self, node: Node<'d, 'd>) -> Option<()> {
        let (mut fields, mut base) = (Vec::new(), None);
        for child in node.children() {
            match child.tag_name().name() {
                "field" => fields.push(Field::read(child)?),
                "extensions" => base = Some(fields.len()),
                _ => {}
            }
        }
        let base = base.unwrap_or(fields.len());
        fields[..base].sort_by_key(|field| Reverse(field.bytes));
        let number = node.attribute("id")?.parse().ok()?;
        let name = node.attribute("name")?;
        let is_short = length(&fields) <= 255;
        let message = Message { name, fields, base };
        let other = self.messages.insert(number, message);
        (is_short && other.is_none()).then_some(())
    }

    /// Returns the description of the frames of this MAVLink version. Returns an empty text if the version cannot carry
    /// any of the messages' numbers.
    fn kind(&self, version: u8) -> String {
        let (at, width, first) = if version == 1 { (5, 1, 6) } else { (7, 3, 10) };
        let (mut known, mut views) = (Vec::new(), Vec::new());
        for (number, message) in self.messages.range(..1 << (8 * width)) {
            let (name, base) = (message.name, &message.fields[..message.base]);
            let fields = if version == 1 { base } else { &message.fields };
            // The entry has no largest length, because later definitions may add extensions to a message.
            known.push(format!("\n    [{number}, {}],", extra(name, base)));
            let bytes = hex::glued(&number.to_le_bytes()[..width]);
            let begin = format!("[[kinds.views]]\nname = {name:?}\nat = {at}\nbytes = {bytes:?}");
            let fields = fields.iter().enumerate().map(|(index, field)| {
                let at = first + length(&fields[..index]);
                format!("    {{ {} }},\n", self.keys(field, at).join(", "))
            });
            let fields: String = fields.collect();
            views.push(format!("\n{begin}\nfields = [\n{fields}]\n"));
        }
        if known.is_empty() {
            return String::new();
        }
        let name = format!("mavlink{version}");
        let shipped = shipped(&name).expect("both versions are shipped");
        let (parts, _) = shipped.split_once("\n# The values").expect("views follow");
        let known = format!("known = [{}\n]", known.concat());
        let parts = parts.replace("known = \"ardupilotmega\"", &known);
        format!("\n[[kinds]]\nname = {name:?}\n{parts}{}", views.concat())
    }

    /// Returns the keys of a field in a description.
    fn keys(&self, field: &Field, at: usize) -> Vec<String> {
        let is_taken = TAKEN.contains(&format!(" {} ", field.name.to_lowercase()));
        let (name, end) = (field.name, if is_taken { "_" } else { "" });
        let (class, is_text) = (field.class, field.class == "text");
        let place = format!("name = \"{name}{end}\", at = {at}, type = {class:?}");
        let mut keys = vec![place];
        let count = field.count.or(is_text.then_some(1));
        keys.extend(count.map(|count| format!("count = {count}")));
        if is_text {
            keys.push("padding = \"00\"".to_owned());
            return keys;
        }
        let (scale, unit) = field.scale_and_unit();
        keys.extend(scale.map(|scale| format!("scale = {scale:?}")));
        keys.extend(unit.map(|unit| format!("unit = {unit:?}")));
        let own = field.node.attribute("enum");
        let own = own.and_then(|name| self.enums.get(name));
        let missing = field.missing(own);
        keys.extend(missing.map(|missing| format!("missing = {missing}")));
        let is_bitmask = field.node.attribute("display") == Some("bitmask");
        if let Some(own) = own.filter(|own| !own.is_bitmask && !is_bitmask && !field.is_float()) {
            let names = own.entries.iter();
            let names = names.map(|(value, name)| format!("{value} = {name:?}"));
            let names = names.collect::<Vec<_>>().join(", ");
            keys.push(format!("names = {{ {names} }}"));
        }
        keys
    }
}

impl<'d> Field<'d> {
    fn read(node: Node<'d, 'd>) -> Option<Self> {
        let name = node.attribute("type")?;
        let array = name.strip_suffix(']').and_then(|name| name.split_once('['));
        let (element, count) = array.unwrap_or((name, "1"));
        let count = count.parse::<u8>().ok()?;
        let class = row(TYPES, element)?;
        let bits = class.trim_matches(|c: char| c.is_alphabetic());
        Some(Self {
            name: node.attribute("name")?,
            element: element.trim_end_matches("_mavlink_version"),
            class,
            bytes: bits.parse().map_or(1, |bits: usize| bits / 8),
            count: array.map(|_| count),
            node,
        })
    }

    fn is_float(&self) -> bool {
        self.class.starts_with('f')
    }

    /// Returns the factor and the unit of a number. A whole number in cdeg, for example, is shown in deg.
    fn scale_and_unit(&self) -> (Option<f64>, Option<&'d str>) {
        let unit = self.node.attribute("units");
        let unit = unit.filter(|unit| !unit.contains(char::is_whitespace));
        let multiplier = self.node.attribute("multiplier").map(str::parse);
        let scaled = unit.and_then(|unit| row(UNITS, unit)?.split_once(' '));
        match (multiplier, scaled) {
            (None, Some((factor, unit))) if !self.is_float() => (factor.parse().ok(), Some(unit)),
            (None, _) => (None, unit),
            (Some(Ok(factor)), _) if !self.is_float() => (Some(factor), unit),
            // A factor such as 360/255 is no decimal number, and floating-point numbers are never scaled. Leave out the
            // unit, because it would be wrong for the unscaled number.
            (Some(_), _) => (None, None),
        }
    }

    /// Returns the number that means that there is no value. `own` is the field's enum.
    fn missing(&self, own: Option<&Enum>) -> Option<String> {
        let text = self.node.attribute("invalid")?;
        let text = match self.count {
            Some(_) => text.strip_prefix('[')?.strip_suffix(']')?,
            None => text,
        };
        // In `[x:]`, each value x of the array means a missing value. In `[x]`, x as the first value means that the
        // whole array is missing. Ignore `[0]`, because a 0 among the other values is a number.
        if self.count.is_some() && text == "0" {
            return None;
        }
        let text = text.trim_end_matches(':');
        let named = || own?.entries.iter().find(|(_, name)| **name == text);
        let whole = || whole(text).or_else(|| Some(*named()?.0));
        let float = || text.parse::<f64>().ok().filter(|_| self.is_float());
        let number = row(NUMBERS, text).map(str::to_owned);
        let number = number.or_else(|| Some(whole()?.to_string()));
        number.or_else(|| Some(format!("{:?}", float()?).to_lowercase()))
    }
}

/// Returns the rest of the row that begins with this name.
fn row(table: &'static str, name: &str) -> Option<&'static str> {
    let mut rows = table.split(", ").filter_map(|row| row.split_once(' '));
    rows.find(|(first, _)| *first == name).map(|(_, rest)| rest)
}

/// Reads a whole number, such as 12 or 0xFF.
fn whole(text: &str) -> Option<i64> {
    match text.strip_prefix("0x") {
        Some(digits) => i64::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

/// Returns the number of bytes in these fields.
fn length(fields: &[Field]) -> usize {
    let bytes = |field: &Field| field.bytes * usize::from(field.count.unwrap_or(1));
    fields.iter().map(bytes).sum()
}

/// Returns CRC_EXTRA, a checksum of the definition of a message. It covers the fields that are not extensions.
fn extra(name: &str, fields: &[Field]) -> u8 {
    let mut covered = format!("{name} ").into_bytes();
    for field in fields {
        covered.extend(format!("{} {} ", field.element, field.name).bytes());
        covered.extend(field.count);
    }
    let [low, high, ..] = CRC.of(&covered, None).to_le_bytes();
    low ^ high
}
