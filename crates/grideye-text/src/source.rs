//! A file's name and text, and refusals at its places.

use crate::place::{Place, Refusal, excerpt};
use crate::row::Row;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A TOML file.
#[derive(Debug, Clone, Copy)]
pub struct Source<'a> {
    /// Its name in messages.
    pub origin: &'a str,
    /// Its text.
    pub text: &'a str,
    /// How its refusals are worded.
    pub style: &'static Style,
}

/// How the refusals of one kind of file are worded.
#[derive(Debug)]
pub struct Style {
    /// The hint about an unknown key,
    pub unknown: &'static str,
    /// a missing one,
    pub missing: &'static str,
    /// a value of the wrong type,
    pub mistyped: &'static str,
    /// and text that is not TOML.
    pub no_toml: &'static str,
    /// The message about a key, what was found, and what was expected.
    pub wrong: fn(&str, &str, &str) -> String,
    /// The most bytes of text, and the hint about more.
    pub bytes_max: (usize, &'static str),
    /// Whether messages about types and TOML begin with the key of the line.
    pub names_key: bool,
}

impl Style {
    /// For files without a manual.
    pub const EMPTY: Self = Self {
        unknown: "correct the spelling or remove the key",
        missing: "add the key to this table",
        mistyped: "the value is of another type",
        no_toml: "the file must be TOML: text in quotes, every key once, lists in brackets",
        wrong: |key, found, expected| format!("`{key}` is {found}, expected {expected}"),
        bytes_max: (64 * 1024, "check that it is the right file"),
        names_key: true,
    };
}

impl<'a> Source<'a> {
    /// The text as TOML.
    ///
    /// # Errors
    /// That it is too long, or its first mistake.
    pub fn document(&self) -> Result<Spanned<DeTable<'a>>, Refusal> {
        self.check_length()?;
        DeTable::parse(self.text).map_err(|error| {
            let message = error.message().trim_end().replace('\n', ", ");
            let byte = error.span().map_or(0, |span| span.start);
            self.told(byte, message, self.style.no_toml)
        })
    }

    /// Checks that the text is not too long.
    ///
    /// # Errors
    /// If it is.
    pub fn check_length(&self) -> Result<(), Refusal> {
        let (limit, hint) = self.style.bytes_max;
        self.check_count("bytes of text", self.text.len(), (limit, 0), hint)
    }

    /// The place of a byte of the text.
    #[must_use]
    pub fn place(&self, byte: usize) -> Place {
        Place::of_byte(self.origin, self.text, byte)
    }

    /// The refusal of a key's value.
    #[must_use]
    pub fn refused(&self, key: &str, span: Range<usize>, expected: &str, hint: &str) -> Refusal {
        let place = self.place(span.start);
        let found = excerpt(self.text.get(span).unwrap_or_default());
        place.refused((self.style.wrong)(key, &found, expected), hint)
    }

    /// Refuses more than `limit` of something.
    ///
    /// # Errors
    /// The refusal, at a byte of the text.
    pub fn check_count(
        &self,
        what: &str,
        found: usize,
        (limit, byte): (usize, usize),
        hint: &str,
    ) -> Result<(), Refusal> {
        if found <= limit {
            return Ok(());
        }
        let problem = format!("{found} {what}, expected at most {limit}");
        Err(self.place(byte).refused(problem, hint))
    }

    pub(crate) fn refused_by(&self, row: &Row, span: Range<usize>) -> Refusal {
        self.refused(row.key, span, &row.expected(), row.doc)
    }

    pub(crate) fn mistyped(&self, value: &Spanned<DeValue<'_>>, expected: &str) -> Refusal {
        let found = match value.get_ref() {
            DeValue::String(text) => format!("string {:?}", excerpt(text)),
            DeValue::Integer(number) => format!("integer `{number}`"),
            DeValue::Float(number) => format!("floating point `{number}`"),
            DeValue::Boolean(flag) => format!("boolean `{flag}`"),
            DeValue::Datetime(_) => "datetime".to_owned(),
            DeValue::Array(_) => "sequence".to_owned(),
            DeValue::Table(_) => "map".to_owned(),
        };
        let message = format!("invalid type: {found}, expected {expected}");
        self.told(value.span().start, message, self.style.mistyped)
    }

    /// A refusal, with the key before the byte on its line.
    pub(crate) fn told(&self, byte: usize, message: String, hint: &str) -> Refusal {
        let line = self
            .text
            .get(..byte)
            .and_then(|text| text.rsplit('\n').next());
        let key = line.and_then(|line| line.split_once('='));
        let message = match key.filter(|_| self.style.names_key) {
            Some((key, _)) => format!("`{}`: {message}", key.trim()),
            None => message,
        };
        self.place(byte).refused(message, hint)
    }
}
