//! The values of a checked table, by key.

use crate::place::{Place, Refusal};
use crate::row::{Number, Row, Rows};
use crate::source::Source;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A table that has only keys and values of its rows.
#[derive(Debug, Clone, Copy)]
pub struct Table<'d> {
    /// The file.
    pub source: &'d Source<'d>,
    /// Its rows.
    pub rows: &'static Rows,
    /// Its keys and values.
    pub entries: &'d DeTable<'d>,
    /// The byte of the text where it starts.
    pub start: usize,
}

/// The value of a key, or one in its list.
#[derive(Debug, Clone, Copy)]
pub struct Value<'d> {
    source: &'d Source<'d>,
    rows: &'static Rows,
    key: &'d str,
    value: &'d Spanned<DeValue<'d>>,
}

impl<'d> Table<'d> {
    /// The value of a key, or of `table.key`.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<Value<'d>> {
        let Some((key, value)) = self.entries.get_key_value(key) else {
            debug_assert!(
                key.contains('.') || self.rows.row(key).is_some(),
                "`{key}` has no row"
            );
            let dot = key.bytes().position(|byte| byte == b'.')?;
            return self.table(&key[..dot])?.get(&key[dot + 1..]);
        };
        Some(Value {
            source: self.source,
            rows: self.rows,
            key: key.get_ref(),
            value,
        })
    }

    /// Whether the table has the key.
    #[must_use]
    pub fn has(&self, key: &str) -> bool {
        self.entries.contains_key(key)
    }

    /// A number.
    #[must_use]
    pub fn number(&self, key: &str) -> Option<f64> {
        self.get(key)?.number()
    }

    /// A whole number.
    #[must_use]
    pub fn whole(&self, key: &str) -> Option<i64> {
        self.get(key)?.whole()
    }

    /// A list of numbers; one number stands for all.
    #[must_use]
    pub fn list<const N: usize>(&self, key: &str) -> Option<[f64; N]> {
        self.get(key)?.list()
    }

    /// A text or word.
    #[must_use]
    pub fn text(&self, key: &str) -> Option<&'d str> {
        self.get(key)?.text()
    }

    /// A flag.
    #[must_use]
    pub fn flag(&self, key: &str) -> Option<bool> {
        self.get(key)?.value.get_ref().as_bool()
    }

    /// The values of a list; none without the key.
    pub fn each(&self, key: &str) -> impl Iterator<Item = Value<'d>> + Clone + use<'d> {
        self.get(key).into_iter().flat_map(Value::each)
    }

    /// The table that a key holds.
    #[must_use]
    pub fn table(&self, key: &str) -> Option<Self> {
        self.get(key)?.table()
    }

    /// The tables `[[key]]`.
    pub fn tables(&self, key: &str) -> impl Iterator<Item = Self> + Clone + use<'d> {
        self.each(key).filter_map(|value| value.table())
    }

    /// What messages call the table.
    #[must_use]
    pub fn title(&self) -> String {
        let named = |key| {
            self.entries
                .get(key)
                .and_then(|name| name.get_ref().as_str())
        };
        match named("name").or_else(|| named("key")) {
            Some(name) => format!("{}`{name}`", self.rows.title),
            None => self.rows.title.to_owned(),
        }
    }

    /// The refusal for a missing key, at the table's start.
    #[must_use]
    pub fn missing(&self, key: &str, hint: &str) -> Refusal {
        self.missing_at(self.start, key, hint)
    }

    /// The refusal for a missing key, at a byte of the text.
    #[must_use]
    pub fn missing_at(&self, byte: usize, key: &str, hint: &str) -> Refusal {
        let problem = format!("{} has no `{key}`", self.title());
        self.source.place(byte).refused(problem, hint)
    }

    /// The refusal for two keys that exclude each other.
    #[must_use]
    pub fn conflict(&self, byte: usize, [key, other]: [&str; 2], hint: &str) -> Refusal {
        let problem = format!("{} has both `{key}` and `{other}`", self.title());
        self.source.place(byte).refused(problem, hint)
    }
}

