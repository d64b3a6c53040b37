//! What a console or a logger writes before each line.

use super::split::{Separator, number};
use std::collections::BTreeMap;

/// Shapes that are told apart.
const SHAPES_MAX: usize = 32;

/// The beginnings of lines that are no part of what was printed, by their shapes.
#[derive(Debug, Default)]
pub(super) struct Leads {
    shapes: Vec<String>,
}

impl Leads {
    /// Of lines that end in at least `count` numbers.
    pub(super) fn of<'l>(lines: impl Iterator<Item = &'l str>, count: usize) -> Self {
        let mut counts = BTreeMap::<String, usize>::new();
        for line in lines {
            if let Some(at) = numbers_at_end(line, count).filter(|at| *at > 0) {
                *counts.entry(shape(&line[..at])).or_default() += 1;
            }
        }
        let mut shapes: Vec<(usize, String)> = counts
            .into_iter()
            .map(|(shape, count)| (count, shape))
            .collect();
        shapes.sort_unstable_by(|one, other| other.cmp(one));
        shapes.truncate(SHAPES_MAX);
        Self {
            shapes: shapes.into_iter().map(|(_, shape)| shape).collect(),
        }
    }

    /// Whether a line ends in at least `count` numbers.
    pub(super) fn ends_in(line: &str, count: usize) -> bool {
        numbers_at_end(line, count).is_some()
    }

    /// Leads that the separator ends are columns of their own; so are words between blanks.
    pub(super) fn keep_unless_separated(&mut self, separator: Separator) {
        self.shapes.retain(|shape| match separator {
            Separator::Blank => {
                shape.contains(['[', ']', '(', ')', '<', '>', '|'])
                    || shape.contains(" - ")
                    || shape.contains('/')
                    || shape.ends_with([':', ',', '=', ';'])
            }
            other => !shape.ends_with(other.character()),
        });
    }

    /// A line's lead, which may be nothing, and the rest.
    pub(super) fn split<'l>(&self, line: &'l str, count: usize) -> (&'l str, &'l str) {
        if self.shapes.is_empty() {
            return ("", line);
        }
        if let Some(at) = numbers_at_end(line, count) {
            return line.split_at(at);
        }
        let length = self.shapes.iter().find_map(|known| matching(line, known));
        line.split_at(length.unwrap_or(0))
    }
}

/// Where the numbers begin with which a line ends, if they are at least `count`.
fn numbers_at_end(line: &str, count: usize) -> Option<usize> {
    let between = |letter: char| letter.is_whitespace() || ",;[](){}|*\"'".contains(letter);
    let (mut found, mut from, mut end) = (0, line.len(), line.len());
    loop {
        let trimmed = line[..end].trim_end_matches(between);
        let start = trimmed.rfind(between).map_or(0, |at| {
            at + trimmed[at..].chars().next().map_or(1, char::len_utf8)
        });
        let token = &trimmed[start..];
        let is_unit = ["°C", "C", "ºC", "°F", "F"].contains(&token);
        let is_value = number(token).is_some() || ["nan", "NaN", "None", "null"].contains(&token);
        if token.is_empty() || !(is_value || is_unit) {
            // As of `L:19.75`.
            let glued = token.rsplit_once([':', '=']).filter(|(name, value)| {
                name.contains(char::is_alphabetic) && number(value).is_some()
            });
            if let Some((name, _)) = glued {
                found += 1;
                from = start + name.len() + 1;
            }
            break;
        }
        if is_value {
            found += 1;
            from = start;
        }
        end = start;
    }
    // A bracket that is opened belongs to the list.
    let lead = line[..from].trim_end_matches(['[', '(', '{', '"', '\'']);
    (found >= count).then_some(lead.len())
}

/// A text in which all numbers are alike.
fn shape(text: &str) -> String {
    let mut shape = String::new();
    for character in text.trim_end().chars() {
        match character.is_ascii_digit() {
            true if shape.ends_with('0') => {}
            true => shape.push('0'),
            false => shape.push(character),
        }
    }
    shape
}

/// The length of a line's beginning of this shape.
fn matching(line: &str, shape: &str) -> Option<usize> {
    let mut rest = line;
    for character in shape.chars() {
        rest = match character {
            '0' => {
                let end = rest
                    .find(|letter: char| !letter.is_ascii_digit())
                    .unwrap_or(rest.len());
                (end > 0).then(|| &rest[end..])?
            }
            other => rest.strip_prefix(other)?,
        };
    }
    Some(line.len() - rest.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lead_ends_where_the_numbers_begin() {
        for (lead, rest) in [
            ("16:00:00.000 -> ", "19.75,19.75 "),
            ("[16:00:00.000][D][grid:042]: ", "19.75, 19.75"),
            ("2025-11-24 16:00:00,000 - grid - INFO - ", "[19.75, 20.0]"),
            ("hall/thermal ", "19.75 20.0 °C"),
            ("L:", "19.75C 20.0C"),
            ("", "19.75 20.0"),
        ] {
            let line = format!("{lead}{rest}");
            assert_eq!(numbers_at_end(&line, 2), Some(lead.len()), "{line}");
        }
        assert_eq!(numbers_at_end("a 1 b 2", 2), None);
        let leads = Leads::of(["16:00:00.000 -> 1 2"].into_iter(), 2);
        assert_eq!(leads.split("16:01:12.500 -> ", 2), ("16:01:12.500 ->", " "));
        assert_eq!(leads.split("hello", 2), ("", "hello"));
    }
}
