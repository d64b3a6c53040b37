//! Bodies with several temperatures, changing bodies, and warm prints: against bodies with one temperature each, and
//! against closed forms.

mod faces;
mod refusals;
mod time;

use crate::{CEILING, ROOM, object, parse, scene};
use grideye_scene::{Scene, Simulator, limits};
use std::collections::BTreeMap;
use std::time::Duration;

fn seconds(seconds: f64) -> Duration {
    Duration::from_secs_f64(seconds)
}

/// The frames of a scene by either method.
fn pictures(scene: &Scene, at_s: f64) -> [Vec<f64>; 2] {
    let name = &scene.sensors()[0].name;
    let simulators = [
        Simulator::new(&scene.on_grid(), name).unwrap(),
        Simulator::new(scene, name).unwrap(),
    ];
    simulators.map(|simulator| simulator.image(seconds(at_s)).celsius)
}

fn assert_same(found: &Scene, at_s: f64, expected: &Scene, within_c: f64) {
    let pairs = pictures(found, at_s)
        .into_iter()
        .zip(pictures(expected, 0.0));
    // Without a grid the integral is taken piece by piece, and the rule is not exact on pieces of another shape.
    for ((way, (found, expected)), rule_c) in pairs.enumerate().zip([0.0, 3e-5]) {
        let ambient_c = 20.1;
        assert!(
            expected
                .iter()
                .any(|celsius| (celsius - ambient_c).abs() > 0.05),
            "there is something to be seen"
        );
        for (pixel, (found, expected)) in found.iter().zip(&expected).enumerate() {
            assert!(
                (found - expected).abs() <= within_c + rule_c,
                "way {way}, pixel {pixel}: {found}, expected {expected}"
            );
        }
    }
}

fn with(things: &str) -> Scene {
    scene(&format!("{ROOM}{CEILING}{things}"))
}
