//! Words and signs of LLVM's assembly language.

use anyhow::{Result, bail};

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Token {
    /// A keyword, a type's name, or an attribute.
    Word(String),
    /// `%name`
    Local(String),
    /// `@name`
    Global(String),
    /// `#7`, `!dbg`, `!7`: not part of what the program means.
    Note,
    Number(i128),
    /// `c"…"` or `"…"`
    Bytes(Vec<u8>),
    Sign(char),
}

impl Token {
    pub(super) fn into_global(self) -> Option<String> {
        match self {
            Self::Global(name) => Some(name),
            _ => None,
        }
    }
}

/// The tokens of one line or statement; what stands behind `;` is a comment.
pub(crate) fn tokens(text: &str) -> Result<Vec<Token>> {
    let mut all = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let behind = &rest[first.len_utf8()..];
        match first {
            ';' => match rest.find('\n') {
                Some(end) => rest = &rest[end..],
                None => break,
            },
            _ if first.is_whitespace() => rest = behind,
            '%' | '@' => {
                let (name, after) = name(behind)?;
                all.push(if first == '%' {
                    Token::Local(name)
                } else {
                    Token::Global(name)
                });
                rest = after;
            }
            '#' | '!' => {
                all.push(Token::Note);
                rest = word(behind).1;
            }
            '"' => {
                let (bytes, after) = quoted(rest)?;
                all.push(Token::Bytes(bytes));
                rest = after;
            }
            'c' if behind.starts_with('"') => {
                let (bytes, after) = quoted(behind)?;
                all.push(Token::Bytes(bytes));
                rest = after;
            }
            '-' | '0'..='9' => {
                let (digits, after) = word(behind);
                let number = &rest[..=digits.len()];
                let Ok(number) = number.parse() else {
                    bail!("{number} is not a whole number (floating point is not modelled)");
                };
                all.push(Token::Number(number));
                rest = after;
            }
            _ if is_word(first) => {
                let (text, after) = word(rest);
                all.push(Token::Word(text.to_owned()));
                rest = after;
            }
            _ => {
                all.push(Token::Sign(first));
                rest = behind;
            }
        }
    }
    Ok(all)
}

fn is_word(character: char) -> bool {
    character.is_ascii_alphanumeric() || matches!(character, '_' | '.' | '$' | '-')
}

/// The word at the head of `text`, which may be empty, and what follows.
fn word(text: &str) -> (&str, &str) {
    let end = text.find(|c| !is_word(c)).unwrap_or(text.len());
    text.split_at(end)
}

/// The name behind `%` or `@`, quoted or not.
fn name(text: &str) -> Result<(String, &str)> {
    if text.starts_with('"') {
        let (bytes, after) = quoted(text)?;
        return Ok((String::from_utf8(bytes)?, after));
    }
    let (text, after) = word(text);
    Ok((text.to_owned(), after))
}

/// A string in quotes, where `\41` stands for the byte 0x41 and `\\` for a backslash.
fn quoted(text: &str) -> Result<(Vec<u8>, &str)> {
    let inner = &text[1..];
    let Some(end) = inner.find('"') else {
        bail!("a string without end: {text}");
    };
    let mut bytes = Vec::new();
    let mut rest = inner[..end].bytes();
    while let Some(byte) = rest.next() {
        if byte != b'\\' {
            bytes.push(byte);
            continue;
        }
        let first = rest.next().unwrap_or(b'\\');
        if first == b'\\' {
            bytes.push(first);
            continue;
        }
        let digits = std::iter::once(first).chain(rest.next()).collect();
        bytes.push(u8::from_str_radix(&String::from_utf8(digits)?, 16)?);
    }
    Ok((bytes, &inner[end + 1..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_each_kind_of_token() {
        let line = r#"  %"a b" = call i8 @"cover:x.rs:1"(i1 -3) #4, !dbg !7 ; c"no""#;
        let [local, global] = ["a b", "cover:x.rs:1"].map(str::to_owned);
        let word = |text: &str| Token::Word(text.to_owned());
        assert_eq!(
            tokens(line).expect("these are tokens"),
            [
                Token::Local(local),
                Token::Sign('='),
                word("call"),
                word("i8"),
                Token::Global(global),
                Token::Sign('('),
                word("i1"),
                Token::Number(-3),
                Token::Sign(')'),
                Token::Note,
                Token::Sign(','),
                Token::Note,
                Token::Note,
            ]
        );
        assert_eq!(
            tokens(r#"c"A\0D\\""#).expect("these are tokens"),
            [Token::Bytes(b"A\r\\".to_vec())]
        );
        assert!(tokens("1.5e3").is_err());
    }
}
