//! The context of a report; lists, tables, and values with their units.

use crate::metrics::score::Measure;
use crate::thresholds::ThresholdLine;
use grideye_draw::text::{escape, fixed};
use serde::Serialize;

pub(crate) fn list<'a>(sentences: impl Iterator<Item = &'a String>) -> String {
    let items: String = sentences
        .map(|sentence| format!("<li>{}</li>\n", marked(sentence)))
        .collect();
    format!("<ul>\n{items}</ul>\n")
}

pub(crate) const UNDEFINED: &str = "–";

/// A value in its measure's unit; only shares print the unit.
pub(crate) fn value(measure: Measure, value: Option<f64>) -> String {
    match value {
        None => UNDEFINED.to_owned(),
        Some(share) if measure.unit() == "%" => format!("{} %", fixed(100.0 * share, 1)),
        Some(value) => fixed(value, 2),
    }
}

/// The inputs of a comparison and how to reproduce it.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Context {
    pub scene: String,
    pub recording: String,
    pub sensor: String,
    /// The command that reproduces this report.
    pub command: String,
    /// Program and version, for example `grideye 0.1.0`.
    pub program: String,
    /// Date as text; omitted if empty, so that equal input gives equal bytes.
    pub created: String,
    /// Seeds by purpose.
    pub seeds: Vec<(String, u64)>,
    pub inputs: Vec<Input>,
    /// Assumptions as sentences; the comparison's own are added.
    pub assumptions: Vec<String>,
    /// The paper's experiment, 1 to 4; without it, the range of all four is printed.
    #[serde(skip)]
    pub experiment: Option<u8>,
    #[serde(skip)]
    pub thresholds: Vec<ThresholdLine>,
    /// The room as an SVG, at the [`key_colors`](super::key_colors) of the comparison; without it, none is shown.
    #[serde(skip)]
    pub room: String,
}

/// A file that went into the comparison.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Input {
    /// The file's name.
    pub name: String,
    /// A hash of its bytes, for example `sha256:…`.
    pub hash: String,
}

/// Escaped, with what stands between backticks as code.
pub(crate) fn marked(text: &str) -> String {
    let mut pieces = text.split('`').map(escape);
    let mut page = pieces.next().unwrap_or_default();
    while let Some(code) = pieces.next() {
        page += &match pieces.next() {
            Some(after) => format!("<code>{code}</code>{after}"),
            None => format!("`{code}"),
        };
    }
    page
}

pub(crate) fn with_error(number: String, error: Option<f64>, decimals: usize) -> String {
    let error = error.map(|error| format!(" ± {}", fixed(error, decimals)));
    number + &error.unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_read_well() {
        assert_eq!(value(Measure::ImageSimilarity, Some(0.9531)), "95.3 %");
        assert_eq!(value(Measure::Correlation, None), "–");
    }

    #[test]
    fn backticks_mark_code() {
        assert_eq!(marked("`a<b` & `c"), "<code>a&lt;b</code> &amp; `c");
    }
}
