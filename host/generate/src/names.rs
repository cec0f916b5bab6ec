//! Converts names to names that the target languages allow.

use std::collections::HashSet;

/// The rules of a target language for names.
pub(crate) struct Language {
    keywords: &'static [&'static str],
    /// Names, other than keywords, that no kind can have, because generated programs use these names.
    own: &'static [&'static str],
    /// Converts the name of a kind to a name that is valid in this language.
    pub(crate) kind: fn(&str) -> String,
    /// The name of the kind, if a description has only one kind.
    pub(crate) message: &'static str,
}

#[rustfmt::skip]
pub(crate) const RUST: Language = Language {
    keywords: &[
        "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "crate", "do", "dyn",
        "else", "enum", "extern", "false", "final", "fn", "for", "gen", "if", "impl", "in", "let", "loop", "macro",
        "match", "mod", "move", "mut", "override", "priv", "pub", "ref", "return", "self", "static", "struct", "super",
        "trait", "true", "try", "type", "typeof", "unsafe", "unsized", "use", "virtual", "where", "while", "yield",
    ],
    own: &["AnyOf", "CheckedLayout", "Format", "Frames", "Layout", "Message", "None", "Option", "Self", "Some", "Classification", "LineEvent",
        "PacketFormat", "Stuffing"],
    kind: camel,
    message: "Message",
};

/// C and C++.
#[rustfmt::skip]
pub(crate) const C: Language = Language {
    keywords: &[
        "alignas", "alignof", "and", "asm", "auto", "bitand", "bitor", "bool", "break", "case", "catch", "char",
        "class", "compl", "concept", "const", "constexpr", "continue", "decltype", "default", "delete", "do", "double",
        "else", "enum", "explicit", "export", "extern", "false", "float", "for", "friend", "goto", "if", "inline",
        "int", "long", "mutable", "namespace", "new", "noexcept", "not", "nullptr", "operator", "or", "private",
        "protected", "public", "register", "requires", "restrict", "return", "short", "signed", "sizeof", "static",
        "struct", "switch", "template", "this", "throw", "true", "try", "typedef", "typeid", "typename", "union",
        "unsigned", "using", "virtual", "void", "volatile", "while", "xor",
    ],
    own: &[],
    kind: module,
    message: "message",
};

impl Language {
    pub(crate) fn keywords(&self) -> HashSet<String> {
        self.keywords.iter().copied().map(str::to_owned).collect()
    }

    /// Returns the names that no kind can have.
    pub(crate) fn reserved(&self) -> HashSet<String> {
        let names = self.keywords.iter().chain(self.own);
        names.copied().map(str::to_owned).collect()
    }
}

/// Returns a name that has not been used yet, and marks it as used. Appends underscores as necessary.
pub(crate) fn free(name: &str, used: &mut HashSet<String>) -> String {
    let mut name = name.to_owned();
    while !used.insert(name.clone()) {
        name.push('_');
    }
    name
}

/// Returns the words of a name in lower case.
pub(crate) fn words(name: &str) -> Vec<String> {
    let parts = name.split(|c: char| !c.is_ascii_alphanumeric());
    let words = parts.filter(|part| !part.is_empty());
    words.map(str::to_ascii_lowercase).collect()
}

/// Converts a name to a valid name for a module, or to a valid prefix for a header's names.
pub(crate) fn module(name: &str) -> String {
    starting_with_letter(words(name).join("_"), "frame")
}

/// Converts a name to a valid name for a type, such as `MotorState`.
fn camel(name: &str) -> String {
    let words = words(name).into_iter();
    let capital = |word: String| word[..1].to_ascii_uppercase() + &word[1..];
    starting_with_letter(words.map(capital).collect(), "Kind")
}

fn starting_with_letter(name: String, otherwise: &str) -> String {
    if name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        name
    } else {
        format!("{otherwise}{name}")
    }
}

/// Changes a text so that it fits into a one-line comment.
pub(crate) fn one_line(text: &str) -> String {
    text.replace(char::is_control, " ").replace("*/", "* /")
}
