//! Which sensor goes to which place: what the command line says and what it leaves open, and every contradiction in it.

use crate::exit::bad_input;
use amg8833_emulator::Address;
use anyhow::{Result, anyhow};
use grideye_rig::{Place, Placed, Planned};

/// The bus of a sensor whose place was left open: a Raspberry Pi's.
const BUS: u32 = 1;

/// What was asked for.
#[derive(Debug)]
pub(super) struct Wish<'a> {
    /// `--sensor`, in order.
    pub(super) sensors: &'a [Placed],
    /// `--address`.
    pub(super) address: Option<Address>,
    /// The number in `--device`.
    pub(super) bus: Option<u32>,
}

/// Gives every sensor its place. `known` are the names that there are; `None` where any name will do.
pub(super) fn sensors(wish: &Wish<'_>, known: Option<&[String]>) -> Result<Vec<Planned>> {
    let place = Place {
        bus: wish.bus.unwrap_or(BUS),
        branch: None,
        address: wish.address.unwrap_or(Address::High),
    };
    let planned = match wish.sensors {
        [] => vec![Planned {
            name: only(known)?,
            place,
        }],
        [Placed { name, place: None }] => vec![Planned {
            name: name.clone(),
            place,
        }],
        several => {
            if wish.address.is_some() || wish.bus.is_some() {
                return Err(bad_input(anyhow!(
                    "--address and --device place one sensor, and --sensor places it as well\nhint: write the whole place with the sensor, such as --sensor {}=1:0x69",
                    several[0].name
                )));
            }
            several.iter().map(placed).collect::<Result<_>>()?
        }
    };
    if let Some(known) = known {
        check_names(&planned, known)?;
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
    Ok(Planned {
        name: name.clone(),
        place,
    })
}

fn check_names(planned: &[Planned], known: &[String]) -> Result<()> {
    match planned.iter().find(|sensor| !known.contains(&sensor.name)) {
        None => Ok(()),
        Some(sensor) => Err(bad_input(anyhow!(
            "there is no sensor {:?}\nhint: choose one of: {}",
            sensor.name,
            known.join(", ")
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(
        sensors: &[&str],
        address: Option<Address>,
        known: Option<&[&str]>,
    ) -> Result<Vec<String>, String> {
        let sensors: Vec<Placed> = sensors.iter().map(|text| text.parse().unwrap()).collect();
        let wish = Wish {
            sensors: &sensors,
            address,
            bus: None,
        };
        let known: Option<Vec<String>> =
            known.map(|names| names.iter().map(|name| (*name).to_owned()).collect());
        super::sensors(&wish, known.as_deref())
            .map(|planned| {
                let line = |sensor: &Planned| format!("{}={}", sensor.name, sensor.place);
                planned.iter().map(line).collect()
            })
            .map_err(|error| format!("{error:#}"))
    }

    #[test]
    fn one_sensor_needs_no_place() {
        assert_eq!(
            plan(&[], None, Some(&["c"])),
            Ok(vec!["c=1:0x69".to_owned()])
        );
        assert_eq!(
            plan(&["b"], Some(Address::Low), Some(&["a", "b"])),
            Ok(vec!["b=1:0x68".to_owned()])
        );
        assert_eq!(plan(&[], None, None), Ok(vec!["sensor=1:0x69".to_owned()]));
    }

    #[test]
    fn several_sensors_go_where_they_are_put() {
        let places = ["a=1:0x68", "b=1:0x69", "a=3:0x70.0:0x69", "b=3:0x70.1:0x69"];
        let planned = plan(&places, None, Some(&["a", "b"])).unwrap();
        assert_eq!(planned, places);
    }

    #[test]
    fn contradictions_are_named_with_a_way_out() {
        let two: Option<&[&str]> = Some(&["a", "b"]);
        for (sensors, address, words) in [
            (&[][..], None, "2 sensors"),
            (&["window"], None, "\"window\""),
            (&["a", "b=1:0x68"], None, "the sensor a has no place"),
            (&["a=1:0x68"], Some(Address::High), "--address"),
        ] {
            let error = plan(sensors, address, two).unwrap_err();
            assert!(error.contains(words) && error.contains("hint:"), "{error}");
        }
    }
}
