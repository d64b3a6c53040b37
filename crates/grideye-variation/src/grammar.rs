//! Parses the possible values of a key: `26..34`, `1700+-100`, `0.1,0.2`, `[500..3500, 1200, 0],[2000, 500..5500, 0]`, `on,off`.
//!
//! ```text
//! choices = choice *("," choice)          one of them, all equally likely
//! choice  = a TOML value; every number may be a uniform range LOW..HIGH or a normal law
//!           MEAN+-SD, cut at SDS_MAX standard deviations, and text needs no quotes
//! ```

use super::error::{CHOICES_MAX, Mistake};
use grideye_scene::uncertain::{Normal, SDS_MAX, Uncertain};

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Choice(pub(crate) Vec<Piece>);

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Piece {
    /// Brackets, commas, keys of inline tables.
    Mark(String),
    /// Text, quoted or not.
    Text(String),
    Flag(bool),
    /// A number as written, and its value.
    Number(String, f64),
    /// A number between the two.
    Range(f64, f64),
    /// A number of a normal law, cut at the bounds.
    Normal(Normal, [f64; 2]),
}

impl Choice {
    /// A number with the law of its `[[uncertain]]` table.
    pub(crate) fn of_law(uncertain: &Uncertain) -> Self {
        let [low, high] = uncertain.bounds;
        Self(vec![match uncertain.law {
            Some(law) => Piece::Normal(law, [low, high]),
            None => Piece::Range(low, high),
        }])
    }

    /// A whole number.
    pub(crate) fn of_count(count: usize) -> Self {
        let number = u32::try_from(count).unwrap_or(u32::MAX);
        Self(vec![Piece::Number(count.to_string(), f64::from(number))])
    }

    /// The lowest and the highest number of a single law.
    pub(crate) fn bounds(&self) -> Option<[f64; 2]> {
        match self.0.as_slice() {
            [Piece::Range(low, high)] => Some([*low, *high]),
            [Piece::Normal(_, bounds)] => Some(*bounds),
            _ => None,
        }
    }

    /// How many numbers it holds: `Some(None)` for a single one, `Some(n)` for a flat list of n, `None` for anything
    /// else.
    pub(crate) fn numbers(&self) -> Option<Option<usize>> {
        let is_number = |piece: &Piece| !matches!(piece, Piece::Mark(_) | Piece::Text(_));
        match self.0.as_slice() {
            [only] if is_number(only) => Some(None),
            [Piece::Mark(open), inner @ .., Piece::Mark(close)] if open == "[" && close == "]" => {
                let alternates = inner.iter().enumerate().all(|(index, piece)| {
                    if index % 2 == 0 {
                        is_number(piece)
                    } else {
                        *piece == Piece::Mark(",".to_owned())
                    }
                });
                (alternates && inner.len() % 2 == 1).then_some(Some(inner.len().div_ceil(2)))
            }
            _ => None,
        }
    }
}

/// Parses what follows the `=`.
pub(crate) fn choices(text: &str) -> Result<Vec<Choice>, Mistake> {
    let mut choices = vec![Choice(Vec::new())];
    let mut open = Vec::new();
    let mut rest = text.trim();
    while let Some(first) = rest.chars().next() {
        let (piece, length) = piece(rest, first)?;
        rest = rest.get(length..).unwrap_or_default().trim_start();
        match &piece {
            Piece::Mark(mark) if mark == "[" || mark == "{" => open.push(mark.clone()),
            Piece::Mark(mark) if mark == "]" || mark == "}" => close(&mut open, mark)?,
            Piece::Mark(mark) if mark == "," && open.is_empty() => {
                choices.push(Choice(Vec::new()));
                continue;
            }
            _ => {}
        }
        if let Some(choice) = choices.last_mut() {
            choice.0.push(piece);
        }
    }
    if let Some(mark) = open.pop() {
        return Err(Mistake::unclosed(&mark));
    }
    if choices.iter().any(|choice| choice.0.is_empty()) {
        return Err(Mistake::nothing());
    }
    if choices.len() > CHOICES_MAX {
        return Err(Mistake::too_many_choices(choices.len()));
    }
    Ok(choices)
}

