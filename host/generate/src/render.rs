//! Renders the templates of Rust modules and C headers.

use minijinja::{Environment, UndefinedBehavior, Value};

use crate::names::module;

/// The template of a program, and the helper functions that the program may call.
pub(crate) type Template = (&'static str, &'static str);

pub(crate) const HEADER: Template = (
    include_str!("../templates/header.h.j2"),
    include_str!("../templates/helpers.h"),
);
pub(crate) const MODULE: Template = (
    include_str!("../templates/module.rs.j2"),
    include_str!("../templates/helpers.rs"),
);

/// The parts of a header that are the same for all descriptions, in plain C. In these files, names begin with `any_` or
/// `ANY_`. The proofs in `c/proofs` include the files.
const ENGINE: [(&str, &str); 5] = [
    ("counters.h", include_str!("../templates/engine/counters.h")),
    ("receiver.h", include_str!("../templates/engine/receiver.h")),
    ("counting.h", include_str!("../templates/engine/counting.h")),
    ("buffered.h", include_str!("../templates/engine/buffered.h")),
    ("window.h", include_str!("../templates/engine/window.h")),
];

/// Converts a part of a header to a template, which inserts the header's names.
fn template_of(part: &str) -> String {
    part.replace("any_index", "{{ index }}")
        .replace("any_", "{{ name }}_")
        .replace("ANY_", "{{ upper }}_")
}

/// Renders a template. Replaces the line `HELPERS` by the helper functions that the program calls, and `PREFIX` by the
/// name of the program.
pub(crate) fn source(program: Value, name: &str, (template, helpers): Template) -> String {
    let engine = ENGINE.map(|(name, part)| (name, template_of(part)));
    let mut environment = Environment::new();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_trim_blocks(true);
    environment.set_lstrip_blocks(true);
    environment.set_keep_trailing_newline(true);
    let mut engine = engine.iter();
    let rendered = engine
        .try_for_each(|(name, part)| environment.add_template(name, part))
        .and_then(|()| environment.render_str(template, program));
    let code = rendered.unwrap_or_else(|error| unreachable!("in a template: {error:#}"));
    let name = module(name);
    let code = code.trim_start().replace("PREFIX", &name);
    let (types, functions) = code
        .split_once("HELPERS\n")
        .expect("the template has this line");
    let helpers = helpers.replace("PREFIX", &name) + "\n";
    // Helpers may call other helpers.
    let direct = called(&code, &helpers);
    let helpers = called(&(direct + &code), &helpers);
    let source = format!("{types}{helpers}{}", functions.trim_start());
    source.trim_end().to_owned() + "\n"
}

/// Returns the functions that the code calls. In `functions`, a blank line follows each function.
fn called(code: &str, functions: &str) -> String {
    let is_name = |c: char| c.is_ascii_alphanumeric() || "_.".contains(c);
    let is_called = |function: &&str| {
        let (before, _) = function
            .split_once(['(', '<'])
            .expect("each part is a function");
        let name = before.rsplit(|c| !is_name(c)).next().unwrap_or(before);
        let call = format!("{name}(");
        let mut calls = code.match_indices(&call);
        calls.any(|(at, _)| !code[..at].ends_with(is_name))
    };
    let functions = functions.split_inclusive("\n}\n\n");
    functions.filter(is_called).collect()
}
