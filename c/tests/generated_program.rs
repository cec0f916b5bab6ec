//! Runs generated modules on streams. Prints the values of each frame, and the frame that encodes these values.
//!
//! A test appends `main` and, for each module, a function `say`, which prints the fields.

use std::fmt::Display;
use std::io::Read;

use framelock::{BufferedReceiver, Found, Frame};

/// A field's values as text, or `None` if the frame does not have the field.
trait Values {
    fn values(&self) -> Option<String>;
}

macro_rules! numbers {
    ($($number:ty)*) => {
        $(impl Values for $number {
            fn values(&self) -> Option<String> {
                Some(each(&[self]))
            }
        }

        impl<const N: usize> Values for [$number; N] {
            fn values(&self) -> Option<String> {
                Some(each(self))
            }
        })*
    };
}

numbers!(u8 u16 u32 u64 i8 i16 i32 i64);

impl Values for f32 {
    fn values(&self) -> Option<String> {
        self.to_bits().values()
    }
}

impl<const N: usize> Values for [f32; N] {
    fn values(&self) -> Option<String> {
        self.map(f32::to_bits).values()
    }
}

impl Values for &[u8] {
    fn values(&self) -> Option<String> {
        Some(each(self))
    }
}

impl<T: Values> Values for Option<T> {
    fn values(&self) -> Option<String> {
        self.as_ref()?.values()
    }
}

fn each(values: &[impl Display]) -> String {
    values.iter().map(|value| format!(" {value}")).collect()
}

fn field(name: &str, field: &impl Values) {
    if let Some(values) = field.values() {
        println!("{name}{values}");
    }
}

/// Reads the next stream from the input. Each stream begins with its length.
fn stream(input: &mut &[u8]) -> Vec<u8> {
    let (length, rest) = input.split_first_chunk().unwrap();
    let (stream, rest) = rest.split_at(u32::from_le_bytes(*length) as usize);
    *input = rest;
    stream.to_vec()
}

fn input() -> Vec<u8> {
    let mut input = Vec::new();
    std::io::stdin().read_to_end(&mut input).unwrap();
    input
}

/// Checks that `encode` fails for values that no frame can contain: a channel of twelve bits, a payload that is too
/// long, an address that does not exist.
fn impossible() {
    let mut made = [0; 100];
    let mut channels = generated::sbus::Message::decode(&[0; 25]);
    channels.channel[3] = 2047;
    assert_eq!(channels.encode(&mut made), Some(25));
    channels.channel[3] = 2048;
    assert_eq!(channels.encode(&mut made), None);
    let crsf = |address, payload| generated::crsf::Message { address, type_: 1, payload };
    assert_eq!(crsf(0xC8, &[0; 60]).encode(&mut made), Some(64));
    assert_eq!(crsf(0xC8, &[0; 61]).encode(&mut made), None);
    assert_eq!(crsf(0x55, &[0; 60]).encode(&mut made), None);
    // Decoding a frame without any bytes must not panic.
    assert_eq!(generated::crsf::Message::decode(&[]), crsf_of_nothing());
}

fn crsf_of_nothing() -> generated::crsf::Message<'static> {
    generated::crsf::Message { address: 0, type_: 0, payload: &[] }
}

macro_rules! receive {
    ($module:ident, $stream:expr) => {{
        let mut receiver =
            BufferedReceiver::<_, [u8; 2 * generated::$module::LONGEST]>::new(generated::$module::Frames);
        let (mut frames, mut discarded) = (0, 0);
        let mut note = |found: Found<Frame<'_, generated::$module::Frames>>| match found {
            Found::Frame { message: frame, .. } => {
                frames += 1;
                let message = frame.message();
                $module::say(&message);
                let mut made = [0; generated::$module::LONGEST];
                match message.encode(&mut made) {
                    Some(length) => {
                        let hex = made[..length].iter().map(|byte| format!("{byte:02X}"));
                        println!("= {}", hex.collect::<String>());
                        assert_eq!(message.encode(&mut made[..length - 1]), None, "no room");
                    }
                    None => println!("= none"),
                }
            }
            Found::Discarded { count, .. } => discarded += count,
        };
        receiver.feed(&$stream, &mut note);
        receiver.line_event(framelock::LineEvent::Idle, &mut note);
        println!("{}: {frames} frames, {discarded} bytes discarded", stringify!($module));
    }};
}