fn close(open: &mut Vec<String>, mark: &str) -> Result<(), Mistake> {
    let fits = match open.pop().as_deref() {
        Some("[") => mark == "]",
        Some("{") => mark == "}",
        _ => false,
    };
    if fits {
        Ok(())
    } else {
        Err(Mistake(format!(
            "`{mark}` was never opened\nhint: quote the whole argument for the shell"
        )))
    }
}

fn piece(rest: &str, first: char) -> Result<(Piece, usize), Mistake> {
    if "[]{},=".contains(first) {
        return Ok((Piece::Mark(first.to_string()), 1));
    }
    if first == '"' || first == '\'' {
        let inner = rest.get(1..).unwrap_or_default();
        let Some(end) = inner.find(first) else {
            return Err(Mistake::unclosed(&first.to_string()));
        };
        let inner = inner.get(..end).unwrap_or_default();
        return Ok((Piece::Text(inner.to_owned()), end + 2));
    }
    let length = rest
        .find(|mark| "[]{},=\"'".contains(mark))
        .unwrap_or(rest.len());
    let (word, after) = rest.split_at(length);
    let word = word.trim_end();
    if after.starts_with('=') {
        return Ok((Piece::Mark(word.to_owned()), length));
    }
    Ok((meaning(word)?, length))
}

fn meaning(word: &str) -> Result<Piece, Mistake> {
    match word {
        "true" | "on" => return Ok(Piece::Flag(true)),
        "false" | "off" => return Ok(Piece::Flag(false)),
        _ => {}
    }
    if let Some((low, high)) = word.split_once("..") {
        return match (number(low), number(high)) {
            (Some(low), Some(high)) if low <= high && (high - low).is_finite() => {
                Ok(Piece::Range(low, high))
            }
            (Some(_), Some(_)) => Err(Mistake(format!(
                "the range {word} is empty\nhint: write the lower number first"
            ))),
            // Paths may contain dots, too.
            _ if low.contains('/') || high.contains('/') => Ok(Piece::Text(word.to_owned())),
            _ => Err(Mistake(format!(
                "{word} is not a range of numbers\nhint: write LOW..HIGH, as in 26..34"
            ))),
        };
    }
    if let Some((mean, sd)) = word.split_once("+-") {
        return match (number(mean), number(sd)) {
            (Some(mean), Some(sd)) if sd > 0.0 && (SDS_MAX * sd).is_finite() => {
                let bounds = [mean - SDS_MAX * sd, mean + SDS_MAX * sd];
                Ok(Piece::Normal(Normal { mean, sd }, bounds))
            }
            (Some(_), _) => Err(Mistake(format!(
                "{word} is not a normal law\nhint: write MEAN+-SD with SD above 0, as in 1700+-100"
            ))),
            _ => Ok(Piece::Text(word.to_owned())),
        };
    }
    Ok(match number(word) {
        Some(value) if is_whole(word) => Piece::Number(word.to_owned(), value),
        Some(value) => Piece::Number(format!("{value:?}"), value),
        None => Piece::Text(word.to_owned()),
    })
}

fn number(text: &str) -> Option<f64> {
    let text = text.trim();
    let begins = text.trim_start_matches(['+', '-']);
    if !begins.starts_with(|first: char| first.is_ascii_digit() || first == '.') {
        return None;
    }
    text.parse().ok().filter(|number: &f64| number.is_finite())
}

