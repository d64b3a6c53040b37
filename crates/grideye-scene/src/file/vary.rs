//! Reads the `[[vary]]` tables.

use super::document::VaryTable;
use super::reader::{Read, Reader};
use super::rule::SLOPE;
use crate::model::Vary;
use toml::Spanned;

pub(crate) fn vary(reader: &Reader<'_>, tables: &[Spanned<VaryTable>]) -> Read<Vec<Vary>> {
    let tables = tables.iter().map(Spanned::get_ref);
    tables.map(|table| one(reader, table)).collect()
}

fn one(reader: &Reader<'_>, table: &VaryTable) -> Read<Vary> {
    let start = table.key.span().start;
    let slope = reader.optional(&table.slope, &SLOPE)?;
    let with = match (&table.with, slope) {
        (Some(with), Some(slope)) => Some((with.get_ref().clone(), slope)),
        (None, None) => None,
        (with, _) => {
            let lacks = if with.is_some() { "slope" } else { "with" };
            let titled = format!("the [[vary]] table of `{}`", table.key.get_ref());
            return Err(reader.missing(start, &titled, lacks, SLOPE.hint));
        }
    };
    if let Some(weights) = &table.weights {
        let all = weights.get_ref();
        let is_weight = |weight: &f64| weight.is_finite() && *weight >= 0.0;
        if !all.iter().all(is_weight) || all.iter().sum::<f64>() <= 0.0 {
            let expected = "numbers from 0 on, not all 0";
            let hint = "one weight for each of the values, as in values = \"0,1,2\" and weights = [3, 2, 1]";
            let refused = reader.refused("weights", weights.span(), expected, hint);
            return Err(refused.into());
        }
    }
    Ok(Vary {
        key: table.key.get_ref().clone(),
        values: table.values.as_ref().map(|values| values.get_ref().clone()),
        weights: table
            .weights
            .as_ref()
            .map(|weights| weights.get_ref().clone())
            .unwrap_or_default(),
        with,
        place: reader.place(start),
    })
}
