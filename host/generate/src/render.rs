//! Renders the templates of Rust modules and C headers.

use minijinja::{Environment, UndefinedBehavior, Value};

use crate::c;

/// The template of a program, which begins with its macros, and the template of the helper functions that the program
/// may call.
pub(crate) type Template = (&'static str, &'static str);

pub(crate) const HEADER: Template = (
    concat!(
        include_str!("../templates/classify.h.j2"),
        include_str!("../templates/message.h.j2"),
        include_str!("../templates/header.h.j2")
    ),
    include_str!("../templates/helpers.h.j2"),
);
pub(crate) const MODULE: Template = (
    concat!(
        include_str!("../templates/layout.rs.j2"),
        include_str!("../templates/module.rs.j2")
    ),
    include_str!("../templates/helpers.rs"),
);

/// The receivers of a header, and the parts that they share. In these files, names begin with `any_` or `ANY_`. All
/// parts except the receiver of packets are plain C. `c/proofs/engine.c` includes these parts, except `window.h`.
const ENGINE: [(&str, &str); 6] = [
    ("counters.h", include_str!("../templates/engine/counters.h")),
    ("receiver.h", include_str!("../templates/engine/receiver.h")),
    ("counting.h", include_str!("../templates/engine/counting.h")),
    ("buffered.h", include_str!("../templates/engine/buffered.h")),
    ("window.h", include_str!("../templates/engine/window.h")),
    (
        "packets.h",
        include_str!("../templates/engine/packets.h.j2"),
    ),
];

/// Converts a part of a header to a template, which inserts the header's names.
fn template_of(part: &str) -> String {
    part.replace("any_index", "{{ index }}")
        .replace("any_", "{{ name }}_")
        .replace("ANY_", "{{ upper }}_")
}

/// Renders a template. Replaces the line `HELPERS` by the helper functions that the program calls.
pub(crate) fn source(program: &Value, (template, helpers): Template) -> String {
    let engine = ENGINE.map(|(name, part)| (name, template_of(part)));
    let mut environment = Environment::new();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_trim_blocks(true);
    environment.set_lstrip_blocks(true);
    environment.set_keep_trailing_newline(true);
    environment.add_filter("hex", hex);
    environment.add_filter("rows", c::rows);
    environment.add_filter("smallest_type", c::smallest_type);
    environment.add_filter("rust_slice", rust_slice);
    environment.add_filter("c_text", c::text);
    environment.add_filter("rust_text", rust_text);
    for (name, part) in &engine {
        let added = environment.add_template(name, part);
        added.expect("a correct template");
    }
    let render = |template: &str| environment.render_str(template, program);
    let render = |template| render(template).expect("a correct template");
    let code = render(template);
    let helpers = render(&template_of(helpers)) + "\n";
    let (types, functions) = code
        .split_once("HELPERS\n")
        .expect("the template has this line");
    // Helpers may call other helpers.
    let mut used = called(&code, &helpers);
    loop {
        let more = called(&(used.clone() + &code), &helpers);
        if more == used {
            break;
        }
        used = more;
    }
    let source = format!("{}{used}{}", types.trim_start(), functions.trim_start());
    source.trim_end().to_owned() + "\n"
}

/// Returns a number in hexadecimal, with at least `digits` digits (two if `digits` is `None`).
fn hex(number: u64, digits: Option<usize>) -> String {
    let width = 2 + digits.unwrap_or(2);
    format!("{number:#0width$X}")
}

/// Returns a reference to a list in the style of rustfmt: in one line if it is short.
#[expect(clippy::needless_pass_by_value, reason = "a filter")]
fn rust_slice(each: Vec<String>) -> String {
    let line = each.join(", ");
    if each.len() == 1 || line.len() <= 60 && !line.contains('\n') {
        return format!("&[{line}]");
    }
    format!("&[\n    {},\n]", each.join(",\n").replace('\n', "\n    "))
}

/// Returns bytes as a literal in Rust.
#[expect(clippy::needless_pass_by_value, reason = "a filter")]
fn rust_text(bytes: Vec<u8>) -> String {
    format!("b\"{}\"", bytes.escape_ascii())
}

/// Returns the functions that the code calls. In `functions`, a blank line follows each function.
fn called(code: &str, functions: &str) -> String {
    let is_name = |c: char| c.is_ascii_alphanumeric() || "_.".contains(c);
    let is_called = |function: &&str| {
        let (before, _) = function
            .split_once(['(', '<'])
            .expect("each part is a function");
        let name = before.rsplit(|c| !is_name(c)).next().unwrap_or(before);
        let calls = ["(", "::<"].map(|end| format!("{name}{end}"));
        let mut calls = calls.iter().flat_map(|call| code.match_indices(call));
        calls.any(|(at, _)| !code[..at].ends_with(is_name))
    };
    let functions = functions.split_inclusive("\n}\n\n");
    functions.filter(is_called).collect()
}
