//! Reads the `[[uncertain]]` tables: their laws, and the places of their numbers in the file.

use super::key::Table as Path;
use super::keys::{SD_DOC, of_number};
use super::reader::Read;
use crate::model::{Claim, Normal, OF_PEOPLE, SDS_MAX, SceneError, Uncertain, WANDER_OVER_S};
use grideye_text::Number::{self, Above, Within};
use grideye_text::{Table, Value};
use std::collections::HashSet;
use std::ops::Range;
use toml::de::{DeTable, DeValue};

const KINDS: [&str; 5] = ["room", "sensor", "object", "agent", "mosaic"];

pub(crate) fn uncertain(tables: &Table<'_>) -> Read<Vec<Uncertain>> {
    let mut known = HashSet::new();
    let mut all = Vec::new();
    for table in tables.tables("uncertain") {
        let Some(key) = table.get("key") else {
            continue;
        };
        let one = one(&table, key, tables.entries)?;
        // One number may have several paths.
        let subject = match &one.value_span {
            Some(span) => span.start.to_string(),
            None => one.key.clone(),
        };
        if !known.insert(subject) {
            let hint = "remove one of the two [[uncertain]] tables";
            return Err(key.refused_with("each key once", hint).into());
        }
        all.push(one);
    }
    Ok(all)
}

fn one(table: &Table<'_>, key: Value<'_>, document: &DeTable<'_>) -> Read<Uncertain> {
    let path = key.text().unwrap_or_default();
    let claim = Claim::of(path);
    let is_wander = matches!(claim, Some(Claim::Wander(_)));
    if let Some(over_s) = table.get("over_s").filter(|_| !is_wander) {
        let hint = "only a wander has a correlation time; remove over_s";
        let expected = "key = \"agent.NAME.wander_m\" beside it";
        return Err(over_s.refused_with(expected, hint).into());
    }
    let line = table.source.text[..key.span().start].rfind('\n');
    let has_bounds = table.has("bounds");
    let mut one = Uncertain {
        key: path.to_owned(),
        place: key.place(),
        bounds: [0.0; 2],
        law: None,
        found_sd: None,
        is_mean_the_value: table.has("sd") && !table.has("mean"),
        is_fitted: claim.is_none() || claim == Some(Claim::Start) && has_bounds,
        over_s: is_wander.then(|| table.number("over_s").unwrap_or(WANDER_OVER_S)),
        value: 0.0,
        value_span: None,
        remark_at: line.map_or(0, |line| line + 1),
    };
    match claim {
        Some(claim) if !one.is_fitted => {
            check_agent(table, key, document, claim)?;
            let law = difference(table, claim)?;
            one.bounds = [-SDS_MAX * law.sd, SDS_MAX * law.sd];
            one.law = Some(law);
        }
        Some(_) => {
            one.bounds = bounds(table, &one)?;
            one.value = 0.0_f64.clamp(one.bounds[0], one.bounds[1]);
            one.law = law(table, &one)?;
        }
        None => {
            let (value, span) = number(table, key, document)?;
            (one.value, one.value_span) = (value, Some(span));
            one.bounds = bounds(table, &one)?;
            check_value(table, key, &one)?;
            one.law = law(table, &one)?;
        }
    }
    Ok(one)
}

fn check_agent(
    table: &Table<'_>,
    key: Value<'_>,
    document: &DeTable<'_>,
    claim: Claim<'_>,
) -> Read<()> {
    let (Claim::Aside(name) | Claim::Wander(name) | Claim::Contrast(name)) = claim else {
        return Ok(());
    };
    let path = key.text().unwrap_or_default();
    match Path::root(table.source.text, document).find(path) {
        Err(error) if name != "*" => Err(unknown(key, &error.problem, &error.hint)),
        _ => Ok(()),
    }
}

/// The law of a difference from the scene, around none.
fn difference(table: &Table<'_>, claim: Claim<'_>) -> Read<Normal> {
    const UP_TO_ANY: (Number, &str, &str) = (Within(0.0, f64::MAX), "a number from 0", SD_DOC);
    let ((numbers, expected, of_sd), hint) = match claim {
        Claim::Start => (
            UP_TO_ANY,
            "give bounds for `grideye calibrate` to find it, or sd = 0.07 for a delay that stays unknown",
        ),
        Claim::Aside(_) | Claim::Wander(_) => (
            (
                Within(0.0, 0.15),
                "0 to 0.15 m",
                "a comparison that allows for more agrees with any scene; measure the place",
            ),
            "give sd = 0.07 for example, in meters; it is a difference from the scene, around 0",
        ),
        Claim::Contrast(_) => (
            (
                Within(0.0, 0.5),
                "0 to 0.5",
                "a comparison that allows for more agrees with any scene; say what the agent wears, or set its temperature_c",
            ),
            "give sd = 0.35 for example, of the logarithm; it is a difference from the scene, around 0",
        ),
        Claim::Background => (
            UP_TO_ANY,
            "give sd = 0.38 for example, in °C; it is a difference from the scene, around 0",
        ),
    };
    if let Some(other) = table.get("bounds").or_else(|| table.get("mean")) {
        return Err(other.refused_with("only sd", hint).into());
    }
    let sd = table.get("sd").ok_or_else(|| missing(table, "sd", hint))?;
    let sd = sd.number_of(numbers, expected, of_sd)?;
    Ok(Normal { mean: 0.0, sd })
}

