//! Reads the `[[uncertain]]` tables: their laws, and the places of their numbers in the file.

use super::document::UncertainTable;
use super::key::Table;
use super::reader::{Read, Reader};
use super::rule::{OVER, SD, SD_OF_CONTRAST, SD_OF_DIFFERENCE, SD_OF_PLACE, of_number};
use crate::model::{Claim, Normal, OF_PEOPLE, SDS_MAX, SceneError, Uncertain, WANDER_OVER_S};
use crate::text::Rule;
use std::collections::HashSet;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

const KINDS: [&str; 5] = ["room", "sensor", "object", "agent", "mosaic"];

pub(crate) fn uncertain(
    reader: &Reader<'_>,
    tables: &[Spanned<UncertainTable>],
) -> Read<Vec<Uncertain>> {
    if tables.is_empty() {
        return Ok(Vec::new());
    }
    let document = reader.document()?;
    let mut known = HashSet::new();
    let mut all = Vec::with_capacity(tables.len());
    for table in tables.iter().map(Spanned::get_ref) {
        let one = one(reader, table, &document)?;
        // One number may have several paths.
        let subject = match &one.value_span {
            Some(span) => span.start.to_string(),
            None => one.key.clone(),
        };
        if !known.insert(subject) {
            let hint = "remove one of the two [[uncertain]] tables";
            let key = table.key.span();
            return Err(reader.refused("key", key, "each key once", hint).into());
        }
        all.push(one);
    }
    Ok(all)
}

fn one(
    reader: &Reader<'_>,
    table: &UncertainTable,
    document: &Spanned<DeTable<'_>>,
) -> Read<Uncertain> {
    let key = table.key.get_ref();
    let claim = Claim::of(key);
    let is_wander = matches!(claim, Some(Claim::Wander(_)));
    if let (false, Some(over_s)) = (is_wander, &table.over_s) {
        let hint = "only a wander has a correlation time; remove over_s";
        let expected = "key = \"agent.NAME.wander_m\" beside it";
        return Err(reader
            .refused("over_s", over_s.span(), expected, hint)
            .into());
    }
    let over_s = reader.number_or(&table.over_s, &OVER, WANDER_OVER_S)?;
    let start = table.key.span().start;
    let line = reader.text[..start].rfind('\n');
    let mut one = Uncertain {
        key: key.clone(),
        place: reader.place(start),
        bounds: [0.0; 2],
        law: None,
        found_sd: None,
        is_mean_the_value: table.sd.is_some() && table.mean.is_none(),
        is_fitted: claim.is_none() || claim == Some(Claim::Start) && table.bounds.is_some(),
        over_s: is_wander.then_some(over_s),
        value: 0.0,
        value_span: None,
        remark_at: line.map_or(0, |line| line + 1),
    };
    match claim {
        Some(claim) if !one.is_fitted => {
            check_agent(reader, table, document, claim)?;
            let law = difference(reader, table, claim)?;
            one.bounds = [-SDS_MAX * law.sd, SDS_MAX * law.sd];
            one.law = Some(law);
        }
        Some(_) => {
            one.bounds = bounds(reader, table, 0.0)?;
            one.value = 0.0_f64.clamp(one.bounds[0], one.bounds[1]);
            one.law = law(reader, table, &one)?;
        }
        None => {
            let (value, span) = number(reader, table, document)?;
            (one.value, one.value_span) = (value, Some(span));
            one.bounds = bounds(reader, table, value)?;
            check_value(reader, table, &one)?;
            one.law = law(reader, table, &one)?;
        }
    }
    Ok(one)
}

fn check_agent(
    reader: &Reader<'_>,
    table: &UncertainTable,
    document: &Spanned<DeTable<'_>>,
    claim: Claim<'_>,
) -> Read<()> {
    let (Claim::Aside(name) | Claim::Wander(name) | Claim::Contrast(name)) = claim else {
        return Ok(());
    };
    if name == "*" {
        return Ok(());
    }
    let found = Table::root(reader.text, document).find(table.key.get_ref());
    match found {
        Err(error) => Err(unknown(reader, table, &error.problem, &error.hint)),
        Ok(_) => Ok(()),
    }
}

/// The law of a difference from the scene, around none.
fn difference(reader: &Reader<'_>, table: &UncertainTable, claim: Claim<'_>) -> Read<Normal> {
    let (rule, hint) = match claim {
        Claim::Start => (
            &SD_OF_DIFFERENCE,
            "give bounds for `grideye calibrate` to find it, or sd = 0.07 for a delay that stays unknown",
        ),
        Claim::Aside(_) | Claim::Wander(_) => (
            &SD_OF_PLACE,
            "give sd = 0.07 for example, in meters; it is a difference from the scene, around 0",
        ),
        Claim::Contrast(_) => (
            &SD_OF_CONTRAST,
            "give sd = 0.35 for example, of the logarithm; it is a difference from the scene, around 0",
        ),
        Claim::Background => (
            &SD_OF_DIFFERENCE,
            "give sd = 0.38 for example, in °C; it is a difference from the scene, around 0",
        ),
    };
    if let Some(bounds) = &table.bounds {
        let span = bounds.span();
        return Err(reader.refused("bounds", span, "only sd", hint).into());
    }
    if let Some(mean) = &table.mean {
        let span = mean.span();
        return Err(reader.refused("mean", span, "only sd", hint).into());
    }
    let Some(sd) = reader.optional(&table.sd, rule)? else {
        return Err(missing(reader, table, "sd", hint));
    };
    Ok(Normal { mean: 0.0, sd })
}

