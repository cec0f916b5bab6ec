//! Memory that is never freed. A [`Layout`](framelock_formats::Layout) borrows its parts, also on a microcontroller,
//! where they are constants. A description creates these parts at run time, and keeps them for the rest of the program.

use std::any::Any;
use std::sync::{Mutex, PoisonError};

/// All values that are kept. A program that looks for lost memory, such as a fuzzer, finds them here.
static KEPT: Mutex<Vec<&(dyn Any + Send + Sync)>> = Mutex::new(Vec::new());

/// Keeps the value for the rest of the program.
pub(crate) fn kept<T: Any + Send + Sync>(value: T) -> &'static T {
    let value: &'static T = Box::leak(Box::new(value));
    let mut all = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    all.push(value);
    value
}
