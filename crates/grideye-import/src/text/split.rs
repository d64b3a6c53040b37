//! Splits a line into fields.

use crate::cell::{Cell, Field};

/// What separates the fields of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Separator {
    Tab,
    Semicolon,
    Bar,
    Comma,
    Blank,
}

/// What stands behind a number: a unit, or a frame drawn around.
const SUFFIXES: [&str; 9] = ["°C", "ºC", "degC", "°F", "ºF", "degF", "C", "F", "K"];

impl Separator {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Tab => "tabs",
            Self::Semicolon => "semicolons",
            Self::Bar => "bars",
            Self::Comma => "commas",
            Self::Blank => "blanks",
        }
    }

    pub(super) const fn character(self) -> char {
        match self {
            Self::Tab => '\t',
            Self::Semicolon => ';',
            Self::Bar => '|',
            Self::Comma => ',',
            Self::Blank => ' ',
        }
    }

    /// Whether a line ends in the separator.
    pub(super) fn is_at_end(self, line: &str) -> bool {
        self != Self::Blank
            && line
                .trim_end_matches([' ', '\r'])
                .ends_with(self.character())
    }

    /// The first of tab, semicolon, bar and comma that most lines have outside lists and quotation marks; else blanks.
    pub(super) fn of(lines: &[&str]) -> Self {
        let is_decimal_comma = |line: &&str| {
            let words = || line.split_whitespace();
            let fractions = words().filter(|word| decimal_comma(word).is_some()).count();
            let is_integer = |word: &str| word.parse::<i64>().is_ok();
            let others = words().filter(|word| decimal_comma(word).is_none());
            fractions >= 4 && others.clone().count() <= fractions && others.clone().all(is_integer)
        };
        if lines.iter().filter(|line| is_decimal_comma(line)).count() * 2 > lines.len() {
            return Self::Blank;
        }
        let has = |separator: &Self| {
            let with = lines.iter().filter(|line| separator.split(line).len() > 1);
            // Of lines of time and lines of frames, half have it.
            with.count() * 3 > lines.len()
        };
        let found = [Self::Tab, Self::Semicolon, Self::Bar, Self::Comma]
            .into_iter()
            .find(has);
        found.unwrap_or(Self::Blank)
    }

    /// The texts between the separators; one separator at the end ends the last field.
    pub(super) fn split(self, line: &str) -> Vec<&str> {
        let (mut fields, mut from) = (Vec::new(), 0);
        let (mut depth, mut quoted) = (0_i32, false);
        for (at, character) in line.char_indices() {
            match character {
                '"' => quoted = !quoted,
                '[' | '(' => depth += 1,
                ']' | ')' => depth -= 1,
                _ => {}
            }
            let separates = match self {
                Self::Blank => character.is_whitespace(),
                _ => character == self.character(),
            };
            if separates && !quoted && depth <= 0 {
                fields.push(line[from..at].trim());
                from = at + character.len_utf8();
            }
        }
        if !line[from..].trim().is_empty() {
            fields.push(line[from..].trim());
        }
        if self == Self::Blank {
            fields.retain(|field| !field.is_empty());
        }
        fields
    }

    /// One cell, or the numbers of a list.
    pub(super) fn field(self, text: &str) -> Field {
        // As of `12: 24.5 24.75`.
        let text = text.trim_end_matches(':');
        let quoted = text
            .strip_prefix(['"', '\''])
            .and_then(|text| text.strip_suffix(['"', '\'']));
        if self != Self::Comma || quoted.is_some() {
            if let Some(decimal) = decimal_comma(quoted.unwrap_or(text)) {
                return Field::One(Cell::Text(decimal));
            }
        }
        let between =
            |character: char| character.is_whitespace() || ",;[](){}\"'".contains(character);
        let inner = text.trim().strip_prefix("array(").unwrap_or(text);
        let mut tokens = inner.split(between).filter(|token| !token.is_empty());
        let Some(first) = tokens.next().and_then(number) else {
            return Field::One(Cell::of_text(text));
        };
        let mut cells = vec![Cell::of_text(first)];
        for token in tokens.filter(|token| !SUFFIXES.contains(token) && !token.starts_with("dtype"))
        {
            let Some(number) = number(token) else {
                return Field::One(Cell::of_text(text));
            };
            cells.push(Cell::of_text(number));
        }
        match cells.len() {
            1 => Field::One(cells.remove(0)),
            _ => Field::Many(cells),
        }
    }
}

/// The numbers of a text that is a list of them, of a frame's row at least.
pub(crate) fn list(text: &str) -> Option<Vec<Cell>> {
    let texts = [Separator::Semicolon, Separator::Comma]
        .into_iter()
        .find(|separator| separator.split(text).len() >= 8);
    let cells: Vec<Cell> = match texts {
        Some(separator) => separator
            .split(text)
            .into_iter()
            .flat_map(|text| separator.field(text).cells().to_vec())
            .collect(),
        None => Separator::Comma.field(text).cells().to_vec(),
    };
    (cells.len() >= 8 && cells.iter().all(|cell| cell.number().is_some())).then_some(cells)
}

/// A number without the unit behind it.
pub(super) fn number(token: &str) -> Option<&str> {
    let bare = SUFFIXES
        .iter()
        .find_map(|suffix| token.strip_suffix(suffix));
    let bare = bare.unwrap_or(token);
    bare.parse::<f64>().is_ok().then_some(bare)
}

/// The unit behind a number.
pub(super) fn unit_of(token: &str) -> Option<&'static str> {
    number(token)?;
    SUFFIXES.into_iter().find(|suffix| token.ends_with(suffix))
}

/// `24,5` with a point.
fn decimal_comma(text: &str) -> Option<String> {
    let (whole, fraction) = text.trim().split_once(',')?;
    let digits = |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
    let unsigned = whole.strip_prefix('-').unwrap_or(whole);
    (digits(unsigned) && digits(fraction)).then(|| format!("{whole}.{fraction}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_separator_is_outside_lists_and_quotation_marks() {
        for (line, separator, fields) in [
            ("1.5,2.5,3", Separator::Comma, 3),
            ("1.5,2.5,", Separator::Comma, 2),
            ("1.5,,3", Separator::Comma, 3),
            ("1,5;2,5", Separator::Semicolon, 2),
            ("a b\t1\t2", Separator::Tab, 3),
            ("152.5 \"[1, 2]\"", Separator::Blank, 2),
            ("152.5, [1, 2]", Separator::Comma, 2),
            ("(0, 0)", Separator::Blank, 1),
        ] {
            assert_eq!(Separator::of(&[line]), separator, "{line}");
            assert_eq!(separator.split(line).len(), fields, "{line}");
        }
        let decimal = vec!["24,5"; 64].join(" ");
        assert_eq!(Separator::of(&[&decimal]), Separator::Blank);
        assert_eq!(
            Separator::Blank.field("24,5"),
            Field::One(Cell::Text("24.5".to_owned()))
        );
    }

    #[test]
    fn a_list_of_numbers_is_many_cells_and_a_time_is_one() {
        let width = |text: &str| Separator::Comma.field(text).cells().len();
        assert_eq!(width("\"[24.5, nan, 1e2]\""), 3);
        assert_eq!(width("[[1 2]\n [3 4]]"), 4);
        assert_eq!(width("array([1, 2])"), 2);
        for one in ["2021-07-01 18:14:07", "two people", "[24.5]", "", "1"] {
            assert_eq!(width(one), 1, "{one}");
        }
    }
}