/// The bounds given, or those of the normal law, as far as the number may go.
fn bounds(reader: &Reader<'_>, table: &UncertainTable, value: f64) -> Read<[f64; 2]> {
    let Some(bounds) = &table.bounds else {
        let Some(sd) = reader.optional(&table.sd, &SD)? else {
            let hint = "give bounds = [lowest, highest], or sd for a normal law around mean or the value in the file";
            return Err(missing(reader, table, "bounds", hint));
        };
        let mean = table.mean.as_ref().map_or(value, |mean| *mean.get_ref());
        let rule = of_number(table.key.get_ref());
        return Ok([-SDS_MAX, SDS_MAX].map(|sds| cut(mean, mean + sds * sd, rule)));
    };
    let [low, high] = bounds.get_ref().0;
    if low < high && low.is_finite() && high.is_finite() {
        return Ok([low, high]);
    }
    let expected = "[lowest, highest], the first below the second";
    let hint = "both bounds are included";
    Err(reader
        .refused("bounds", bounds.span(), expected, hint)
        .into())
}

/// The number nearest to `bound` that the rule allows, from a mean that it allows.
fn cut(mean: f64, bound: f64, rule: Option<&Rule>) -> f64 {
    let Some(rule) = rule.filter(|rule| (rule.holds)(mean) && !(rule.holds)(bound)) else {
        return bound;
    };
    let (mut held, mut beyond) = (mean, bound);
    // Halving ends at two neighboring numbers.
    for _ in 0..100 {
        let middle = 0.5 * (held + beyond);
        if (rule.holds)(middle) {
            held = middle;
        } else {
            beyond = middle;
        }
    }
    held
}

fn check_value(reader: &Reader<'_>, table: &UncertainTable, one: &Uncertain) -> Read<()> {
    let ([low, high], value, key) = (one.bounds, one.value, &one.key);
    if (low..=high).contains(&value) {
        return Ok(());
    }
    let hint = "a search starts from the number in the scene; change it or widen the law";
    let mean = table.mean.as_ref().map(Spanned::span);
    let (name, span, expected) = match (&table.bounds, mean) {
        (None, Some(mean)) => ("mean", mean, format!("within {SDS_MAX} sd of {value}")),
        (given, _) => {
            let span = given.as_ref().map_or(table.key.span(), Spanned::span);
            ("bounds", span, format!("bounds around {value}"))
        }
    };
    let expected = format!("{expected}, the scene's value of `{key}`");
    Err(reader.refused(name, span, &expected, hint).into())
}

/// The normal law that the table gives around its mean or else the value, or that of people.
fn law(reader: &Reader<'_>, table: &UncertainTable, one: &Uncertain) -> Read<Option<Normal>> {
    let [low, high] = one.bounds;
    let is_within = |mean: f64| (low..=high).contains(&mean);
    let Some(sd) = reader.optional(&table.sd, &SD)? else {
        if let Some(mean) = &table.mean {
            let hint = "mean is the middle of a normal law; without a law every value between the bounds is alike";
            return Err(reader
                .refused("mean", mean.span(), "sd beside it", hint)
                .into());
        }
        let of_people = OF_PEOPLE.iter().find(|(end, _)| one.key.ends_with(end));
        let law = of_people.map(|(_, law)| *law);
        return Ok(law.filter(|law| is_within(law.mean)));
    };
    let mean = table
        .mean
        .as_ref()
        .map_or(one.value, |mean| *mean.get_ref());
    if let (false, Some(given)) = (is_within(mean), &table.mean) {
        let expected = format!("{low} to {high}, the bounds");
        let hint = "the law is cut at the bounds; widen them or change the mean";
        return Err(reader.refused("mean", given.span(), &expected, hint).into());
    }
    Ok(Some(Normal { mean, sd }))
}

/// The number that the key names, and its place.
fn number(
    reader: &Reader<'_>,
    table: &UncertainTable,
    document: &Spanned<DeTable<'_>>,
) -> Read<(f64, Range<usize>)> {
    let key = table.key.get_ref();
    let is_of_table = key
        .split_once('.')
        .is_some_and(|(kind, _)| KINDS.contains(&kind));
    let value = match Table::root(reader.text, document).find(key) {
        _ if !is_of_table => None,
        Ok((_, _, value)) => value,
        Err(error) => return Err(unknown(reader, table, &error.problem, &error.hint)),
    };
    let number = value.and_then(|value| match value.get_ref() {
        DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str().parse().ok(),
        DeValue::Float(float) => float.as_str().parse().ok(),
        _ => None,
    });
    if let (Some(number), Some(value)) = (number, value) {
        return Ok((number, value.span()));
    }
    let expected = "the path of a number in this file, or recording.start_s, room.background_c, agent.NAME.aside_m, .wander_m or .contrast";
    let hint = "room.ambient_c, sensor.NAME.elevation_deg, sensor.NAME.position_mm.x, object.NAME.temperature_c, \
         agent.NAME.temperature_c, agent.NAME.PART.emissivity, agent.NAME.person.height_mm; a default must be written out first: the search starts from it";
    Err(reader
        .refused("key", table.key.span(), expected, hint)
        .into())
}

fn unknown(reader: &Reader<'_>, table: &UncertainTable, problem: &str, hint: &str) -> SceneError {
    let (key, start) = (table.key.get_ref(), table.key.span().start);
    let problem = format!("`key` is \"{key}\", but {problem}");
    reader.place(start).refused(problem, hint).into()
}

fn missing(reader: &Reader<'_>, table: &UncertainTable, key: &str, hint: &str) -> SceneError {
    let titled = format!("the [[uncertain]] table of `{}`", table.key.get_ref());
    reader.missing(table.key.span().start, &titled, key, hint)
}
