//! Renders templates to source code.

use minijinja::{Environment, UndefinedBehavior, Value};

use crate::names::{Language, module};

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

/// Renders the template of a language. Replaces the line `HELPERS` by the helper functions that the program calls, and
/// `PREFIX` by the name of the module.
pub(crate) fn source(program: Value, name: &str, language: &Language) -> String {
    let engine = ENGINE.map(|(name, part)| (name, template_of(part)));
    let mut environment = Environment::new();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_trim_blocks(true);
    environment.set_lstrip_blocks(true);
    environment.set_keep_trailing_newline(true);
    environment.add_filter("hex", |number: u64| format!("{number:#X}"));
    environment.add_filter("byte", |number: u8| format!("{number:#04X}"));
    let shared = include_str!("../templates/fields.j2");
    let rendered = environment
        .add_template("fields.j2", shared)
        .and_then(|()| {
            let mut engine = engine.iter();
            engine.try_for_each(|(name, part)| environment.add_template(name, part))
        })
        .and_then(|()| environment.render_str(language.template, program));
    let code = rendered.unwrap_or_else(|error| unreachable!("in a template: {error:#}"));
    let name = module(name);
    let code = indented(code.trim_start()).replace("PREFIX", &name);
    let (types, functions) = code.split_once("HELPERS\n").unwrap_or((&code, ""));
    let helpers = language.helpers.replace("PREFIX", &name) + "\n";
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
        let (before, _) = function.split_once(['(', '<']).unwrap_or_default();
        let name = before.rsplit(|c| !is_name(c)).next().unwrap_or_default();
        let call = format!("{name}(");
        let mut calls = code.match_indices(&call);
        calls.any(|(at, _)| !code[..at].ends_with(is_name))
    };
    let functions = functions.split_inclusive("\n}\n\n");
    functions.filter(is_called).collect()
}

/// Indents each line by one level per open bracket. The indentation in the templates has no effect.
fn indented(code: &str) -> String {
    let mut text = String::new();
    let mut depth = 0_usize;
    for line in code.lines().map(str::trim) {
        let is_comment = ["//", "/*", "* ", "*/"]
            .iter()
            .any(|mark| line.starts_with(mark));
        let is_closing = line.starts_with([')', ']', '}']);
        let count = |brackets: [char; 3]| line.matches(brackets).count();
        let (open, close) = (count(['(', '[', '{']), count([')', ']', '}']));
        depth = depth.saturating_sub(usize::from(is_closing));
        if !line.is_empty() {
            text.extend(std::iter::repeat_n("    ", depth));
        }
        text.push_str(if is_comment && line.starts_with('*') || line == "*" {
            " "
        } else {
            ""
        });
        text.push_str(line);
        text.push('\n');
        if open + usize::from(is_closing) > close && !is_comment {
            depth += 1;
        } else if open < close && !is_closing {
            depth = depth.saturating_sub(1);
        }
    }
    text
}
