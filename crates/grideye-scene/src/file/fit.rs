//! Reads the `[[fit]]` tables: the unknowns of a scene and the places of their numbers in the file.

use super::document::FitTable;
use super::key::Table;
use super::reader::{Read, Reader};
use crate::model::{Fit, Normal, OF_PEOPLE, RECORDING_START};
use std::collections::HashSet;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

pub(crate) fn fits(reader: &Reader<'_>, tables: &[Spanned<FitTable>]) -> Read<Vec<Fit>> {
    if tables.is_empty() {
        return Ok(Vec::new());
    }
    let document = reader.document()?;
    let mut known = HashSet::new();
    let fits = tables.iter().map(Spanned::get_ref).map(|table| {
        if known.insert(table.key.get_ref()) {
            return fit(reader, table, &document);
        }
        let hint = "remove one of the two [[fit]] tables";
        Err(reader
            .refused("key", table.key.span(), "each unknown once", hint)
            .into())
    });
    fits.collect()
}

fn fit(reader: &Reader<'_>, table: &FitTable, document: &Spanned<DeTable<'_>>) -> Read<Fit> {
    let key = table.key.get_ref();
    let bounds = table.bounds.get_ref().0;
    let refused = |expected: &str, hint: &str| {
        let refusal = reader.refused("bounds", table.bounds.span(), expected, hint);
        Err(refusal.into())
    };
    if !(bounds[0] < bounds[1] && bounds.iter().all(|bound| bound.is_finite())) {
        let hint = "the search includes both bounds";
        return refused("[lowest, highest], the first below the second", hint);
    }
    let (value, value_span) = if key == RECORDING_START {
        (0.0_f64.clamp(bounds[0], bounds[1]), None)
    } else if let Some((value, span)) = number(reader.text, document, key) {
        (value, Some(span))
    } else {
        let expected = "the path of a number in this file, or recording.start_s";
        let hint = "room.ambient_c, sensor.NAME.elevation_deg, sensor.NAME.position_mm.x, object.NAME.temperature_c, \
             agent.NAME.temperature_c, agent.NAME.PART.emissivity, agent.NAME.person.height_mm; a default must be written out first: the search starts from it";
        return Err(reader
            .refused("key", table.key.span(), expected, hint)
            .into());
    };
    if !(bounds[0]..=bounds[1]).contains(&value) {
        let expected = format!("bounds around {value}, the scene's value of `{key}`");
        let hint = "the search starts from the number in the scene; change it or widen the bounds";
        return refused(&expected, hint);
    }
    let law = law(reader, table, value)?;
    let start = table.key.span().start;
    let line = reader.text[..start].rfind('\n');
    Ok(Fit {
        key: key.clone(),
        place: reader.place(start),
        bounds,
        law,
        is_mean_the_value: table.sd.is_some() && table.mean.is_none(),
        value,
        value_span,
        remark_at: line.map_or(0, |line| line + 1),
    })
}

/// The normal law that the table gives around its mean or else the value, or that of people.
fn law(reader: &Reader<'_>, table: &FitTable, value: f64) -> Read<Option<Normal>> {
    let [low, high] = table.bounds.get_ref().0;
    let is_within = |mean: f64| (low..=high).contains(&mean);
    let Some(sd) = &table.sd else {
        if let Some(mean) = &table.mean {
            let hint = "mean is the middle of a normal law; without a law every value between the bounds is alike";
            return Err(reader
                .refused("mean", mean.span(), "sd beside it", hint)
                .into());
        }
        let key = table.key.get_ref();
        let of_people = OF_PEOPLE.iter().find(|(end, _)| key.ends_with(end));
        let law = of_people.map(|(_, law)| *law);
        return Ok(law.filter(|law| is_within(law.mean)));
    };
    if !(sd.get_ref().is_finite() && *sd.get_ref() > 0.0) {
        let hint = "how well you know the value: its standard deviation, in the key's unit";
        return Err(reader
            .refused("sd", sd.span(), "a number above 0", hint)
            .into());
    }
    let mean = table.mean.as_ref().map_or(value, |mean| *mean.get_ref());
    if let (false, Some(given)) = (is_within(mean), &table.mean) {
        let expected = format!("{low} to {high}, the bounds");
        let hint = "the law is cut at the bounds; widen them or change the mean";
        return Err(reader.refused("mean", given.span(), &expected, hint).into());
    }
    Ok(Some(Normal {
        mean,
        sd: *sd.get_ref(),
    }))
}

/// The number at a path and its place; the path may end in an axis, and may omit `part` before a part's name.
fn number(text: &str, document: &Spanned<DeTable<'_>>, path: &str) -> Option<(f64, Range<usize>)> {
    let (front, last) = path.rsplit_once('.')?;
    let axis = match last {
        "x" | "across" => Some(0),
        "y" | "down" => Some(1),
        "z" => Some(2),
        _ => None,
    };
    let path = if axis.is_some() { front } else { path };
    let (kind, behind) = path.split_once('.')?;
    if !["room", "sensor", "object", "agent", "mosaic"].contains(&kind) {
        return None;
    }
    let root = || Table::root(text, document);
    let (_, tables) = root().entry(kind)?;
    let (table, rest) = root().below(kind, tables, behind).ok()?;
    let part = table
        .entry("part")
        .and_then(|(_, parts)| table.below("part", parts, rest).ok());
    let in_part = part.and_then(|(part, key)| part.find(key).ok()?.2);
    let value = table
        .find(rest)
        .ok()
        .and_then(|found| found.2)
        .or(in_part)?;
    let value = match axis {
        None => value,
        Some(axis) => value.get_ref().as_array()?.get(axis)?,
    };
    let number = match value.get_ref() {
        DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str(),
        DeValue::Float(float) => float.as_str(),
        _ => return None,
    };
    Some((number.parse().ok()?, value.span()))
}
