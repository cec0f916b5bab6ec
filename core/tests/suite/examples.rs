//! Tests that each example prints the lines that are written at its end.

use std::cell::RefCell;

thread_local! {
    static PRINTED: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Replaces the `println!` of the examples.
macro_rules! println {
    ($($text:tt)*) => { super::print(&format!($($text)*)) };
}

fn print(line: &str) {
    PRINTED.with_borrow_mut(|printed| *printed += &(line.to_owned() + "\n"));
}

macro_rules! examples {
    ($($(#[$attribute:meta])* $name:ident $file:literal;)*) => { $(
        $(#[$attribute])*
        #[path = $file]
        mod $name;

        $(#[$attribute])*
        #[test]
        fn $name() {
            let _ = $name::main();
            let (_, says) = include_str!($file).split_once("\n// It prints:\n").unwrap();
            let says: String = says.lines().map(|line| line.replacen("// ", "", 1) + "\n").collect();
            assert_eq!(PRINTED.take(), says);
        }
    )* };
}

examples! {
    push_in_a_loop "../../examples/push_in_a_loop.rs";
    line_events_and_counters "../../examples/line_events_and_counters.rs";
    failsafe "../../examples/failsafe.rs";
    own_format "../../examples/own_format.rs";
    #[cfg(feature = "embedded-io-v0.7")]
    embedded_io "../../examples/embedded_io.rs";
}
