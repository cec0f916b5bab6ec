//! Mistakes in descriptions. Each error names the position of the mistake, and parsing always ends in reasonable time.

use std::path::Path;

use framelock_description::{Description, read};

/// One description per line, with `\n` for a line break, and its error after `=>`.
const WRONG: &str = r#"
    sync = "2G" => 1:8: word 1, '2G', has 'G', which is no hex digit
    sync = "" => 1:8: no bytes: leave the key out
    sync = 5 => 1:8: invalid type: integer `5`, expected a string
    sync = "C8 | EE 01"\nlength = 4 => 1:8: all alternatives for these bytes must have the same length
    sync = "24"\nlength = 4\nterminator = "00 | 0D 0A" => 3:14: other terminators: without a content, other bytes of a frame may look like them
    sync = "24"\nlength = 4\ncontent = "20-7E" => 3:11: content: only frames that a delimiter ends can have a content
    sync = "24"\nlongest = 9\nterminator = "0A"\ncontent = "7E-20" => 4:11: word 1, '7E-20', is not a byte, or a range such as 20-7E
    sync = "24"\nlongest = 9\nterminator = "0A"\ncontent = "20 7" => 4:11: word 1, '7', is not a whole number of bytes
    sync = "24"\nlongest = 9\nterminator = "0A"\ncontent = "20-21 except 20-2F" => 4:11: no bytes: leave the key out
    sync = "24"\nlongest = 9\nterminator = "0A | 0D 0A"\ncontent = "00-0D" => 4:11: content: a terminator begins with a byte of the content
    sync = "24"\nlongest = 9\nterminator = "0A 0D | 0A"\ncontent = "20-7E" => 3:14: other terminators: one begins with another one
    sync = "24"\nlongest = 9\nterminator = "0A"\ncontent = "20-7E"\nshortest = 3\nfields = [{ name = "a", at = 1, type = "u8", value = 7 }] => 6:54: fixed: no frame can be made
    sync = "24"\nlongest = 9\nterminator = "0A | 0D 0A"\ncontent = "20-7E"\nfields = [{ name = "a", at = -1, type = "u8" }] => 5:30: a overlaps the terminator
    sync = "24"\nlongest = 9\nterminator = "0A"\ncontent = "20-7E"\nchecksum = { name = "xor", type = "u8", at = -2 } => 5:12: checksum: its bytes may be outside the content
    length = 4 => 1:1: sync: nothing tells a frame from noise
    sync = "24" => 1:1: nothing ends a frame
    sync = "24"\nlenght = 4 => 2:1: unknown field `lenght`
    sync = "24"\nlength = 4\nlength = 5 => 3:1: duplicate key
    sync = "24"\nlength = 4\nlongest = 5 => 2:10: every frame has this length
    sync = "24"\nlength = 70000 => 2:10: longest must be from 1 to 65791
    sync = "24 25"\nlength = 2\nterminator = "0A" => 2:10: longest: the header and the terminator do not fit
    sync = "24"\nlength = 4\nlength_field = { at = 1, type = "u8", plus = 2 } => 2:10: length is for frames of the same length
    sync = "24"\nlength_field = { at = -1, type = "u8", plus = 2 }\nlongest = 9 => 2:23: this is needed before the frame's end is known
    sync = "24"\nlength_field = { at = 1, type = "u16", plus = 2 } => 2:33: there is no u16 (perhaps u16le?); there are u8, u16le
    sync = "24"\nlength_field = { at = 1, type = "i8", plus = 2 } => 2:33: this must be an unsigned number of up to four bytes
    sync = "24"\nlength_field = { at = 1, type = "u8", factor = 0 }\nlongest = 9 => 2:16: length: with this mask or factor
    sync = "24"\nlength_field = { at = 1, type = "u8", mask = 0x100 }\nlongest = 9 => 2:16: length: with this mask or factor
    sync = "24"\nlength_field = { at = 1, type = "u8", plus = 2 } => 1:1: give longest
    sync = "24"\nlongest = 300\nlength_field = { at = 1, type = "u8", plus = 2 } => 2:11: longest: it is more than the greatest length
    sync = "24"\nlongest = 40\nlength_field = { at = 1, type = "u8", mask = 7, factor = 2, plus = 2 } => 2:11: longest: it is more than the greatest length
    sync = "24"\nlongest = 1\nlength_field = { at = 1, type = "u8", plus = 2 } => 2:11: longest: it is less than shortest
    sync = "24"\nlength = 4\nchecksum = { name = "CRC-8/DVBS3", type = "u8", at = -1 } => 3:21: there is no CRC-8/DVBS3 (perhaps CRC-8/DVB-S2?); there are CRC-8/DVB-S2
    sync = "24"\nlength = 4\nchecksum = { name = "CRC-16/MODBUS", type = "u8", at = -1 } => 3:12: checksum: the algorithm needs another number of bytes
    sync = "24"\nlength = 9\nchecksum = { name = "CRC-12/DECT", type = "u8", at = -1 } => 3:12: checksum: the algorithm needs another number of bytes
    sync = "24"\nlength = 9\nchecksum = { name = "xor", type = "hex16", at = -4 } => 3:12: checksum: the algorithm needs another number of bytes
    sync = "24"\nlength = 9\nchecksum = { type = "u8", at = -1 } => 3:12: give a name, or a CRC's width and polynomial
    sync = "24"\nlength = 9\nchecksum = { name = "xor", polynomial = 7, type = "u8", at = -1 } => 3:12: give a name, or
    sync = "24"\nlength = 9\nchecksum = { width = 40, polynomial = 7, type = "u8", at = -1 } => 3:12: checksum: the width of a CRC must be 8 to 32
    sync = "24"\nlength = 9\nchecksum = { width = 8, polynomial = 0x107, type = "u8", at = -1 } => 3:12: checksum: the polynomial, the initial or the xored value has more bits
    sync = "24"\nlength = 4\nchecksum = { name = "xor", type = "u8", at = -1, to = -1 } => 3:12: checksum: it covers itself
    sync = "24"\nlength = 4\nchecksum = { name = "xor", type = "u8", at = -2, from = 3 } => 3:12: checksum: the bytes that it covers
    sync = "24"\nlength = 4\nchecksum = { name = "xor", type = "u8", at = 4 } => 3:12: checksum: it is outside of the shortest
    sync = "24"\nlength = 4\nchecksum = { name = "xor", type = "hex8", at = -1 } => 3:12: checksum: it is outside of the shortest
    sync = "24"\nlength = 4\nchecksum = { name = "xor", type = "u8", at = -1 }\nterminator = "0A" => 3:12: checksum: it overlaps the sync
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 4, type = "bytes" }] => 3:11: no bytes of the frame are left
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 3, type = "u16le" }] => 3:30: a is not in a frame of 4 bytes
    sync = "24 25"\nlength = 4\nfields = [{ name = "a", at = 1, type = "u16le" }] => 3:30: a overlaps the sync
    sync = "24"\nlength_field = { at = 1, type = "u16be", mask = 0x03FF }\nlongest = 20\nfields = [{ name = "a", at = 1, bit = 1, bits = 2 }] => 4:30: a overlaps the length
    sync = "24"\nlength = 4\nchecksum = { name = "xor", type = "u8", at = -1 }\nfields = [{ name = "a", at = 2, type = "u16le" }] => 4:30: a overlaps the checksum
    any_of = ["ubx"]\nlenght = 4 => 2:1: unknown field `lenght` (perhaps length?); expected one of `any_of`, `kinds`
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 1, type = "u8" }, { name = "a", at = 2, type = "u8" }] => 3:11: two values are called a
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 1, type = "u8", count = 2 }, { name = "a1", at = 3, type = "u8" }] => 3:11: two values are called a1
    sync = "24"\nlength = 4\nfields = [{ name = "time", at = 1, type = "u8" }] => 3:20: offset, length, time are the names of other columns
    sync = "24"\nlength = 4\nfields = [{ name = "A b", at = 1, type = "u8" }] => 3:20: a name must have only letters
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 1 }] => 3:11: a field must have either a type, or bits
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 1, type = "u8", value = 256 }] => 3:54: this value does not fit
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 1, type = "u8", value = [1, 256] }] => 3:54: these values do not fit
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 1, type = "u8", value = "1" }] => 3:54: a value is a whole number, or a list
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 1, type = "u8", value = [1, 1] }] => 3:54: messages: the numbers are not in ascending order, or one is listed twice
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = -2, type = "u8", value = [1, 2] }] => 3:55: only one field can have a list of values
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 1, type = "u8", mask = 0x100 }] => 3:53: only a whole number can have a mask
    sync = "24"\nlength = 8\nfields = [{ name = "a", at = 1, type = "f32le", scale = 0.1 }] => 3:57: only a whole number can have a scale and an offset
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 1, type = "u8", scale = 0 }] => 3:54: a scale must not be 0
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 1, type = "bytes", offset = 1 }] => 3:58: only a whole number can have a scale and an offset
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 1, type = "u8" }, { name = "A", at = 2, type = "u8" }] => 3:11: two values are called A
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 1, type = "u8", item = [1, "number"] }] => 3:53: only text can have an item
    sync = "24"\nlength = 4\n[[views]]\nname = "v"\nat = 1\nbytes = "07"\nfields = [{ name = "x", at = 3, type = "u16le" }] => 7:30: x is not in a frame of 4 bytes
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 1, type = "u8", unit = "m\u001B" }] => 3:53: a unit must be a word
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 1, type = "u8", units = "m" }] => 3:46: unknown field `units`
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = -1, type = "bytes" }] => 3:30: a field that takes the rest of the frame must be counted from the front
    sync = "24"\nlongest = 40\nlength_field = { at = 1, type = "u8", plus = 2 }\nfields = [{ name = "a", at = 9, type = "u8", value = 1 }] => 4:54: fixed: the shortest frame has no byte at this offset: give a greater shortest
    sync = "24"\nlength = 9\nmessages = { at = 1, type = "u8", known = { x = 1 } } => 3:43: known messages are "common"
    sync = "24"\nlength = 9\ntrailer = { name = "a", at = 1, mask = 1, bytes = 4 } => 3:11: trailer: only frames with a length field
    sync = "24"\nlongest = 9\nlength_field = { at = 1, type = "u8", plus = 2 }\ntrailer = { name = "a", at = 1, mask = 0, bytes = 4 } => 4:11: trailer: only frames with a length field
    sync = "24"\nlongest = 9\nlength_field = { at = 1, type = "u8", plus = 2 }\ntrailer = { name = "a", at = 1, mask = 1, bytes = 8 } => 4:11: trailer: the shortest frame with a trailer
    sync = "24"\nlongest = 9\nlength_field = { at = 1, type = "u8", plus = 2 }\nshortest = 1 => 2:11: shortest: a frame of this length has no room for its header
    sync = "24"\nlongest = 9\nlength_field = { at = 1, type = "u8", mask = 0xF0 }\nshortest = 5 => 3:16: length: no frame can be made
    sync = "24"\nlength = 9\nmessages = { at = 1, type = "u8", known = [] } => 3:12: messages: no frame can be made
    sync = "24"\nlength = 9\nmessages = { at = 1, type = "u8", known = [[300]] } => 3:12: messages: no frame can be made
    sync = "24"\nlength = 9\nfields = [{ name = "a", at = 0, type = "u8", value = 1 }] => 3:30: a overlaps the sync
    sync = "24"\nlength = 9\nterminator = "0A"\nfields = [{ name = "a", at = -1, type = "u8", value = 1 }] => 4:30: a overlaps the terminator
    sync = "24"\nlength = 9\nfields = [{ name = "b", at = 1, type = "u8" }, { name = "a", at = 2, type = "u8", value = 1 }, { name = "c", at = 2, type = "u8", value = 2 }] => 3:139: fixed: no frame can be made
    sync = "24"\nlength = 9\nchecksum = { width = 8, polynomial = 0, type = "u8", at = -1 } => 3:12: checksum: the polynomial is 0
    any_of = ["ubx", "nmae"] => 1:18: there is no nmae (perhaps nmea?); there are bin
    sync = "24"\nlength = 3\n[[kinds]]\nfields = [] => 3:1: a kind must have a name
    sync = "24"\nlength = 3\n[[kinds]]\nname = "a,b" => 3:1: a kind must have a name of letters, digits, - and _
    sync = "24"\nlength = 3\n[[kinds]]\nname = "a"\n[[kinds]]\nname = "a" => 3:1: two kinds are called a
    sync = "24"\nlength = 3\n[[kinds]]\nname = "a"\nfields = [{ name = "x", at = 1, type = "u8" }]\n[[kinds]]\nname = "b"\nfields = [{ name = "x", at = 1, type = "bytes" }] => 3:1: two kinds have different values called x
    sync = "24"\nlength = 3\n[[kinds]]\nname = "a"\nfields = [{ name = "kind", at = 1, type = "u8" }]\n[[kinds]]\nname = "b" => 3:1: two values are called kind
    sync = "24"\nlength = 3\n[[kinds]]\nname = "a"\n[[kinds]]\nname = "b" => 5:1: kind b never occurs: each of its frames is also one of kind a
    any_of = ["ubx"]\nsync = "24" => 1:11: any_of names complete descriptions: move the other keys into [[kinds]]
    sync = "24"\nlength = 4\nends = "silence" => 3:8: ends = "silence" is for frames that nothing else ends
    sync = "24"\npackets = "slip"\nends = "silence" => 3:8: ends = "silence" is for frames that nothing else ends
    sync = "24"\nends = "silent" => 2:8: unknown variant `silent`, expected `silence`
    sync = "24"\nends = "silence" => 1:1: give longest
    sync = "24"\nlength = 4\nbehind = 1 => 3:10: behind: only frames that one delimiter ends
    sync = "24"\nlength = 4\nbehnid = 1 => 3:1: unknown field `behnid` (perhaps behind?)
    sync = "24"\nlongest = 9\nterminator = "0A"\nbehind = 9 => 2:11: longest: it is less than shortest
    packets = "slpi"\nlongest = 9 => 1:11: there is no slpi (perhaps slip?); there are slip, hdlc, cobs, dle, break
    packets = { delimiter = "7E", escape = "7D" }\nlongest = 9 => 1:11: packets have a name, or these bytes in hex: delimiter, escape and xor
    packets = { delimiter = "7E", escape = "7G", xor = "20" }\nlongest = 9 => 1:11: word 1, '7G', has 'G'
    packets = 7\nlongest = 9 => 1:11: packets are a name or a table
    packets = { delimiter = "7E", escape = "7E", xor = "20" }\nlongest = 9 => 1:11: packets: the delimiter, the escape byte and the codes must differ
    packets = { delimiter = "7E", escape = "7D", xor = "03" }\nlongest = 9 => 1:11: packets: the delimiter, the escape byte and the codes must differ
    packets = { delimiter = "C0", escape = "DB", delimiter_code = "DC", escape_code = "DC" }\nlongest = 9 => 1:11: packets: the delimiter
    packets = { escape = "10", end = "10" }\nlongest = 9 => 1:11: packets: the delimiter
    any_of = ["ubx", "slip"] => 1:1: all kinds must have the same packets
    longest = 9\n[[kinds]]\nname = "a"\npackets = "slip"\n[[kinds]]\nname = "b"\npackets = "cobs" => 5:1: all kinds must have the same packets
    sync = "FF FF FD 00"\nlength = 9 => 1:8: frames of Dynamixel 2 contain an inserted FD
    sync = "24"\nlength = 4\nchecksum = { name = "inverted-sum", type = "u8", at = -1 } => 3:21: inverted-sum is now name = "sum" with xor = 0xFF
    sync = "24"\nlength = 4\nchecksum = { name = "negated-sum", type = "u8", at = -1 } => 3:21: negated-sum is now name = "sum" with initial = 0xFF and xor = 0xFF
    sync = "24"\nlength = 4\nchecksum = { name = "CRC-8", xor = 1, type = "u8", at = -1 } => 3:12: give a name, or a CRC's width and polynomial
    sync = "24"\nlength = 4\nchecksum = { name = "sum", over = "hex", type = "u8", at = -1 } => 3:35: unknown variant `hex`, expected `hex digits`
