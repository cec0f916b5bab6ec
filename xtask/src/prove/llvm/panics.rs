//! What a panic says: its message and its place, from the constants that it is given.

use std::collections::BTreeSet;

use super::ir::{Call, Constant, Function, Instruction, Module, Value};

/// In words, what the call of a function that never returns means.
pub(super) fn describe(module: &Module, within: &Function, call: &Call) -> String {
    let mut message = None;
    let mut places = BTreeSet::new();
    for (place, (_, value)) in call.arguments.iter().enumerate() {
        let mut names = BTreeSet::new();
        globals(within, value, &mut names, 0);
        for name in names {
            let Some(constant) = module.constants.get(name) else {
                continue;
            };
            if let Some(found) = location(module, constant) {
                places.insert(found);
            } else if let Some((_, Value::Integer(length))) = call.arguments.get(place + 1) {
                let length = usize::try_from(*length).unwrap_or(0);
                message = constant.bytes.get(..length).map(String::from_utf8_lossy);
            }
        }
    }
    let message = message.map_or_else(|| of_function(&call.function), std::borrow::Cow::into_owned);
    let places: Vec<String> = places.into_iter().collect();
    if places.is_empty() {
        return format!("panic: {message}");
    }
    format!("panic: {message} at {}", places.join(" or "))
}

/// The constants whose address the value may be.
fn globals<'a>(
    within: &'a Function,
    value: &'a Value,
    names: &mut BTreeSet<&'a str>,
    depth: usize,
) {
    match value {
        Value::Global(name) => {
            names.insert(name);
        }
        Value::Local(name) if depth < 8 => {
            let instructions = within.blocks.iter().flat_map(|block| &block.instructions);
            for instruction in instructions {
                match instruction {
                    Instruction::Phi { to, incoming, .. } if to == name => {
                        for (value, _) in incoming {
                            globals(within, value, names, depth + 1);
                        }
                    }
                    Instruction::Select { to, yes, no, .. } if to == name => {
                        globals(within, yes, names, depth + 1);
                        globals(within, no, names, depth + 1);
                    }
                    _ => {}
                }
            }
        }
        _ => {}
    }
}

/// `core::panic::Location`: a file's name, its length, line and column.
fn location(module: &Module, constant: &Constant) -> Option<String> {
    let file = module.constants.get(constant.addresses.get(&0)?)?;
    let number = |at: usize| {
        let bytes = constant.bytes.get(at..)?.first_chunk()?;
        Some(u32::from_le_bytes(*bytes))
    };
    if constant.bytes.len() != 24 {
        return None;
    }
    let length = usize::try_from(number(8)?).ok()?;
    let file = String::from_utf8_lossy(file.bytes.get(..length)?);
    Some(format!("{file}:{}:{}", number(16)?, number(20)?))
}

/// From the name of one of core's own functions that panic.
fn of_function(name: &str) -> String {
    const KNOWN: [(&str, &str); 14] = [
        ("const_add_overflow", "attempt to add with overflow"),
        ("const_sub_overflow", "attempt to subtract with overflow"),
        ("const_mul_overflow", "attempt to multiply with overflow"),
        ("const_neg_overflow", "attempt to negate with overflow"),
        ("const_shl_overflow", "attempt to shift left with overflow"),
        ("const_shr_overflow", "attempt to shift right with overflow"),
        ("const_div_by_zero", "attempt to divide by zero"),
        ("const_rem_by_zero", "attempt to take a remainder by zero"),
        ("const_div_overflow", "attempt to divide with overflow"),
        ("panic_bounds_check", "index out of bounds"),
        ("slice_index_fail", "slice index out of range"),
        ("unwrap_failed", "unwrap of nothing"),
        ("expect_failed", "expect of nothing"),
        ("invalid_enum", "a value that the enum does not have"),
    ];
    let known = KNOWN.iter().find(|(part, _)| name.contains(part));
    known.map_or_else(|| name.to_owned(), |(_, message)| (*message).to_owned())
}
