//! Converts MAVLink's definitions, which are XML files, to the text of a description.
//!
//! The description has two kinds of frames, MAVLink 2 and MAVLink 1. Each kind has a view of every message. In a frame,
//! a message's fields are sorted by the sizes of their types. The extensions follow in the order of the definition, and
//! MAVLink 1 has none.
//!
//! Source: <https://mavlink.io/en/guide/serialization.html>, "Field Reordering" and "CRC_EXTRA Calculation", and
//! <https://mavlink.io/en/guide/xml_schema.html>.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::ops::{Range, RangeInclusive};
use std::path::{Path, PathBuf};

use roxmltree::{Document, Node};

use crate::problem::{Located, Mistake, Problem};
use crate::{read_text, shipped};

/// The types of values in a definition, and the types of the same values in a description.
const TYPES: [&str; 11] = [
    "char", "uint8_t", "int8_t", "uint16_t", "int16_t", "uint32_t", "int32_t", "float", "uint64_t",
    "int64_t", "double",
];
const OWN_TYPES: [&str; 11] = [
    "text", "u8", "i8", "u16le", "i16le", "u32le", "i32le", "f32le", "u64le", "i64le", "f64le",
];

/// The names of columns that every frame has. A field with such a name gets an underscore at its end.
const TAKEN: [&str; 10] = [
    "offset",
    "length",
    "time",
    "kind",
    "sequence",
    "system",
    "component",
    "message",
    "signature",
    "compatible_flags",
];

/// The units in which whole numbers are shown. A definition may have tenths, hundredths or thousandths of them.
const UNITS: [&str; 10] = [
    "deg", "deg/s", "degC", "rad/s", "m", "m/s", "V", "A", "%", "gauss",
];

/// The rule that an element named "message" must obey.
const RULE: &str = "a message of MAVLink has a name, an id that no other message has, and fields of at most 255 bytes. A \
    field has a name and a type: char, int8_t, uint8_t and so on to uint64_t, float, double, or an array such as float[4]";

/// The messages and the enums of a definition and of the definitions that it includes.
#[derive(Default)]
struct Definition<'d> {
    messages: BTreeMap<u32, Message<'d>>,
    enums: Vec<Node<'d, 'd>>,
}

struct Message<'d> {
    name: &'d str,
    /// The fields in the order of a frame.
    fields: Vec<Field<'d>>,
    /// The number of fields that are not extensions. They come first.
    base: usize,
}

struct Field<'d> {
    name: &'d str,
    /// The type of the values in the definition, and in a description.
    element: &'d str,
    class: &'static str,
    /// The number of values in an array.
    count: Option<u8>,
    node: Node<'d, 'd>,
}

/// Returns the description of the messages in a definition. `text` is the text of the file at `path`.
pub(crate) fn description(path: &Path, text: String) -> Result<String, Problem> {
    let mut files = Vec::new();
    add_file(&mut files, path, text)?;
    let parsed = files.iter().map(|(path, text)| parse(path, text));
    let documents = parsed.collect::<Result<Vec<_>, _>>()?;
    let mut definition = Definition::default();
    for (document, (path, text)) in documents.iter().zip(&files) {
        for node in document.descendants() {
            match node.tag_name().name() {
                "enum" => definition.enums.push(node),
                "message" if definition.add_message(node).is_none() => {
                    return Err(problem(path, text, node.range(), RULE.into()));
                }
                _ => {}
            }
        }
    }
    let name = path.file_name().unwrap_or_default().display();
    let begin = format!("# The messages of {name} and of the files that it includes\n");
    Ok([begin, definition.kind(2), definition.kind(1)].concat())
}

