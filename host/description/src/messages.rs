//! The known messages of a description.

use std::borrow::Cow;

use framelock_formats::layout::KnownMessage;
use framelock_formats::mavlink::{ARDUPILOTMEGA, COMMON};
use serde::Deserialize;

/// The known messages: a dialect, or a list of dialects and rows.
#[derive(Clone, Deserialize)]
#[serde(
    untagged,
    expecting = "known messages are \"common\", \"ardupilotmega\", rows of one to three numbers: [[number, extra byte, \
                 largest value of the length field]], or a list of both"
)]
pub(crate) enum Known {
    Dialect(Dialect),
    List(Vec<Entry>),
}

/// A dialect, or a row for one message.
#[derive(Clone, Copy, Deserialize)]
#[serde(untagged)]
pub(crate) enum Entry {
    Dialect(Dialect),
    Number([u32; 1]),
    Extra(u32, u8),
    Most(u32, u8, u16),
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Dialect {
    Common,
    Ardupilotmega,
}

impl Dialect {
    fn messages(self) -> &'static [KnownMessage] {
        match self {
            Self::Common => COMMON,
            Self::Ardupilotmega => ARDUPILOTMEGA,
        }
    }
}

impl Entry {
    /// Returns the messages of a dialect, or the message of a row.
    fn messages(self) -> Vec<KnownMessage> {
        match self {
            Self::Dialect(dialect) => dialect.messages().to_vec(),
            Self::Number([number]) => vec![KnownMessage::new(number)],
            Self::Extra(number, extra) => vec![KnownMessage {
                extra: Some(extra),
                ..KnownMessage::new(number)
            }],
            Self::Most(number, extra, longest_payload) => vec![KnownMessage {
                number,
                longest_payload,
                extra: Some(extra),
            }],
        }
    }
}

impl Known {
    /// Returns the known messages in ascending order of their numbers. A row for a message replaces the dialect's entry.
    pub(crate) fn messages(&self) -> Cow<'static, [KnownMessage]> {
        let list = match self {
            Self::Dialect(dialect) => return dialect.messages().into(),
            Self::List(list) => list,
        };
        let is_row = |entry: &&Entry| !matches!(entry, Entry::Dialect(_));
        let (rows, dialects): (Vec<&Entry>, Vec<&Entry>) = list.iter().partition(is_row);
        let mut all: Vec<KnownMessage> = rows.into_iter().flat_map(|row| row.messages()).collect();
        for dialect in dialects {
            let others: Vec<KnownMessage> = dialect.messages();
            let own = sorted(all.iter().copied());
            let is_new = |message: &KnownMessage| find(&own, message.number).is_none();
            all.extend(others.into_iter().filter(is_new));
        }
        sorted(all.into_iter()).into()
    }

    /// Returns the numbers and names of the messages that a description takes from a dialect. Leaves out a message to
    /// which a row gives another definition.
    pub(crate) fn names(&self) -> Vec<(u32, &'static str)> {
        let entries = match self {
            Self::Dialect(dialect) => vec![Entry::Dialect(*dialect)],
            Self::List(list) => list.clone(),
        };
        let dialects = entries.into_iter().filter_map(|entry| match entry {
            Entry::Dialect(dialect) => Some(dialect),
            _ => None,
        });
        let dialects: Vec<Dialect> = dialects.collect();
        let known = self.messages();
        let is_of_dialect = |number: u32| {
            let extra = find(&known, number).map(|message| message.extra);
            let defined =
                |dialect: &Dialect| find(dialect.messages(), number).map(|message| message.extra);
            extra.is_some() && dialects.iter().any(|dialect| defined(dialect) == extra)
        };
        let lines = include_str!("message_names.txt").lines();
        let names = lines.filter_map(|line| line.split_once(' '));
        let names = names.filter_map(|(number, name)| Some((number.parse().ok()?, name)));
        names.filter(|(number, _)| is_of_dialect(*number)).collect()
    }
}

/// Returns the message with this number. The messages must be in ascending order of their numbers.
fn find(messages: &[KnownMessage], number: u32) -> Option<&KnownMessage> {
    let place = messages.binary_search_by_key(&number, |message| message.number);
    Some(&messages[place.ok()?])
}

/// Sorts messages by their numbers.
pub(crate) fn sorted(messages: impl Iterator<Item = KnownMessage>) -> Vec<KnownMessage> {
    let mut messages: Vec<KnownMessage> = messages.collect();
    messages.sort_by_key(|message| message.number);
    messages
}
