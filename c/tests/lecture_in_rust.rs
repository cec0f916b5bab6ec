//! The Rust code in `docs/protocol.md`. The page shows this file up to the test.

use framelock::motion::{Bin, Setpoint};
use framelock::{Line, Receiver};

struct Platform {
    line: Line<Receiver<Bin>>,
    setpoint: Setpoint,
}

impl Platform {
    fn receive_interrupt(&mut self, byte: u8) {
        if let Some(setpoint) = self.line.push(byte) {
            self.setpoint = setpoint;
        }
    }
}

#[test]
fn the_page_shows_this_file() {
    use crate::delivery::blocks;
    use crate::lecture::PAGE;

    let [code] = blocks(PAGE, "rust")[..] else {
        panic!("the page has one block of Rust");
    };
    assert!(include_str!("lecture_in_rust.rs").contains(code));
    let mut platform = Platform {
        line: Line::new(Receiver::new()),
        setpoint: Setpoint::default(),
    };
    for byte in *b"AB\0\x01AB\0\x02\x03\x04\r" {
        platform.receive_interrupt(byte);
    }
    assert_eq!(platform.setpoint, Setpoint::from([2, 3, 4]));
    assert_eq!(platform.line.counters().discarded.wrong_terminator, 1);
}