/// Adds a file and the files that it includes. Files may include each other in a circle.
fn add_file(files: &mut Vec<(PathBuf, String)>, path: &Path, text: String) -> Result<(), Problem> {
    let path = path.canonicalize().unwrap_or(path.into());
    if files.iter().any(|(other, _)| *other == path) {
        return Ok(());
    }
    files.push((path.clone(), text.clone()));
    let document = parse(&path, &text)?;
    let includes = document.descendants();
    for node in includes.filter(|node| node.has_tag_name("include")) {
        let included = path.with_file_name(node.text().unwrap_or_default().trim());
        let own = read_text(&included).map_err(|error| {
            let mistake = Mistake::Include(error.to_string());
            problem(&path, &text, node.range(), mistake)
        })?;
        add_file(files, &included, own)?;
    }
    Ok(())
}

fn parse<'d>(path: &Path, text: &'d str) -> Result<Document<'d>, Problem> {
    Document::parse(text).map_err(|error| {
        let lines = text
            .split_inclusive('\n')
            .take(error.pos().row as usize - 1);
        let start = lines.map(str::len).sum();
        problem(path, text, start..start, Mistake::Toml(error.to_string()))
    })
}

fn problem(path: &Path, text: &str, span: Range<usize>, mistake: Mistake) -> Problem {
    Problem::within(
        &path.display().to_string(),
        text,
        Located::new(span, mistake),
    )
}

