//! Every possible mistake in a scene file or a trajectory, with the message that the user reads.

mod bounds;
mod files;
mod keys;

use crate::{CEILING, ROOM, no_files, object};
use grideye_scene::{Loaded, Scene, SceneError, limits};
use std::collections::{BTreeMap, HashMap};

const GOOD: &str = r#"[room]
size_mm = [4000, 6000, 2700]
ambient_c = 20

[[object]]
name = "table"
position_mm = [2000, 3000, 0]
size_mm = [1600, 1600, 750]
temperature_c = 20

[[agent]]
name = "person"
size_mm = [200, 500, 1750]
temperature_c = 28
trajectory = "walks/walk.csv"
speed_mm_per_s = 800

[[sensor]]
name = "ceiling"
preset = "grid-eye"
position_mm = [2000, 3000, 2700]
elevation_deg = 90
azimuth_deg = -90
"#;

const WALK: &str = "x_mm,y_mm,z_mm\n1000,1000,0\n3000,1000,0\n";

fn load(text: &str, walk: &str) -> Result<Loaded, SceneError> {
    Scene::parse(
        text,
        "room.toml",
        &BTreeMap::from([("walks/walk.csv".to_owned(), walk.to_owned())]),
    )
}

/// The message after changing one line of the valid scene.
fn refusal(from: &str, to: &str) -> String {
    assert_eq!(GOOD.matches(from).count(), 1, "`{from}` must occur once");
    load(&GOOD.replace(from, to), WALK)
        .map(|_| "accepted".to_owned())
        .unwrap_or_else(|error| error.to_string())
}

fn walk_refusal(walk: &str) -> String {
    load(GOOD, walk)
        .map(|_| "accepted".to_owned())
        .unwrap_or_else(|error| error.to_string())
}

#[test]
fn the_valid_scene_is_accepted() {
    let loaded = load(GOOD, WALK).unwrap();
    assert_eq!(loaded.warnings, []);
    assert_eq!(loaded.scene.objects().len(), 1);
}

/// A line of the valid scene, its replacement, and the message.
type Case = (&'static str, &'static str, &'static str);

fn assert_refused(cases: &[Case]) {
    for (from, to, expected) in cases {
        assert_eq!(&refusal(from, to), expected, "with {to}");
    }
}
