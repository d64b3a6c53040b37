//! Gives the requested sensors their places.

use crate::place::{Place, Placed, Planned};
use amg8833_emulator::Address;

/// The bus of a sensor without a place: a Raspberry Pi's.
const BUS: u32 = 1;

/// Gives every requested sensor its place; a single one stands at bus and address of `alone`. `known` are the names that
/// exist; `None` allows any.
///
/// # Errors
/// What is missing, contradicts or is unknown, with a hint.
pub fn planned(
    asked: &[Placed],
    alone: (Option<u32>, Option<Address>),
    known: Option<&[String]>,
) -> Result<Vec<Planned>, String> {
    let place = Place {
        bus: alone.0.unwrap_or(BUS),
        branch: None,
        address: alone.1.unwrap_or(Address::High),
    };
    let is_placed = alone != (None, None);
    let one = |name| vec![Planned { name, place }];
    let planned = match asked {
        [] => one(only(known)?),
        [Placed { name, place: None }] => one(name.clone()),
        [first, ..] if is_placed => {
            return Err(format!(
                "--address and --device place one sensor, and --sensor places it as well\nhint: write the whole place with the sensor, such as --sensor {}=1:0x69",
                first.name
            ));
        }
        several => several.iter().map(placed).collect::<Result<_, String>>()?,
    };
    let is_unknown = |sensor: &&Planned| known.is_some_and(|known| !known.contains(&sensor.name));
    if let Some(Planned { name, .. }) = planned.iter().find(is_unknown) {
        let known = known.unwrap_or_default().join(", ");
        return Err(format!(
            "there is no sensor {name:?}\nhint: choose one of: {known}"
        ));
    }
    Ok(planned)
}

fn only(known: Option<&[String]>) -> Result<String, String> {
    match known {
        None => Ok("sensor".to_owned()),
        Some([only]) => Ok(only.clone()),
        Some(names) => Err(format!(
            "there are {} sensors\nhint: choose one with --sensor NAME, or give each its place with --sensor NAME=BUS:ADDRESS: {}",
            names.len(),
            names.join(", ")
        )),
    }
}

fn placed(sensor: &Placed) -> Result<Planned, String> {
    let name = &sensor.name;
    let place = sensor.place.ok_or_else(|| {
        format!(
            "the sensor {name} has no place, and there are several\nhint: --sensor {name}=1:0x68, or another BUS:ADDRESS"
        )
    })?;
    let name = name.clone();
    Ok(Planned { name, place })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The plan for these sensors; `known` are the names, with commas.
    fn plan(asked: &str, alone: Option<Address>, known: Option<&str>) -> Result<String, String> {
        let asked: Vec<Placed> = asked
            .split_whitespace()
            .map(|one| one.parse().unwrap())
            .collect();
        let known: Option<Vec<String>> =
            known.map(|names| names.split(',').map(str::to_owned).collect());
        let planned = planned(&asked, (None, alone), known.as_deref())?;
        let line = |sensor: &Planned| format!("{}={}", sensor.name, sensor.place);
        Ok(planned.iter().map(line).collect::<Vec<_>>().join(" "))
    }

    #[test]
    fn one_sensor_needs_no_place_and_several_go_where_they_are_put() {
        let several = "a=1:0x68 b=1:0x69 a=3:0x70.0:0x69 b=3:0x70.1:0x69";
        for (asked, alone, known, expected) in [
            ("", None, Some("c"), "c=1:0x69"),
            ("b", Some(Address::Low), Some("a,b"), "b=1:0x68"),
            ("", None, None, "sensor=1:0x69"),
            (several, None, Some("a,b"), several),
        ] {
            assert_eq!(
                plan(asked, alone, known).as_deref(),
                Ok(expected),
                "{asked}"
            );
        }
    }

    #[test]
    fn contradictions_are_named_with_a_way_out() {
        for (asked, alone, words) in [
            ("", None, "2 sensors"),
            ("window", None, "\"window\""),
            ("a b=1:0x68", None, "the sensor a has no place"),
            ("a=1:0x68", Some(Address::High), "--address"),
        ] {
            let error = plan(asked, alone, Some("a,b")).unwrap_err();
            assert!(error.contains(words) && error.contains("hint:"), "{error}");
        }
    }
}