impl<'d> Definition<'d> {
    /// Adds a message. Returns `None` if the message does not obey the rule.
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
        fields[..base].sort_by_key(|field| Reverse(bytes(field.class)));
        let number = node.attribute("id")?.parse().ok()?;
        let name = word(node)?;
        let is_short = length(&fields) <= 255;
        let other = self.messages.insert(number, Message { name, fields, base });
        (is_short && other.is_none()).then_some(())
    }

    /// Returns the description of the frames of a version, or an empty text if the version has none of the messages.
    fn kind(&self, version: u8) -> String {
        let (at, width, first) = if version == 1 { (5, 1, 6) } else { (7, 3, 10) };
        let (mut known, mut views) = (String::new(), String::new());
        for (number, message) in self.messages.range(..1 << (8 * width)) {
            let Message { name, fields, base } = message;
            let base = &fields[..*base];
            // Later definitions may extend the messages of MAVLink 2. Those of MAVLink 1 have one length.
            let (fields, longest) = match version {
                1 => (base, format!(", {}", length(base))),
                _ => (&**fields, String::new()),
            };
            known += &format!("[{number}, {}{longest}], ", extra(name, base));
            let bytes = number.to_le_bytes().map(|byte| format!("{byte:02X}"));
            let bytes = bytes[..width].join(" ");
            views += &format!(
                "\n[[kinds.views]]\nname = \"{name}\"\nat = {at}\nbytes = \"{bytes}\"\nfields = [\n"
            );
            for (index, field) in fields.iter().enumerate() {
                let at = first + length(&fields[..index]);
                views += &format!("    {{ {} }},\n", self.entry(field, at).join(", "));
            }
            views += "]\n";
        }
        if known.is_empty() {
            return known;
        }
        let name = format!("mavlink{version}");
        let shipped = shipped(&name).expect("both versions are shipped").lines();
        let parts = shipped.take_while(|line| *line != "[[views]]");
        let parts: Vec<&str> = parts.filter(|line| !line.starts_with('#')).collect();
        let known = format!("[{known}]");
        let parts = parts.join("\n").replace("\"ardupilotmega\"", &known);
        format!("\n[[kinds]]\nname = \"{name}\"\n{parts}\n{views}")
    }

    /// Returns the keys of a field in a description.
    fn entry(&self, field: &Field, at: usize) -> Vec<String> {
        let is_taken = TAKEN.contains(&&*field.name.to_lowercase());
        let name = format!(
            "name = \"{}{}\"",
            field.name,
            if is_taken { "_" } else { "" }
        );
        let mut keys = vec![
            name,
            format!("at = {at}"),
            format!("type = \"{}\"", field.class),
        ];
        let count = field.count.or((field.class == "text").then_some(1));
        keys.extend(count.map(|count| format!("count = {count}")));
        if field.class == "text" {
            keys.push("padding = \"00\"".to_owned());
            return keys;
        }
        let (scale, unit) = field.scale_and_unit();
        keys.extend(scale.map(|scale| format!("scale = {scale}")));
        keys.extend(unit.map(|unit| format!("unit = {unit:?}")));
        keys.extend(
            self.missing(field)
                .map(|missing| format!("missing = {missing}")),
        );
        let names = self.names(field);
        if !names.is_empty() {
            keys.push(format!("names = {{ {} }}", names.join(", ")));
        }
        keys
    }

    /// Returns the names of a field's values. The values of a bitmask have no names, because each is a sum of entries.
    fn names(&self, field: &Field) -> Vec<String> {
        let is_bitmask = |node: &Node| node.attribute("bitmask") == Some("true");
        if field.is_float()
            || field.node.has_attribute("display")
            || self.enums_of(field).any(is_bitmask)
        {
            return Vec::new();
        }
        let entries = self.entries(field);
        let names = entries.range(range(field.class));
        names
            .map(|(value, name)| format!("{value} = \"{name}\""))
            .collect()
    }

    /// Returns the value of a field that means that there is no value.
    fn missing(&self, field: &Field) -> Option<String> {
        let text = field.node.attribute("invalid")?;
        let text = match field.count {
            Some(_) => text.strip_prefix('[')?.strip_suffix(']')?,
            None => text,
        };
        // `[x:]` marks each value of an array. `[x]` marks the first value for all, so a 0 among the others is a number.
        let each = text.strip_suffix(':');
        if each.is_none() && field.count.is_some() && text == "0" {
            return None;
        }
        let text = each.unwrap_or(text);
        let entries = self.entries(field);
        let named = || {
            entries
                .iter()
                .find(|(_, name)| **name == text)
                .map(|(value, _)| *value)
        };
        match whole(text).or_else(|| limit(text)).or_else(named) {
            Some(value) if field.is_float() || range(field.class).contains(&value) => {
                Some(value.to_string())
            }
            None if field.is_float() => text
                .parse::<f64>()
                .ok()
                .map(|value| format!("{value:?}").to_lowercase()),
            _ => None,
        }
    }

    /// Returns the entries of a field's enum, of which several files may have a part.
    fn entries(&self, field: &Field) -> BTreeMap<i128, &str> {
        let (mut entries, mut next) = (BTreeMap::new(), 0);
        for entry in self.enums_of(field).flat_map(|node| node.children()) {
            let value = entry.attribute("value").map_or(Some(next), whole);
            if let (Some(value), Some(name)) = (value, word(entry)) {
                entries.entry(value).or_insert(name);
                next = value + 1;
            }
        }
        entries
    }

    fn enums_of(&self, field: &Field) -> impl Iterator<Item = &Node<'d, 'd>> {
        let name = field.node.attribute("enum");
        let is_own = move |node: &&Node| name.is_some() && node.attribute("name") == name;
        self.enums.iter().filter(is_own)
    }
}

impl<'d> Field<'d> {
    fn read(node: Node<'d, 'd>) -> Option<Self> {
        let text = node.attribute("type")?;
        let array = text.strip_suffix(']').and_then(|text| text.split_once('['));
        let (element, count) = array.unwrap_or((text, "1"));
        let element = element.trim_end_matches("_mavlink_version");
        let count = count.parse::<u8>().ok()?;
        Some(Self {
            name: word(node)?,
            element,
            class: class(element)?,
            count: array.map(|_| count),
            node,
        })
    }

    fn is_float(&self) -> bool {
        self.class.starts_with('f')
    }

