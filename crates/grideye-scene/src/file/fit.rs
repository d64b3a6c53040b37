//! Reads the `[[fit]]` tables: the unknowns of a scene and where their numbers stand in the file.

use super::document::FitTable;
use super::source::Source;
use crate::model::error::SceneError;
use crate::model::fit::{Fit, RECORDING_START};
use std::collections::HashSet;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

pub(crate) fn fits(
    source: &Source<'_>,
    tables: &[Spanned<FitTable>],
) -> Result<Vec<Fit>, SceneError> {
    if tables.is_empty() {
        return Ok(Vec::new());
    }
    let document = source.document()?;
    let mut known = HashSet::new();
    tables
        .iter()
        .map(|table| {
            let table = table.get_ref();
            if known.insert(table.key.get_ref()) {
                fit(source, table, document.get_ref())
            } else {
                Err(source.refused(
                    "key",
                    table.key.span(),
                    "each unknown once",
                    "remove one of the two [[fit]] tables",
                ))
            }
        })
        .collect()
}

fn fit(source: &Source<'_>, table: &FitTable, document: &DeTable<'_>) -> Result<Fit, SceneError> {
    let key = table.key.get_ref();
    let bounds = table.bounds.get_ref().0;
    if !(bounds[0] < bounds[1] && bounds.iter().all(|bound| bound.is_finite())) {
        return Err(source.refused(
            "bounds",
            table.bounds.span(),
            "[least, greatest], the first below the second",
            "the value is looked for between the two, both allowed",
        ));
    }
    let (value, value_span) = if key == RECORDING_START {
        (0.0_f64.clamp(bounds[0], bounds[1]), None)
    } else {
        let (value, span) = number(document, key).ok_or_else(|| unknown(source, table))?;
        (value, Some(span))
    };
    if !(bounds[0]..=bounds[1]).contains(&value) {
        return Err(source.refused(
            "bounds",
            table.bounds.span(),
            &format!("bounds around {value}, which is what the scene has for `{key}`"),
            "the search starts from the number in the scene; change it or widen the bounds",
        ));
    }
    let start = table.key.span().start;
    let remark_at = source.text[..start].rfind('\n').map_or(0, |line| line + 1);
    Ok(Fit {
        key: key.clone(),
        place: source.place(start),
        bounds,
        value,
        value_span,
        remark_at,
    })
}

fn unknown(source: &Source<'_>, table: &FitTable) -> SceneError {
    source.refused(
        "key",
        table.key.span(),
        "the path of a number that stands in this file, or recording.start_s",
        "room.ambient_c, sensor.NAME.elevation_deg, sensor.NAME.position_mm.x, object.NAME.temperature_c, \
         agent.NAME.temperature_c, agent.NAME.PART.emissivity; a default must be written out first: the search starts from it",
    )
}

/// The number at a path and its place.
fn number(document: &DeTable<'_>, path: &str) -> Option<(f64, Range<usize>)> {
    let (kind, rest) = path.split_once('.')?;
    if kind == "room" {
        return in_table(document.get(kind)?.get_ref().as_table()?, rest);
    }
    let parts = |table: &DeTable<'_>, rest: &str| {
        named(table.get("part")?.get_ref(), rest, &|part, rest| {
            in_table(part, rest)
        })
    };
    match kind {
        "sensor" | "object" | "agent" | "mosaic" => {
            named(document.get(kind)?.get_ref(), rest, &|table, rest| {
                in_table(table, rest).or_else(|| parts(table, rest))
            })
        }
        _ => None,
    }
}

type Found = Option<(f64, Range<usize>)>;

/// In the table of a list whose name begins the path; names may have dots of their own.
fn named(list: &DeValue<'_>, path: &str, look: &dyn Fn(&DeTable<'_>, &str) -> Found) -> Found {
    list.as_array()?.iter().find_map(|table| {
        let table = table.get_ref().as_table()?;
        let name = table.get("name")?.get_ref().as_str()?;
        look(table, path.strip_prefix(name)?.strip_prefix('.')?)
    })
}

/// A number of a table, or one of a list of them.
fn in_table(table: &DeTable<'_>, path: &str) -> Found {
    if let Some((key, component)) = path.split_once('.') {
        let index = match component {
            "x" | "across" => 0,
            "y" | "down" => 1,
            "z" => 2,
            _ => return None,
        };
        return as_number(table.get(key)?.get_ref().as_array()?.get(index)?);
    }
    as_number(table.get(path)?)
}

fn as_number(value: &Spanned<DeValue<'_>>) -> Found {
    let text = match value.get_ref() {
        DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str(),
        DeValue::Float(float) => float.as_str(),
        _ => return None,
    };
    Some((text.parse().ok()?, value.span()))
}
