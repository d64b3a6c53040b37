//! Reads the `[[vary]]` tables.

use super::keys::WITH;
use super::reader::Read;
use crate::model::Vary;
use grideye_text::Table;

pub(crate) fn vary(table: &Table<'_>) -> Read<Vary> {
    let text = |key| table.text(key).map(str::to_owned);
    let at = table.get("key").map_or(table.start, |key| key.span().start);
    for [given, lacks] in [["with", "slope"], ["slope", "with"]] {
        if table.has(given) && !table.has(lacks) {
            return Err(table.missing_at(at, lacks, WITH).into());
        }
    }
    let weights = table.each("weights").filter_map(|weight| weight.number());
    let weights: Vec<f64> = weights.collect();
    let mut all = weights.iter();
    let are_weights = all.all(|weight| weight.is_finite() && *weight >= 0.0);
    let are_weights = are_weights && weights.iter().sum::<f64>() > 0.0;
    if let Some(given) = table.get("weights").filter(|_| !are_weights) {
        return Err(given.wrong().into());
    }
    Ok(Vary {
        key: text("key").unwrap_or_default(),
        values: text("values"),
        weights,
        with: text("with").zip(table.number("slope")),
        place: table.source.place(at),
    })
}