impl<'d> Value<'d> {
    /// Its bytes of the text.
    #[must_use]
    pub fn span(&self) -> Range<usize> {
        self.value.span()
    }

    /// Where it starts.
    #[must_use]
    pub fn place(&self) -> Place {
        self.source.place(self.span().start)
    }

    /// A number.
    #[must_use]
    pub fn number(&self) -> Option<f64> {
        number(self.value.get_ref())
    }

    /// A whole number.
    #[must_use]
    pub fn whole(&self) -> Option<i64> {
        whole(self.value.get_ref())
    }

    /// A text or word.
    #[must_use]
    pub fn text(&self) -> Option<&'d str> {
        self.value.get_ref().as_str()
    }

    /// A list of numbers; one number stands for all.
    #[must_use]
    pub fn list<const N: usize>(&self) -> Option<[f64; N]> {
        if let Some(number) = self.number() {
            return Some([number; N]);
        }
        let mut list = [0.0; N];
        let mut each = self.each();
        for number in &mut list {
            *number = each.next()?.number()?;
        }
        Some(list)
    }

    /// The values of a list.
    pub fn each(self) -> impl Iterator<Item = Self> + Clone + use<'d> {
        let list = self
            .value
            .get_ref()
            .as_array()
            .into_iter()
            .flat_map(|list| list.iter());
        list.map(move |value| Self { value, ..self })
    }

    /// The names and values of a table whose keys are any names.
    pub fn named(self) -> impl Iterator<Item = (&'d str, Self)> + use<'d> {
        let table = self
            .value
            .get_ref()
            .as_table()
            .into_iter()
            .flat_map(|table| table.iter());
        table.map(move |(key, value)| (key.get_ref().as_ref(), Self { value, ..self }))
    }

    /// The table.
    #[must_use]
    pub fn table(&self) -> Option<Table<'d>> {
        Some(Table {
            source: self.source,
            rows: self.rows.below(self.key)?,
            entries: self.value.get_ref().as_table()?,
            start: self.span().start,
        })
    }

    /// The number, if it is one of these.
    ///
    /// # Errors
    /// The refusal, in these words and with this hint.
    pub fn number_of(&self, numbers: Number, expected: &str, hint: &str) -> Result<f64, Refusal> {
        let number = self.number().filter(|number| numbers.holds(*number));
        number.ok_or_else(|| self.refused_with(expected, hint))
    }

    /// The refusal of this value, in the words of its row.
    #[must_use]
    pub fn wrong(&self) -> Refusal {
        let expected = self.row().map(Row::expected).unwrap_or_default();
        self.refused(&expected)
    }

    /// The refusal of this value, with the hint of its row.
    #[must_use]
    pub fn refused(&self, expected: &str) -> Refusal {
        self.refused_with(expected, self.row().map_or("", |row| row.doc))
    }

    /// The refusal of this value.
    #[must_use]
    pub fn refused_with(&self, expected: &str, hint: &str) -> Refusal {
        let key = self.row().map_or(self.key, |row| row.key);
        self.source.refused(key, self.span(), expected, hint)
    }

    fn row(&self) -> Option<&'static Row> {
        self.rows.row(self.key)
    }
}

/// A value as a number.
pub(crate) fn number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Float(float) => float.as_str().parse().ok(),
        // Most numbers are short; longer ones are within the limits of a float.
        DeValue::Integer(integer) if integer.radix() == 10 => match integer.as_str().parse() {
            Ok(short) => Some(i32::into(short)),
            Err(_) => integer.as_str().parse().ok(),
        },
        #[expect(
            clippy::as_conversions,
            clippy::cast_precision_loss,
            reason = "as TOML's readers do it for all integers"
        )]
        DeValue::Integer(_) => whole(value).map(|whole| whole as f64),
        _ => None,
    }
}

/// A value as a whole number.
pub(crate) fn whole(value: &DeValue<'_>) -> Option<i64> {
    let integer = value.as_integer()?;
    i64::from_str_radix(integer.as_str(), integer.radix()).ok()
}
