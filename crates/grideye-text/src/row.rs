//! Rows: what a key of a table is.

/// One key of a table.
#[derive(Debug)]
pub struct Row {
    /// The key; before its last dot, the table as messages name it: `noise.sigma_c`.
    pub key: &'static str,
    /// Where in the key its name within the table starts: [`Row::name_at`].
    pub name_at: usize,
    /// What its value is.
    pub kind: Kind,
    /// The unit of its numbers.
    pub unit: &'static str,
    /// What its value must be, in words; empty: as [`Row::expected`] says it.
    pub told: &'static str,
    /// What the key means, or what to write instead: the hint of a refusal.
    pub doc: &'static str,
}

/// What the value of a key is.
#[derive(Debug)]
pub enum Kind {
    /// A text for which this holds.
    Text(fn(&str) -> bool),
    /// `true` or `false`.
    Flag,
    /// One of these words.
    Word(&'static [&'static str]),
    /// A number.
    Number(Number),
    /// A number, or one of these words for one.
    NumberOrWord(Number, &'static [&'static str]),
    /// A list of so many numbers.
    List(usize, Number),
    /// A list of so many numbers, or one number for all of them.
    ListOrOne(usize, Number),
    /// The same, refused number by number; or one of these words.
    OneOrEach(usize, Number, &'static [&'static str]),
    /// Two numbers, the second above the first.
    Rising(Number),
    /// A list of any length.
    Each(&'static Kind),
    /// A table whose keys are any names.
    Map(&'static Kind),
    /// A table.
    Table(&'static Rows),
    /// Tables `[[key]]`, at most so many.
    Tables(&'static Rows, usize),
}

/// The numbers allowed; never NaN.
#[derive(Debug, Clone, Copy)]
pub enum Number {
    /// From the first to the second.
    Within(f64, f64),
    /// Above the first, up to the second.
    Above(f64, f64),
    /// Between the two, both excluded.
    Between(f64, f64),
    /// The whole numbers from the first to the second, however written.
    Whole(f64, f64),
    /// Those that are written as whole numbers.
    Integer(f64, f64),
    /// Any, also NaN: whoever reads it checks it.
    Any,
}

/// The keys of a table.
#[derive(Debug)]
pub struct Rows {
    /// What messages call the table: `agent ` before its name, or `the room`.
    pub title: &'static str,
    /// Its rows, in groups that other tables may have too.
    pub rows: &'static [&'static [Row]],
    /// The keys that it must have.
    pub required: &'static [&'static str],
    /// What belongs together.
    pub rules: &'static [Rule],
}

/// Which keys of a table belong together, with a hint. Keys are separated by spaces.
#[derive(Debug)]
pub enum Rule {
    /// Keys of at most one of the groups, which `|` separates.
    OneWay(&'static str, &'static str),
    /// The same; the refusal is at the value of the first of the two.
    OneWayHere(&'static str, &'static str),
    /// The first key is not given with any of the others.
    Excludes(&'static str, &'static str, &'static str),
    /// One of these keys at least.
    OneOf(&'static str, &'static str),
    /// Each of the first keys needs the second.
    Needs(&'static str, &'static str, &'static str),
    /// The same; the refusal is at the value of the first key.
    NeedsHere(&'static str, &'static str, &'static str),
}

impl Number {
    /// Any finite number.
    pub const FINITE: Self = Self::Within(f64::MIN, f64::MAX);

    /// Whether the number is allowed.
    #[must_use]
    #[inline]
    pub fn holds(self, number: f64) -> bool {
        match self {
            Self::Within(low, high) => (low..=high).contains(&number),
            Self::Above(low, high) => low < number && number <= high,
            Self::Between(low, high) => low < number && number < high,
            Self::Whole(low, high) | Self::Integer(low, high) => {
                (low..=high).contains(&number) && number.fract() == 0.0
            }
            Self::Any => true,
        }
    }
}

impl Row {
    /// Where the name starts in a key: behind the last dot. It is computed once, because keys are looked up often.
    #[must_use]
    pub const fn name_at(key: &str) -> usize {
        let mut at = key.len();
        while at > 0 && key.as_bytes()[at - 1] != b'.' {
            at -= 1;
        }
        at
    }

    /// The key as it stands in its table.
    #[must_use]
    #[inline]
    pub fn name(&self) -> &'static str {
        &self.key[self.name_at..]
    }

    /// What its value must be, in words.
    #[must_use]
    pub fn expected(&self) -> String {
        use Number::{Integer, Whole, Within};
        let range = match self.kind {
            _ if !self.told.is_empty() => return self.told.to_owned(),
            Kind::Word(words) => return in_words(words),
            Kind::Number(Within(low, high) | Integer(low, high))
            | Kind::ListOrOne(_, Within(low, high)) => format!("{low} to {high}"),
            Kind::Number(Whole(low, high)) => format!("a whole number, {low} to {high}"),
            _ => String::new(),
        };
        format!("{range} {}", self.unit).trim_end().to_owned()
    }

    /// The words that its value may be.
    #[must_use]
    pub const fn words(&self) -> &'static [&'static str] {
        match self.kind {
            Kind::Word(words) | Kind::NumberOrWord(_, words) | Kind::OneOrEach(_, _, words) => {
                words
            }
            _ => &[],
        }
    }

    /// The lowest and the highest number that the key allows, if it has any.
    #[must_use]
    pub fn ends(&self) -> Option<[f64; 2]> {
        use Number::{Above, Any, Between, Integer, Whole, Within};
        match self.numbers()? {
            Within(low, high)
            | Above(low, high)
            | Between(low, high)
            | Whole(low, high)
            | Integer(low, high) => Some([low, high]),
            Any => None,
        }
    }

    /// The numbers that the key allows, if it has any.
    #[must_use]
    pub fn numbers(&self) -> Option<Number> {
        match self.kind {
            Kind::Number(numbers)
            | Kind::NumberOrWord(numbers, _)
            | Kind::List(_, numbers)
            | Kind::ListOrOne(_, numbers)
            | Kind::Rising(numbers) => Some(numbers),
            _ => None,
        }
    }
}

/// `"a", "b" or "c"`.
fn in_words(words: &[&str]) -> String {
    let quoted = format!("\"{}\"", words.join("\", \""));
    match quoted.rsplit_once(", ") {
        Some((others, last)) => format!("{others} or {last}"),
        None => quoted,
    }
}

impl Rows {
    /// No keys.
    pub const EMPTY: Self = Self {
        title: "the file",
        rows: &[],
        required: &[],
        rules: &[],
    };

    /// All rows.
    pub fn all(&self) -> impl Iterator<Item = &'static Row> + use<> {
        self.rows.iter().copied().flatten()
    }

    /// The row of a key.
    #[must_use]
    pub fn row(&self, key: &str) -> Option<&'static Row> {
        // Loops over bytes, because a draw of a data set asks some hundred times.
        for group in self.rows {
            for row in *group {
                if row.key.as_bytes()[row.name_at..] == *key.as_bytes() {
                    return Some(row);
                }
            }
        }
        None
    }

    /// The rows of the table, or of the tables, that a key holds.
    #[must_use]
    pub fn below(&self, key: &str) -> Option<&'static Self> {
        match self.row(key)?.kind {
            Kind::Table(rows) | Kind::Tables(rows, _) => Some(rows),
            _ => None,
        }
    }
}
