//! A TOML file's name and text: checks values and reports errors with their place.

use super::place::{Place, Refusal, excerpt};
use serde::de::{
    Deserialize, Deserializer, Error, IntoDeserializer, SeqAccess, Unexpected, Visitor,
};
use std::fmt;
use std::marker::PhantomData;
use std::ops::Range;
use toml::Spanned;

pub(crate) struct Source<'a> {
    pub(crate) origin: &'a str,
    pub(crate) text: &'a str,
    /// The manual that describes its keys.
    pub(crate) manual: &'static str,
    /// Added to the hint about a value of the wrong type.
    pub(crate) tables: &'static str,
}

/// The numbers allowed for a key; NaN breaks every rule.
pub(crate) struct Rule {
    pub(crate) key: &'static str,
    pub(crate) holds: fn(f64) -> bool,
    pub(crate) expected: &'static str,
    pub(crate) hint: &'static str,
}

impl Rule {
    /// The same rule for another key.
    pub(crate) const fn of(self, key: &'static str) -> Self {
        Self { key, ..self }
    }

    pub(crate) const fn with(self, key: &'static str, hint: &'static str) -> Self {
        Self { key, hint, ..self }
    }
}

impl Source<'_> {
    pub(crate) fn place(&self, byte: usize) -> Place {
        Place::of_byte(self.origin, self.text, byte)
    }

    /// The TOML reader's error, with the key added if the reader does not name it.
    pub(crate) fn malformed(&self, error: &toml::de::Error) -> Refusal {
        let byte = error.span().map_or(0, |span| span.start);
        let message = error.message().trim_end().replace('\n', ", ");
        let manual = self.manual;
        let hint = if message.starts_with("unknown field") {
            format!("correct the spelling or remove the key; {manual} describes every key")
        } else if message.starts_with("missing field") {
            format!("add the key to this table; {manual} describes every key")
        } else if message.starts_with("invalid") {
            format!("{manual} gives each key's type{}", self.tables)
        } else {
            "the file must be TOML: text in quotes, every key once, lists in brackets".to_owned()
        };
        // Replace Rust types with words that the file's author knows.
        let message = message
            .replace("expected f64", "expected a number")
            .replace("expected i64", "expected a whole number");
        let message = match self.key_before(byte) {
            Some(key) => format!("`{key}`: {message}"),
            None => message,
        };
        self.place(byte).refused(message, &hint)
    }

    pub(crate) fn refused(
        &self,
        key: &str,
        span: Range<usize>,
        expected: &str,
        hint: &str,
    ) -> Refusal {
        let place = self.place(span.start);
        let found = excerpt(self.text.get(span).unwrap_or_default());
        place.refused(format!("`{key}` is {found}, expected {expected}"), hint)
    }

    pub(crate) fn check(
        &self,
        number: f64,
        span: Range<usize>,
        rule: &Rule,
    ) -> Result<f64, Refusal> {
        if (rule.holds)(number) {
            return Ok(number);
        }
        Err(self.refused(rule.key, span, rule.expected, rule.hint))
    }

    pub(crate) fn number(&self, number: &Spanned<f64>, rule: &Rule) -> Result<f64, Refusal> {
        self.check(*number.get_ref(), number.span(), rule)
    }

    pub(crate) fn optional(
        &self,
        number: &Option<Spanned<f64>>,
        rule: &Rule,
    ) -> Result<Option<f64>, Refusal> {
        let number = number.as_ref();
        number.map(|number| self.number(number, rule)).transpose()
    }

    pub(crate) fn number_or(
        &self,
        number: &Option<Spanned<f64>>,
        rule: &Rule,
        default: f64,
    ) -> Result<f64, Refusal> {
        Ok(self.optional(number, rule)?.unwrap_or(default))
    }

    /// The meaning of one of several words.
    pub(crate) fn choice<T: Clone>(
        &self,
        key: &str,
        given: &Option<Spanned<String>>,
        choices: &[(&str, T)],
        hint: &str,
    ) -> Result<Option<T>, Refusal> {
        let Some(given) = given else { return Ok(None) };
        if let Some((_, chosen)) = choices.iter().find(|(word, _)| word == given.get_ref()) {
            return Ok(Some(chosen.clone()));
        }
        let words: Vec<String> = choices
            .iter()
            .map(|(word, _)| format!("\"{word}\""))
            .collect();
        let (last, others) = words
            .split_last()
            .map_or(("", &[][..]), |(last, others)| (last, others));
        let expected = format!("{} or {last}", others.join(", "));
        Err(self.refused(key, given.span(), &expected, hint))
    }

    /// The key before a byte on its line, if the byte is in a value.
    fn key_before(&self, byte: usize) -> Option<&str> {
        let line = self.text.get(..byte)?.rsplit('\n').next()?;
        line.split_once('=').map(|(key, _)| key.trim())
    }
}

/// Exactly `N` values (serde's arrays accept a longer list); with `ONE`, a single value stands for all of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounded<T, const N: usize, const ONE: bool = false>(pub(crate) [T; N]);

impl<'de, T, const N: usize, const ONE: bool> Deserialize<'de> for Bounded<T, N, ONE>
where
    T: Deserialize<'de> + Copy + Default,
{
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(BoundedVisitor::<T, N, ONE>(PhantomData))
    }
}

struct BoundedVisitor<T, const N: usize, const ONE: bool>(PhantomData<T>);

impl<'de, T, const N: usize, const ONE: bool> Visitor<'de> for BoundedVisitor<T, N, ONE>
where
    T: Deserialize<'de> + Copy + Default,
{
    type Value = Bounded<T, N, ONE>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let one = if ONE { "a number, or " } else { "" };
        write!(formatter, "{one}a list of {N} numbers")
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<Self::Value, E> {
        if ONE {
            return T::deserialize(number.into_deserializer()).map(|number| Bounded([number; N]));
        }
        Err(E::invalid_type(Unexpected::Float(number), &self))
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<Self::Value, E> {
        if ONE {
            return T::deserialize(number.into_deserializer()).map(|number| Bounded([number; N]));
        }
        Err(E::invalid_type(Unexpected::Signed(number), &self))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Self::Value, A::Error> {
        let mut numbers = [T::default(); N];
        let wrong = |length| A::Error::invalid_length(length, &&*format!("a list of {N} numbers"));
        for (index, number) in numbers.iter_mut().enumerate() {
            *number = list.next_element()?.ok_or_else(|| wrong(index))?;
        }
        match list.next_element::<serde::de::IgnoredAny>()? {
            None => Ok(Bounded(numbers)),
            Some(_) => Err(wrong(N + 1)),
        }
    }
}
