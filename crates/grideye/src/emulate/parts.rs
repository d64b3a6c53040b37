//! From the command line to the sensors: reads the scene, the recording, the profile and the script of faults, and gives
//! each sensor its place.

use crate::cli::Emulate;
use crate::exit::bad_input;
use crate::{files, recordings};
use amg8833_emulator::Address;
use amg8833_emulator::script::Script;
use anyhow::{Result, anyhow};
use grideye_rig::{AtEnd, Build, Part, Place, Placed, Planned, Replay, Shown, World, recorded};
use grideye_scene::profile::Profile;
use std::path::Path;
use std::sync::Arc;

const PROFILES: [(&str, &str); 3] = [
    (
        "ideal",
        include_str!("../../../../scenes/profiles/ideal.toml"),
    ),
    (
        "datasheet",
        include_str!("../../../../scenes/profiles/datasheet.toml"),
    ),
    (
        "linaige",
        include_str!("../../../../scenes/profiles/linaige.toml"),
    ),
];

pub(super) struct Prepared {
    pub(super) parts: Vec<Part>,
    pub(super) shown: String,
}

pub(super) fn faults(options: &Emulate) -> Result<Option<Script>> {
    let Some(path) = &options.faults else {
        return Ok(None);
    };
    let hint =
        "name a file that you may read; crates/amg8833-emulator/scripts/README.md describes it";
    let text = files::text(path, "the script of faults", hint)?;
    let script = Script::from_toml(&text, &path.display().to_string()).map_err(bad_input)?;
    // The default seed leaves the script its own.
    let seed = script.seed().wrapping_add(options.seed).wrapping_sub(1);
    Ok(Some(script.with_seed(seed)))
}

pub(super) fn prepare(options: &Emulate, world: &Arc<World>) -> Result<Prepared> {
    let shown = shown(options)?;
    let profile = options.profile.as_deref().map(profile).transpose()?;
    check(options, &shown, profile.is_some())?;
    let planned = sensors(options, shown.names().as_deref())?;
    let build = Build {
        seed: options.seed,
        profile,
        clock_error_ppm: options.clock_error,
        at_end: options.at_end,
    };
    Ok(Prepared {
        parts: grideye_rig::parts(&shown, world, planned, &build).map_err(bad_input)?,
        shown: named(options),
    })
}

fn shown(options: &Emulate) -> Result<Shown> {
    if let Some(path) = &options.recording {
        let streams = recordings::load_streams(path)?;
        let sensors =
            recorded(streams).map_err(|error| bad_input(anyhow!("{} {error}", path.display())))?;
        return Ok(Shown::Recording {
            replay: options.replay.unwrap_or(Replay::Times),
            sensors,
        });
    }
    if let Some(celsius) = options.constant {
        return Ok(Shown::Constant(celsius));
    }
    let path = options.scene.clone().unwrap_or_default();
    Ok(Shown::Scene {
        scene: Box::new(files::load_scene(Some(&path))?.scene),
        simulate: options.method.simulate(),
    })
}

fn named(options: &Emulate) -> String {
    let path = options.recording.as_ref().or(options.scene.as_ref());
    match (path, options.constant) {
        (None, Some(celsius)) => format!("{celsius} °C"),
        (path, _) => path.map_or_else(String::new, |path| path.display().to_string()),
    }
}

fn check(options: &Emulate, shown: &Shown, has_profile: bool) -> Result<()> {
    match shown {
        Shown::Scene { .. } | Shown::Constant(_) if options.replay.is_some() => {
            Err(bad_input(anyhow!(
                "--replay says when the frames of a recording come, and there is none\nhint: leave out --replay, or name a --recording"
            )))
        }
        Shown::Recording { .. } if has_profile => Err(bad_input(anyhow!(
            "a recording has the noise of the sensor that recorded it, and --profile would add another's\nhint: leave out --profile; --clock-error sets the sensor's clock"
        ))),
        Shown::Scene { scene, .. } if scene.is_static() && options.at_end != AtEnd::Hold => {
            let named = named(options);
            Err(bad_input(anyhow!(
                "nothing moves in {named}, so it has no end\nhint: leave out --at-end"
            )))
        }
        _ => Ok(()),
    }
}

fn profile(named: &Path) -> Result<Profile> {
    if let Some((name, text)) = PROFILES.iter().find(|(name, _)| named == Path::new(name)) {
        return Profile::parse(text, name).map_err(bad_input);
    }
    let names = PROFILES.map(|(name, _)| name).join(", ");
    let hint = format!("name a file, or one of the built-in profiles: {names}");
    files::load_profile(named, &hint)
}

/// The bus of a sensor whose place was left open: a Raspberry Pi's.
const BUS: u32 = 1;

/// Gives every sensor its place. `known` are the names that there are; `None` where any name will do.
fn sensors(options: &Emulate, known: Option<&[String]>) -> Result<Vec<Planned>> {
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

    #[test]
    fn the_built_in_profiles_are_profiles() {
        for (name, _) in PROFILES {
            profile(Path::new(name)).unwrap();
        }
    }

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
