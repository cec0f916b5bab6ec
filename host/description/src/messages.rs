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

/// A dialect, or a row for one message: its number, the extra byte that its checksum covers, and the largest value of
/// its length field.
#[derive(Clone, Copy, Deserialize)]
#[serde(untagged)]
pub(crate) enum Entry {
    Dialect(Dialect),
    Row(
        u32,
        #[serde(default)] Option<u8>,
        #[serde(default)] Option<u16>,
    ),
}

#[derive(Clone, Copy, PartialEq, Eq, Deserialize)]
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

impl Known {
    fn dialects(&self) -> Vec<&'static [KnownMessage]> {
        let dialects: Vec<Dialect> = match self {
            Self::Dialect(dialect) => vec![*dialect],
            Self::List(list) => {
                let dialects = list.iter().filter_map(|entry| match entry {
                    Entry::Dialect(dialect) => Some(*dialect),
                    Entry::Row(..) => None,
                });
                dialects.collect()
            }
        };
        dialects.into_iter().map(Dialect::messages).collect()
    }

    /// Returns the known messages in ascending order of their numbers. A row for a message replaces the dialect's
    /// entry.
    pub(crate) fn messages(&self) -> Cow<'static, [KnownMessage]> {
        let list = match self {
            Self::Dialect(dialect) => return dialect.messages().into(),
            Self::List(list) => list,
        };
        let rows = list.iter().filter_map(|entry| match *entry {
            Entry::Dialect(_) => None,
            Entry::Row(number, extra, longest_payload) => Some(KnownMessage {
                number,
                longest_payload: longest_payload.unwrap_or(u16::MAX),
                extra,
            }),
        });
        let mut all = sorted(rows);
        for dialect in self.dialects() {
            let is_new = |message: &&KnownMessage| find(&all, message.number).is_none();
            let others: Vec<KnownMessage> = dialect.iter().filter(is_new).copied().collect();
            all = sorted(all.into_iter().chain(others));
        }
        all.into()
    }

    /// Returns the numbers and names of the messages that a description takes from a dialect. Leaves out a message to
    /// which a row gives another extra byte.
    pub(crate) fn names(&self) -> Vec<(u32, &'static str)> {
        let (known, dialects) = (self.messages(), self.dialects());
        let is_of_dialect = |number: u32| {
            let extra = |messages| find(messages, number).map(|message| message.extra);
            let known_extra = extra(&known);
            known_extra.is_some() && dialects.iter().any(|dialect| extra(dialect) == known_extra)
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
