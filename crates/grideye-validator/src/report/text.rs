//! Text of a page: escapes, lists, and values with their units.

use crate::metrics::score::Measure;
use crate::numerals::fixed;

pub(crate) fn list<'a>(sentences: impl Iterator<Item = &'a String>) -> String {
    let items: String = sentences
        .map(|sentence| format!("<li>{}</li>\n", escape(sentence)))
        .collect();
    format!("<ul>\n{items}</ul>\n")
}

/// Text made safe to stand in an element or in a quoted attribute.
pub(crate) fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            _ => safe.push(character),
        }
    }
    safe
}

/// What stands where a measure is not defined.
pub(crate) const UNDEFINED: &str = "–";

/// A value of a measure in the measure's unit, the unit left to the row's title except for shares.
pub(crate) fn value(measure: Measure, value: Option<f64>) -> String {
    match value {
        None => UNDEFINED.to_owned(),
        Some(share) if measure.unit() == "%" => format!("{} %", fixed(100.0 * share, 1)),
        Some(value) => fixed(value, 2),
    }
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
    fn nothing_of_markup_survives() {
        assert_eq!(
            escape(r#"<b a="x">&'"#),
            "&lt;b a=&quot;x&quot;&gt;&amp;&#39;"
        );
    }
}
