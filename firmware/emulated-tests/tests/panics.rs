//! What the images' code shows without being run: no interrupt handler can panic.
#![allow(clippy::unwrap_used, reason = "tests")]

use framelock_firmware_inspect::why_handlers_may_panic;
use framelock_firmware_tests::image_file;

#[test]
fn no_handler_can_panic() {
    for image in ["default", "megabaud", "discard", "small"] {
        let calls = why_handlers_may_panic(&image_file(image)).unwrap();
        assert_eq!(calls.to_panic, None, "{image}");
        // The receiver's own functions are among those that were looked at.
        assert!(calls.functions > 10, "{image}: {}", calls.functions);
    }
}