    /// Returns the factor and the unit of a number. A whole number in cdeg, for example, is shown in deg.
    fn scale_and_unit(&self) -> (Option<&'d str>, Option<&'d str>) {
        let unit = self.node.attribute("units");
        if let Some(factor) = self.node.attribute("multiplier") {
            // A factor such as 360/255 is no decimal number.
            let is_shown = factor.parse::<f64>().is_ok() && !self.is_float();
            return (is_shown.then_some(factor), unit.filter(|_| is_shown));
        }
        let scaled = || {
            let (prefix, base) = unit?.split_at_checked(1)?;
            let factor = match (prefix, base) {
                ("d", "egE5") => return Some(("1e-5", "deg")),
                ("d", "egE7") => return Some(("1e-7", "deg")),
                ("d", _) => "0.1",
                ("c", _) => "0.01",
                ("m", _) => "0.001",
                _ => return None,
            };
            UNITS.contains(&base).then_some((factor, base))
        };
        match scaled().filter(|_| !self.is_float()) {
            Some((factor, unit)) => (Some(factor), Some(unit)),
            None => (None, unit),
        }
    }
}

/// Returns the type in a description that has the values of a type in a definition.
fn class(element: &str) -> Option<&'static str> {
    let index = TYPES.iter().position(|own| *own == element)?;
    Some(OWN_TYPES[index])
}

/// Returns the number of bytes in a value.
fn bytes(class: &str) -> usize {
    let bits = class.trim_matches(|c: char| c.is_ascii_alphabetic());
    bits.parse::<usize>().map_or(1, |bits| bits / 8)
}

/// Returns the range of a whole number's values.
fn range(class: &str) -> RangeInclusive<i128> {
    let bits = 8 * bytes(class);
    if class.starts_with('i') {
        -1 << (bits - 1)..=(1 << (bits - 1)) - 1
    } else {
        0..=(1 << bits) - 1
    }
}

/// Returns the greatest number of a type, as in `UINT16_MAX`, or the least, as in `INT8_MIN`.
fn limit(text: &str) -> Option<i128> {
    let (element, end) = text.rsplit_once('_')?;
    let range = range(class(&(element.to_lowercase() + "_t"))?);
    Some(if end == "MIN" {
        *range.start()
    } else {
        *range.end()
    })
}

/// Reads a whole number, such as 12, 0xFF, 0b11 or 2**4.
fn whole(text: &str) -> Option<i128> {
    let number = |digits: &str, radix| i128::from_str_radix(digits, radix).ok();
    match (text.get(..2), text.split_once("**")) {
        (Some("0x"), _) => number(&text[2..], 16),
        (Some("0b"), _) => number(&text[2..], 2),
        (_, Some((base, exponent))) => number(base, 10)?.checked_pow(exponent.parse().ok()?),
        _ => number(text, 10),
    }
}

/// Returns the number of bytes in fields.
fn length(fields: &[Field]) -> usize {
    let bytes = |field: &Field| bytes(field.class) * usize::from(field.count.unwrap_or(1));
    fields.iter().map(bytes).sum()
}

/// Returns CRC_EXTRA, a checksum of the definition of a message. It covers the fields that are not extensions.
fn extra(name: &str, fields: &[Field]) -> u8 {
    let mut covered = format!("{name} ").into_bytes();
    for Field {
        name,
        element,
        count,
        ..
    } in fields
    {
        covered.extend(format!("{element} {name} ").bytes());
        covered.extend(count);
    }
    let bit = |crc: u16| (crc >> 1) ^ if crc & 1 == 1 { 0x8408 } else { 0 };
    let crc = covered.iter().fold(0xFFFF, |crc, byte| {
        (0..8).fold(crc ^ u16::from(*byte), |crc, _| bit(crc))
    });
    let [low, high] = crc.to_le_bytes();
    low ^ high
}

/// Returns the attribute `name` if the name begins with a letter and has only letters, digits and underscores.
fn word<'d>(node: Node<'d, 'd>) -> Option<&'d str> {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let name = node.attribute("name")?;
    (name.starts_with(|c: char| c.is_ascii_alphabetic()) && name.chars().all(is_plain))
        .then_some(name)
}
