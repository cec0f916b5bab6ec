//! Reads the tables of a description. Each key is asked for once; a key that nobody asks for is a mistake.

use std::collections::BTreeMap;
use std::ops::Range;

use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue, ValueDeserializer};

use crate::problem::{Located, Mistake};

/// A table of a description.
#[derive(Clone)]
pub(crate) struct Table<'t> {
    pub(crate) span: Range<usize>,
    /// The values, each with the bytes of its key in the text.
    values: BTreeMap<&'t str, (Range<usize>, &'t Spanned<DeValue<'t>>)>,
    /// The keys that have been asked for.
    known: Vec<&'static str>,
}

impl<'t> Table<'t> {
    pub(crate) fn new(table: &'t DeTable<'t>, span: Range<usize>) -> Self {
        let entries = table.iter();
        let values = entries.map(|(key, value)| (key.get_ref().as_ref(), (key.span(), value)));
        Self {
            span,
            values: values.collect(),
            known: Vec::new(),
        }
    }

    fn of(value: &'t Spanned<DeValue<'t>>) -> Result<Self, Located> {
        match value.get_ref() {
            DeValue::Table(table) => Ok(Self::new(table, value.span())),
            other => {
                let what = format!("invalid type: {}, expected a table", other.type_str());
                Err(Located::new(value.span(), Mistake::Toml(what)))
            }
        }
    }

    /// Returns the position of a key's value, or the beginning of the text if the table lacks the key.
    pub(crate) fn span_of(&self, key: &str) -> Range<usize> {
        self.values.get(key).map_or(0..0, |(_, value)| value.span())
    }

    /// Returns a mistake at a key's value.
    pub(crate) fn wrong<T>(&self, key: &str, mistake: Mistake) -> Result<T, Located> {
        Err(Located::new(self.span_of(key), mistake))
    }

    pub(crate) fn has(&self, key: &str) -> bool {
        self.values.contains_key(key)
    }

    fn value(&mut self, key: &'static str) -> Option<&'t Spanned<DeValue<'t>>> {
        self.known.push(key);
        self.values.get(key).map(|(_, value)| *value)
    }

    /// Returns the value of a key.
    pub(crate) fn get<T: DeserializeOwned>(
        &mut self,
        key: &'static str,
    ) -> Result<Option<T>, Located> {
        let Some(value) = self.value(key) else {
            return Ok(None);
        };
        let read = T::deserialize(ValueDeserializer::from(value.clone()));
        read.map(Some).map_err(|error| {
            let span = error.span().unwrap_or_else(|| value.span());
            Located::new(span, Mistake::Toml(error.message().to_owned()))
        })
    }

    /// Returns the value of a key that the table must have.
    pub(crate) fn need<T: DeserializeOwned>(&mut self, key: &'static str) -> Result<T, Located> {
        let missing = Located::new(self.span.clone(), Mistake::MissingKey(key));
        self.get(key)?.ok_or(missing)
    }

    /// Returns the meaning of a text.
    pub(crate) fn parse<T>(
        &mut self,
        key: &'static str,
        parse: impl Fn(&str) -> Result<T, Mistake>,
    ) -> Result<Option<T>, Located> {
        let text = self.get::<String>(key)?;
        let parsed = text.map(|text| parse(&text)).transpose();
        parsed.or_else(|mistake| self.wrong(key, mistake))
    }

    /// Returns the meaning of a text that the table must have.
    pub(crate) fn need_parsed<T>(
        &mut self,
        key: &'static str,
        parse: impl Fn(&str) -> Result<T, Mistake>,
    ) -> Result<T, Located> {
        let missing = Located::new(self.span.clone(), Mistake::MissingKey(key));
        self.parse(key, parse)?.ok_or(missing)
    }

    /// Reads the table that is the value of a key.
    pub(crate) fn table<T>(
        &mut self,
        key: &'static str,
        read: impl Fn(Self) -> Result<T, Located>,
    ) -> Result<Option<T>, Located> {
        self.value(key)
            .map(|value| read(Self::of(value)?))
            .transpose()
    }

    /// Returns the elements of a list of tables; none if the table lacks the key.
    pub(crate) fn tables(&mut self, key: &'static str) -> Result<Vec<Self>, Located> {
        let Some(value) = self.value(key) else {
            return Ok(Vec::new());
        };
        match value.get_ref() {
            DeValue::Array(tables) => tables.iter().map(Self::of).collect(),
            other => {
                let what = format!(
                    "invalid type: {}, expected a list of tables",
                    other.type_str()
                );
                self.wrong(key, Mistake::Toml(what))
            }
        }
    }

    /// Checks that all keys have been asked for.
    pub(crate) fn finish(&self) -> Result<(), Located> {
        let unknown = |(key, _): &(&&str, _)| !self.known.contains(*key);
        // Report the first unknown key of the text.
        match self
            .values
            .iter()
            .filter(unknown)
            .min_by_key(|(_, (span, _))| span.start)
        {
            None => Ok(()),
            Some((key, (span, _))) => Err(Located::new(
                span.clone(),
                Mistake::UnknownKey {
                    name: (*key).to_owned(),
                    known: self.known.clone(),
                },
            )),
        }
    }

    /// Adds the keys that the surrounding description has and the kind lacks.
    pub(crate) fn inherit(&mut self, whole: &Self) {
        let has_length = self.has("length") || self.has("length_field");
        let is_fixed = self.has("length");
        let inherited = whole.values.iter().filter(|(key, _)| match **key {
            "length" | "length_field" => !has_length,
            "shortest" | "longest" => !is_fixed,
            "fields" | "views" | "kinds" | "any_of" | "name" => false,
            _ => true,
        });
        for (key, value) in inherited {
            self.values.entry(key).or_insert_with(|| value.clone());
        }
    }

    /// Returns true if the table has one of these keys.
    pub(crate) fn has_any(&self, keys: &[&str]) -> bool {
        keys.iter().any(|key| self.has(key))
    }
}