/// Whether TOML reads it as an integer unchanged.
fn is_whole(text: &str) -> bool {
    let digits = text.trim_start_matches(['+', '-']);
    digits.bytes().all(|byte| byte.is_ascii_digit())
        && (digits.len() == 1 || !digits.starts_with('0'))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(text: &str, value: f64) -> Piece {
        Piece::Number(text.to_owned(), value)
    }

    fn mark(text: &str) -> Piece {
        Piece::Mark(text.to_owned())
    }

    #[test]
    fn ranges_lists_and_words_are_told_apart() {
        assert_eq!(
            choices("26..34").unwrap(),
            [Choice(vec![Piece::Range(26.0, 34.0)])]
        );
        assert_eq!(
            choices("-1.5e1 .. -.5").unwrap(),
            [Choice(vec![Piece::Range(-15.0, -0.5)])]
        );
        assert_eq!(
            choices("0.1, 2").unwrap(),
            [
                Choice(vec![number("0.1", 0.1)]),
                Choice(vec![number("2", 2.0)])
            ]
        );
        assert_eq!(
            choices("on,constant,\"A, B\"").unwrap(),
            [
                Choice(vec![Piece::Flag(true)]),
                Choice(vec![Piece::Text("constant".to_owned())]),
                Choice(vec![Piece::Text("A, B".to_owned())])
            ]
        );
        let lists = choices("[1..2, 3],[4, 5]").unwrap();
        assert_eq!(lists.len(), 2);
        assert_eq!(
            lists[0].0,
            [
                mark("["),
                Piece::Range(1.0, 2.0),
                mark(","),
                number("3", 3.0),
                mark("]")
            ]
        );
        let table = choices("{ top = 40..60 }").unwrap();
        assert_eq!(
            table[0].0,
            [
                mark("{"),
                mark("top"),
                mark("="),
                Piece::Range(40.0, 60.0),
                mark("}")
            ]
        );
        assert_eq!(
            choices("../walk.csv").unwrap(),
            [Choice(vec![Piece::Text("../walk.csv".to_owned())])]
        );
    }

    /// Also in lists; a name with the same marks stays a name.
    #[test]
    fn normal_laws_are_cut_at_four_standard_deviations() {
        let law = |mean, sd, bounds| Piece::Normal(Normal { mean, sd }, bounds);
        let height = law(1700.0, 100.0, [1300.0, 2100.0]);
        assert_eq!(
            choices("1700+-100").unwrap(),
            [Choice(vec![height.clone()])]
        );
        assert_eq!(choices("[1, 1700 +- 100]").unwrap()[0].0[3], height);
        assert_eq!(
            choices("-2.5+-.5").unwrap()[0].0,
            [law(-2.5, 0.5, [-4.5, -0.5])]
        );
        assert_eq!(choices("1700+-100").unwrap()[0].numbers(), Some(None));
        assert_eq!(
            choices("walk+-1.csv").unwrap()[0].0,
            [Piece::Text("walk+-1.csv".to_owned())]
        );
    }

    #[test]
    fn only_flat_lists_of_numbers_are_columns() {
        let numbers = |text: &str| choices(text).unwrap()[0].numbers();
        assert_eq!(numbers("1..2"), Some(None));
        assert_eq!(numbers("off"), Some(None));
        assert_eq!(numbers("[1, 2..3, 4]"), Some(Some(3)));
        for other in ["[]", "[1, [2]]", "A", "[1,]", "{ a = 1 }", "[a]"] {
            assert_eq!(numbers(other), None, "{other}");
        }
    }

    #[test]
    fn malformed_values_are_named() {
        for (text, mistake) in [
            ("", "a value is missing"),
            ("1,", "a value is missing"),
            (",1", "a value is missing"),
            ("[1", "`[` is never closed"),
            ("[1}", "`}` was never opened"),
            ("1]", "`]` was never opened"),
            ("\"A", "`\"` is never closed"),
            ("34..26", "the range 34..26 is empty"),
            ("1..", "1.. is not a range of numbers"),
            ("a..b", "a..b is not a range of numbers"),
            ("1..nan", "1..nan is not a range of numbers"),
            ("1+-0", "1+-0 is not a normal law"),
            ("1+--2", "1+--2 is not a normal law"),
            ("1+-wide", "1+-wide is not a normal law"),
            ("1+-1e308", "1+-1e308 is not a normal law"),
        ] {
            let error = choices(text).unwrap_err().to_string();
            assert_eq!(error.lines().next(), Some(mistake), "{text}");
        }
        let many = vec!["1"; CHOICES_MAX].join(",");
        assert_eq!(choices(&many).unwrap().len(), CHOICES_MAX);
        let error = choices(&format!("{many},1")).unwrap_err().to_string();
        assert!(
            error.starts_with("1001 choices are more than 1000\n"),
            "{error}"
        );
    }

    #[test]
    fn numbers_become_valid_toml() {
        for (text, toml) in [
            (".5", "0.5"),
            ("5.", "5.0"),
            ("+7", "+7"),
            ("007", "7.0"),
            ("1e3", "1000.0"),
        ] {
            assert_eq!(
                choices(text).unwrap()[0].0[0],
                number(toml, text.parse().unwrap())
            );
        }
    }
}