/// The standard deviation of a number's law.
fn sd(table: &Table<'_>) -> Read<Option<f64>> {
    let sd = table.get("sd");
    let sd = sd.map(|sd| sd.number_of(Above(0.0, f64::MAX), "a number above 0", SD_DOC));
    Ok(sd.transpose()?)
}

/// The bounds given, or those of the normal law, as far as the number may go.
fn bounds(table: &Table<'_>, one: &Uncertain) -> Read<[f64; 2]> {
    if let Some(bounds) = table.list("bounds") {
        return Ok(bounds);
    }
    let hint = "give bounds = [lowest, highest], or sd for a normal law around mean or the value in the file";
    let sd = sd(table)?.ok_or_else(|| missing(table, "bounds", hint))?;
    let mean = table.number("mean").unwrap_or(one.value);
    let numbers = of_number(&one.key);
    Ok([-SDS_MAX, SDS_MAX].map(|sds| cut(mean, mean + sds * sd, numbers)))
}

/// The number nearest to `bound` that the key allows, from a mean that it allows.
fn cut(mean: f64, bound: f64, numbers: Option<Number>) -> f64 {
    let Some(numbers) = numbers.filter(|all| all.holds(mean) && !all.holds(bound)) else {
        return bound;
    };
    let (mut held, mut beyond) = (mean, bound);
    // Halving ends at two neighboring numbers.
    for _ in 0..100 {
        let middle = 0.5 * (held + beyond);
        if numbers.holds(middle) {
            held = middle;
        } else {
            beyond = middle;
        }
    }
    held
}

fn check_value(table: &Table<'_>, key: Value<'_>, one: &Uncertain) -> Read<()> {
    let ([low, high], value) = (one.bounds, one.value);
    if (low..=high).contains(&value) {
        return Ok(());
    }
    let hint = "a search starts from the number in the scene; change it or widen the law";
    let of = format!("the scene's value of `{}`", one.key);
    Err(match (table.get("bounds"), table.get("mean")) {
        (None, Some(mean)) => {
            mean.refused_with(&format!("within {SDS_MAX} sd of {value}, {of}"), hint)
        }
        (given, _) => {
            let span = given.unwrap_or(key).span();
            let expected = format!("bounds around {value}, {of}");
            table.source.refused("bounds", span, &expected, hint)
        }
    }
    .into())
}

/// The normal law that the table gives around its mean or else the value, or that of people.
fn law(table: &Table<'_>, one: &Uncertain) -> Read<Option<Normal>> {
    let [low, high] = one.bounds;
    let is_within = |mean: f64| (low..=high).contains(&mean);
    let given = table.get("mean");
    let Some(sd) = sd(table)? else {
        if let Some(mean) = given {
            return Err(mean.refused("sd beside it").into());
        }
        let of_people = OF_PEOPLE.iter().find(|(end, _)| one.key.ends_with(end));
        let law = of_people.map(|(_, law)| *law);
        return Ok(law.filter(|law| is_within(law.mean)));
    };
    let mean = table.number("mean").unwrap_or(one.value);
    if let Some(given) = given.filter(|_| !is_within(mean)) {
        let expected = format!("{low} to {high}, the bounds");
        let hint = "the law is cut at the bounds; widen them or change the mean";
        return Err(given.refused_with(&expected, hint).into());
    }
    Ok(Some(Normal { mean, sd }))
}

/// The number that the key names, and its place.
fn number(table: &Table<'_>, key: Value<'_>, document: &DeTable<'_>) -> Read<(f64, Range<usize>)> {
    let path = key.text().unwrap_or_default();
    let is_of_table = path
        .split_once('.')
        .is_some_and(|(kind, _)| KINDS.contains(&kind));
    let value = match Path::root(table.source.text, document).find(path) {
        _ if !is_of_table => None,
        Ok((_, _, value)) => value,
        Err(error) => return Err(unknown(key, &error.problem, &error.hint)),
    };
    let number = value.and_then(|value| match value.get_ref() {
        DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str().parse().ok(),
        DeValue::Float(float) => float.as_str().parse().ok(),
        _ => None,
    });
    if let (Some(number), Some(value)) = (number, value) {
        return Ok((number, value.span()));
    }
    Err(key.wrong().into())
}

fn unknown(key: Value<'_>, problem: &str, hint: &str) -> SceneError {
    let problem = format!(
        "`key` is \"{}\", but {problem}",
        key.text().unwrap_or_default()
    );
    key.place().refused(problem, hint).into()
}

fn missing(table: &Table<'_>, key: &str, hint: &str) -> SceneError {
    let byte = table.get("key").map_or(table.start, |key| key.span().start);
    table.missing_at(byte, key, hint).into()
}
