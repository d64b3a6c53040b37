//! Which sensor goes to which place: what the command line says and what it leaves open, and every contradiction in it.

use crate::cli::Emulate;
use crate::exit::bad_input;
use amg8833_emulator::Address;
use anyhow::{Result, anyhow};
use grideye_rig::{Place, Placed, Planned};

/// The bus of a sensor whose place was left open: a Raspberry Pi's.
const BUS: u32 = 1;

/// Gives every sensor its place. `known` are the names that there are; `None` where any name will do.
pub(super) fn sensors(options: &Emulate, known: Option<&[String]>) -> Result<Vec<Planned>> {
    let place = Place {
        bus: options.device.unwrap_or(BUS),
        branch: None,
        address: options.address.unwrap_or(Address::High),
    };
    let alone = |name| vec![Planned { name, place }];
    let planned = match options.sensors.as_slice() {
        [] => alone(only(known)?),
        [Placed { name, place: None }] => alone(name.clone()),
        [first, ..] if options.address.is_some() || options.device.is_some() => {
            return Err(bad_input(anyhow!(
                "--address and --device place one sensor, and --sensor places it as well\nhint: write the whole place with the sensor, such as --sensor {}=1:0x69",
                first.name
            )));
        }
        several => several.iter().map(placed).collect::<Result<_>>()?,
    };
    let is_unknown = |sensor: &&Planned| known.is_some_and(|known| !known.contains(&sensor.name));
    if let Some(Planned { name, .. }) = planned.iter().find(is_unknown) {
        let known = known.unwrap_or_default().join(", ");
        return Err(bad_input(anyhow!(
            "there is no sensor {name:?}\nhint: choose one of: {known}"
        )));
    }
    Ok(planned)
}

fn only(known: Option<&[String]>) -> Result<String> {
    match known {
        None => Ok("sensor".to_owned()),
        Some([only]) => Ok(only.clone()),
        Some(names) => Err(bad_input(anyhow!(
            "there are {} sensors\nhint: choose one with --sensor NAME, or give each its place with --sensor NAME=BUS:ADDRESS: {}",
            names.len(),
            names.join(", ")
        ))),
    }
}

fn placed(sensor: &Placed) -> Result<Planned> {
    let name = &sensor.name;
    let place = sensor.place.ok_or_else(|| {
        bad_input(anyhow!(
            "the sensor {name} has no place, and there are several\nhint: --sensor {name}=1:0x68, or another BUS:ADDRESS"
        ))
    })?;
    let name = name.clone();
    Ok(Planned { name, place })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::{Cli, Command};
    use clap::Parser as _;

    /// What `emulate` plans with these options; `known` are the names, with commas.
    fn plan(options: &str, known: Option<&str>) -> Result<String, String> {
        let line = format!("grideye emulate --constant 20 --socket s {options}");
        let Command::Emulate(options) = Cli::parse_from(line.split_whitespace()).command else {
            unreachable!()
        };
        let known: Option<Vec<String>> =
            known.map(|names| names.split(',').map(str::to_owned).collect());
        let planned = sensors(&options, known.as_deref()).map_err(|error| format!("{error:#}"))?;
        let line = |sensor: &Planned| format!("{}={}", sensor.name, sensor.place);
        Ok(planned.iter().map(line).collect::<Vec<_>>().join(" "))
    }

    #[test]
    fn one_sensor_needs_no_place_and_several_go_where_they_are_put() {
        for (options, known, planned) in [
            ("", Some("c"), "c=1:0x69"),
            ("--sensor b --address 0x68", Some("a,b"), "b=1:0x68"),
            ("", None, "sensor=1:0x69"),
            (
                "--sensor a=1:0x68 --sensor b=1:0x69 --sensor a=3:0x70.0:0x69 --sensor b=3:0x70.1:0x69",
                Some("a,b"),
                "a=1:0x68 b=1:0x69 a=3:0x70.0:0x69 b=3:0x70.1:0x69",
            ),
        ] {
            assert_eq!(plan(options, known).as_deref(), Ok(planned), "{options}");
        }
    }

    #[test]
    fn contradictions_are_named_with_a_way_out() {
        for (options, words) in [
            ("", "2 sensors"),
            ("--sensor window", "\"window\""),
            ("--sensor a --sensor b=1:0x68", "the sensor a has no place"),
            ("--sensor a=1:0x68 --address 0x69", "--address"),
        ] {
            let error = plan(options, Some("a,b")).unwrap_err();
            assert!(error.contains(words) && error.contains("hint:"), "{error}");
        }
    }
}
