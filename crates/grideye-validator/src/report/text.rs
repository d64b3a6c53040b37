//! Text of a page: lists, and values with their units.

use crate::metrics::score::Measure;
use grideye_draw::text::{escape, fixed};

pub(crate) fn list<'a>(sentences: impl Iterator<Item = &'a String>) -> String {
    let items: String = sentences
        .map(|sentence| format!("<li>{}</li>\n", escape(sentence)))
        .collect();
    format!("<ul>\n{items}</ul>\n")
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
}