"#;

#[test]
fn what_is_wrong_with_a_description_is_told_with_its_place() {
    for case in WRONG.lines().filter(|line| !line.trim().is_empty()) {
        let (text, told) = case.trim().split_once(" => ").unwrap();
        let problem = Description::parse("my.toml", &text.replace("\\n", "\n")).err();
        let problem = problem
            .unwrap_or_else(|| panic!("nothing is wrong with {text}"))
            .to_string();
        assert!(
            problem.starts_with(&format!("my.toml:{told}")),
            "{text}:\n {problem}\n not {told}"
        );
    }
}

#[test]
fn a_file_without_end_or_of_other_things_is_no_description() {
    if cfg!(unix) {
        let told = read(Path::new("/dev/zero")).unwrap_err().to_string();
        assert!(
            told.contains("/dev/zero is longer than 1048576 bytes"),
            "{told}"
        );
    }
    let told = read(&std::env::current_exe().unwrap())
        .unwrap_err()
        .to_string();
    assert!(
        told.contains("is longer than") || told.contains("is not text"),
        "{told}"
    );
    let told = read(Path::new("nowhere.toml")).unwrap_err().to_string();
    assert!(told.starts_with("cannot read nowhere.toml: "), "{told}");
}

#[test]
fn more_than_a_row_can_have_is_refused_before_it_is_made() {
    let field =
        |name: usize| format!("{{ name = \"a{name}_\", at = 1, type = \"u8\", count = 60000 }}");
    let kinds = (0..99).map(|number| {
        format!(
            "[[kinds]]\nname = \"k{number}\"\nfields = [{}]\n",
            field(number)
        )
    });
    let text = format!(
        "sync = \"24\"\nlength = 60001\n{}",
        kinds.collect::<Vec<_>>().concat()
    );
    let told = Description::parse("my.toml", &text)
        .unwrap_err()
        .to_string();
    assert!(
        told.contains("the number of values in a row must be from 1 to 10000"),
        "{told}"
    );
    let kinds = (0..3000).map(|number| format!("[[kinds]]\nname = \"k{number}\"\n"));
    let text = format!(
        "sync = \"24\"\nlength = 3\n{}",
        kinds.collect::<Vec<_>>().concat()
    );
    let told = Description::parse("my.toml", &text)
        .unwrap_err()
        .to_string();
    assert!(
        told.contains("the number of kinds must be from 1 to 100"),
        "{told}"
    );
}
