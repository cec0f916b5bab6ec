//! The tokens of LLVM's assembly language: words, names, numbers and signs.

use anyhow::{Context as _, Result};
use logos::{Lexer, Logos};

#[derive(Logos, Debug, Clone, PartialEq, Eq)]
#[logos(skip r"[ \t\r\n]+")]
#[logos(skip(r";[^\n]*", allow_greedy = true))]
// Skip attributes and metadata, such as `#7` and `!dbg`, because they do not affect the program's meaning.
#[logos(skip r"[#!][A-Za-z0-9_.$-]*")]
pub(crate) enum Token {
    /// A keyword, a type's name, or an attribute.
    #[regex(r"[A-Za-z_.$][A-Za-z0-9_.$-]*", |word| word.slice().to_owned())]
    Word(String),

    /// `%name` or `%"name"`
    #[regex(r#"%([A-Za-z0-9_.$-]+|"[^"]*")"#, name)]
    Local(String),

    /// `@name` or `@"name"`
    #[regex(r#"@([A-Za-z0-9_.$-]+|"[^"]*")"#, name)]
    Global(String),

    #[regex(r"-?[0-9]+", |number| number.slice().parse().ok())]
    Number(i128),

    /// `c"…"` or `"…"`
    #[regex(r#"c?"[^"]*""#, bytes)]
    Bytes(Vec<u8>),

    #[regex(r"[^A-Za-z0-9_.$%@#!; \t\r\n-]", |sign| sign.slice().chars().next())]
    Sign(char),
}

impl Token {
    pub(crate) fn is_word(&self, wanted: &str) -> bool {
        matches!(self, Self::Word(word) if word == wanted)
    }
}

pub(crate) fn tokens(text: &str) -> Result<Vec<Token>> {
    let read: Result<_, _> = Token::lexer(text).collect();
    read.ok()
        .with_context(|| format!("this is not LLVM assembly: {text}"))
}

fn name(lexer: &mut Lexer<Token>) -> String {
    lexer.slice().split_at(1).1.trim_matches('"').to_owned()
}

/// Reads a string in quotes, in which `\41` stands for the byte 0x41 and `\\` for a backslash.
fn bytes(lexer: &mut Lexer<Token>) -> Option<Vec<u8>> {
    let quoted = lexer.slice().trim_start_matches('c').trim_matches('"');
    let mut bytes = Vec::new();
    let mut rest = quoted.as_bytes();
    while let Some((&first, behind)) = rest.split_first() {
        let (byte, behind) = match behind {
            [b'\\', behind @ ..] if first == b'\\' => (b'\\', behind),
            [high, low, behind @ ..] if first == b'\\' => {
                let digits = [*high, *low];
                let digits = std::str::from_utf8(&digits).ok()?;
                (u8::from_str_radix(digits, 16).ok()?, behind)
            }
            _ => (first, behind),
        };
        bytes.push(byte);
        rest = behind;
    }
    Some(bytes)
}
