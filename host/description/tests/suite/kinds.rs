//! Kinds with the same header. The kinds are tried in order until one of them fits.

use framelock::{BufferedReceiver, Format as _};
use framelock_description::{Description, hex};

/// Returns the kinds of the frames in a stream, and the number of discarded bytes.
fn received(description: &Description, stream: &[u8]) -> (Vec<String>, usize) {
    let format = description.format();
    let mut receiver =
        BufferedReceiver::with_buffer(format.clone(), vec![0; 2 * format.longest()]).unwrap();
    let (mut kinds, mut discarded) = (vec![], 0);
    receiver.feed(stream, |found| {
        let count = found.bytes();
        match found.message() {
            Some(frame) => kinds.push(description.kinds[frame.message().0].name.clone()),
            None => discarded += count,
        }
    });
    (kinds, discarded)
}

#[test]
fn a_frame_of_the_second_kind_that_begins_like_the_first() {
    let text = r#"
        sync = "AA"
        checksum = { name = "sum", type = "u8", at = -1 }
        [[kinds]]
        name = "a"
        length = 4
        [[kinds]]
        name = "b"
        length = 5
    "#;
    let description = Description::parse("ab.toml", text).unwrap();
    let stream = hex::parse(&["AA 01 02 03 B0 AA 01 02 AD AA 01 02 03 B0"]).unwrap();
    let (kinds, discarded) = received(&description, &stream);
    assert_eq!(
        (kinds, discarded),
        (["b", "a", "b"].map(str::to_owned).to_vec(), 0)
    );
}

const REQUEST: &str = "
    [[kinds]]
    name = 'request'
    length = 8
    fields = [{ name = 'address', at = 2, type = 'u16be' }, { name = 'count', at = 4, type = 'u16be' }]
";
const RESPONSE: &str = "
    [[kinds]]
    name = 'response'
    length_field = { at = 2, type = 'u8', plus = 5 }
    longest = 255
    fields = [{ name = 'registers', at = 3, type = 'bytes' }]
";

/// Requests to read holding registers, and their responses, as pymodbus 3.16.1 makes them with `FramerRTU.buildFrame`.
const MODBUS: &str = "110300010001D75A 110302022B38F8 110300110002969E 11030402320232CB30 \
    1103002100035751 1103060239023902396195";

#[test]
fn modbus_requests_and_responses_on_one_line() {
    let some = hex::parse(&[MODBUS]).unwrap();
    for kinds in [[REQUEST, RESPONSE], [RESPONSE, REQUEST]] {
        let text = format!(
            "sync = '11 03'
             checksum = {{ name = 'CRC-16/MODBUS', type = 'u16le', at = -2 }}\n{}",
            kinds.concat()
        );
        let description = Description::parse("modbus.toml", &text).unwrap();
        let (kinds, discarded) = received(&description, &some.repeat(20));
        assert_eq!((kinds.len(), discarded), (120, 0), "{text}");
        for pair in kinds.chunks(2) {
            assert_eq!(pair, ["request", "response"]);
        }
    }
}
