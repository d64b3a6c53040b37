//! Rows of cells, which is what every container holds.

use std::borrow::Cow;

/// One value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Cell {
    Empty,
    Text(String),
    Integer(i64),
    Number(f64),
}

/// One column's value in one row: one cell, or a list of them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Field {
    One(Cell),
    Many(Vec<Cell>),
}

/// One row, before its columns are known.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RawRow {
    /// The line of a text, else the row, from 1.
    pub(crate) number: u64,
    pub(crate) fields: Vec<Field>,
    /// Whether its end is certain; a text may be cut within its last number.
    pub(crate) is_whole: bool,
    /// Whether it has no pixels but was meant to have: the frame is missing.
    pub(crate) is_torn: bool,
}

/// Characters of a column's name, or of each part of it.
const NAME_CHARS_MAX: usize = 200;

/// A name's beginning: of what is longer nobody asks, and a list has its name once for each of its values.
pub(crate) fn short(name: &str) -> &str {
    let end = name.char_indices().nth(NAME_CHARS_MAX);
    end.map_or(name, |(end, _)| &name[..end])
}

/// What stands for nothing in other people's files, in lower case.
const NOTHING: [&str; 6] = ["", "nan", "null", "none", "na", "n/a"];

impl Cell {
    /// A text without the blanks and quotation marks around it.
    pub(crate) fn of_text(text: &str) -> Self {
        let text = text.trim().trim_matches(['"', '\'']).trim();
        match NOTHING.contains(&text.to_ascii_lowercase().as_str()) {
            true => Self::Empty,
            false => Self::Text(text.to_owned()),
        }
    }

    /// A number that is not infinite, and nothing for NaN.
    pub(crate) fn number(&self) -> Option<f64> {
        #[expect(
            clippy::as_conversions,
            clippy::cast_precision_loss,
            reason = "exact for what a temperature may be"
        )]
        let number = match self {
            Self::Empty => return None,
            Self::Text(text) => text.parse().ok()?,
            Self::Integer(integer) => *integer as f64,
            Self::Number(number) => *number,
        };
        number.is_finite().then_some(number)
    }

    pub(crate) fn is_empty(&self) -> bool {
        match self {
            Self::Empty => true,
            Self::Number(number) => number.is_nan(),
            Self::Text(_) | Self::Integer(_) => false,
        }
    }

    /// As written in the file, or as the shortest decimal.
    pub(crate) fn text(&self) -> Cow<'_, str> {
        match self {
            Self::Empty => Cow::Borrowed(""),
            Self::Text(text) => Cow::Borrowed(text),
            Self::Integer(integer) => Cow::Owned(integer.to_string()),
            Self::Number(number) => Cow::Owned(number.to_string()),
        }
    }
}

impl Field {
    pub(crate) fn cells(&self) -> &[Cell] {
        match self {
            Self::One(cell) => std::slice::from_ref(cell),
            Self::Many(cells) => cells,
        }
    }
}

impl RawRow {
    /// The number of cells.
    pub(crate) fn width(&self) -> usize {
        self.fields.iter().map(|field| field.cells().len()).sum()
    }

    /// The bytes of its texts.
    pub(crate) fn text_bytes(&self) -> usize {
        let cells = self.fields.iter().flat_map(Field::cells);
        let texts = cells.map(|cell| match cell {
            Cell::Text(text) => text.len(),
            _ => 0,
        });
        texts.sum()
    }

    pub(crate) fn flat(&self) -> Vec<Cell> {
        self.fields.iter().flat_map(Field::cells).cloned().collect()
    }
}
