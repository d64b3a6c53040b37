//! The sensors of a machine, ready to build in.

use crate::error::RigError;
use crate::place::{Branch, Place, Planned};
use crate::show::{AtEnd, Show, Specimen, Timeline, World};
use crate::shown::Shown;
use amg8833_emulator::{Drift, MuxAddress, Options};
use grideye_scene::profile::Profile;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// How to build the sensors.
#[derive(Debug, Clone)]
pub struct Build {
    /// Seed of the noise; each sensor is another specimen.
    pub seed: u64,
    /// Noise, pattern and clock of real sensors; `None` for the scene's own noise.
    pub profile: Option<Profile>,
    /// Clock error of the sensors in parts per million, overriding the profile's.
    pub clock_error_ppm: Option<i32>,
    /// What follows the end of a walk or a recording.
    pub at_end: AtEnd,
}

/// One sensor to build in.
pub struct Part {
    /// Its name and place.
    pub planned: Planned,
    pub(crate) show: Show,
    pub(crate) options: Options,
}

/// The sensors at their places, each with what it is shown.
/// # Errors
/// If two sensors would answer at once, or one cannot be shown this.
pub fn parts(
    shown: &Shown,
    world: &Arc<World>,
    planned: Vec<Planned>,
    build: &Build,
) -> Result<Vec<Part>, RigError> {
    check(&planned)?;
    let own = build.profile.as_ref();
    let profile = own.cloned().map(Arc::new);
    let options = Options {
        clock_error_ppm: build
            .clock_error_ppm
            .unwrap_or(own.map_or(0, Profile::clock_error_ppm)),
        clock_drift: Drift::PpmPerHour(own.map_or(0, Profile::clock_drift_ppm_per_hour)),
        ..Options::default()
    };
    let noise_seed = profile.is_none().then_some(build.seed);
    let part = |(index, planned): (u64, Planned)| {
        let (length, pictures) = shown.pictures(&planned.name, noise_seed)?;
        let specimen = profile.as_ref().map(|profile| Specimen {
            profile: Arc::clone(profile),
            seed: build.seed.wrapping_add(index),
            ticks: 0,
        });
        Ok(Part {
            planned,
            show: Show {
                world: Arc::clone(world),
                alone: false,
                timeline: Timeline::new(length, build.at_end),
                pictures,
                specimen,
            },
            options,
        })
    };
    (0..).zip(planned).map(part).collect()
}

/// The number of buses these sensors are on.
#[must_use]
pub fn buses(parts: &[Part]) -> usize {
    let numbers = parts.iter().map(|part| part.planned.place.bus);
    numbers.collect::<BTreeSet<u32>>().len()
}

/// Checks that no two sensors answer at once, and that a bus has at most one multiplexer.
fn check(planned: &[Planned]) -> Result<(), RigError> {
    let mut taken: BTreeMap<Place, &String> = BTreeMap::new();
    for Planned { name, place } in planned {
        if let Some(other) = taken.insert(*place, name) {
            return Err(RigError::Taken(other.clone(), name.clone(), *place));
        }
    }
    let mut muxes: BTreeMap<u32, MuxAddress> = BTreeMap::new();
    for Planned { name, place } in planned {
        let Some(Branch { mux, .. }) = place.branch else {
            continue;
        };
        let mut before = *place;
        before.branch = None;
        if let Some(one) = taken.get(&before) {
            let (one, other) = (String::clone(one), name.clone());
            return Err(RigError::Together(one, before, other, *place, mux));
        }
        let first = *muxes.entry(place.bus).or_insert(mux);
        if first != mux {
            return Err(RigError::SecondMux(place.bus, first, mux));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensors_that_would_answer_at_once_are_named_with_a_way_out() {
        for (places, words) in [
            (["1:0x68", "1:0x68"], "a and b are both at 1:0x68"),
            (["1:0x70.3:0x68", "1:0x68"], "answer at once"),
            (["1:0x70.3:0x68", "1:0x71.4:0x68"], "0x70 and 0x71"),
        ] {
            let [one, other] = places.map(|place| place.parse().unwrap());
            let planned = [("a", one), ("b", other)].map(|(name, place)| Planned {
                name: name.to_owned(),
                place,
            });
            let error = check(&planned).unwrap_err().to_string();
            assert!(error.contains(words) && error.contains("hint:"), "{error}");
        }
    }
}
