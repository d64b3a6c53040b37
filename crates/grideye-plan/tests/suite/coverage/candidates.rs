//! The poses that are tried, and those that are written as scene tables.

use super::search::small;
use super::survey;
use crate::{ROOM, object, scene};
use glam::{DVec2, DVec3};
use grideye_plan::coverage::{Mount, Mounts, candidates, preset};
use grideye_scene::physical::Optics;

#[test]
fn a_picked_pose_is_the_same_sensor_in_a_scene_file() {
    let (_, mut poses, _) = small();
    let mut special = poses[0].clone();
    assert_eq!(special.sensor.optics, Optics::Amg88);
    let keys = "detectable_range_c = [0, 80]\noptics = \"pinhole\"\npixel_width_deg = [8, 9]\nblur_deg = [7.5, 2.5]\nstep_c = 0.25\n";
    let text = format!("{ROOM}{}{keys}", special.toml("S"));
    let text = text.replace("optics = \"datasheet\"\n", "");
    special.sensor = scene(&text).sensors()[0].clone();
    poses.push(special);
    let mut mounts = Vec::new();
    for pose in &poses {
        let text = format!("{ROOM}{}", pose.toml("a-name.of:its_own"));
        let again = &scene(&text).sensors()[0].clone();
        assert_eq!(again.name, "a-name.of:its_own");
        let mut expected = pose.sensor.clone();
        expected.name.clone_from(&again.name);
        let (one, other) = (again.field_of_view_rad, expected.field_of_view_rad);
        assert!((one - other).abs().max_element() < 1e-12);
        // Degrees pass through a decimal number, so their last bit may differ.
        expected.field_of_view_rad = one;
        assert_eq!(*again, expected);
        mounts.extend(pose.mount);
    }
    for mount in [Mount::Ceiling, Mount::Wall, Mount::Corner] {
        assert!(mounts.contains(&mount));
    }
}

#[test]
fn candidates_have_the_specified_places_and_directions() {
    let scene = scene(&format!(
        "{ROOM}{}",
        object(
            "cupboard",
            [300.0, 3000.0, 0.0],
            [600.0, 1000.0, 2400.0],
            0.0,
            20.1
        )
    ));
    let survey = survey(&scene, 500.0);
    let mounts = Mounts {
        spacing_m: 1.0,
        ..Mounts::default()
    };
    let poses = candidates(&survey, &mounts, &preset("grid-eye").unwrap()).unwrap();
    let count = |mount: Mount| {
        poses
            .iter()
            .filter(|pose| pose.mount == Some(mount))
            .count()
    };
    // 4 x 6 places, once straight down and in 8 directions at 30° and 60°; 4 corners at 3 angles.
    assert_eq!(count(Mount::Ceiling), 24 * 17);
    assert_eq!(count(Mount::Corner), 4 * 3);
    // 20 places along the walls, 9 directions each. Those at y = 2.5 and 3.5 m on the left are the cupboard's corner
    // and its end: the room starts on its border.
    let left: Vec<f64> = poses
        .iter()
        .filter(|pose| pose.mount == Some(Mount::Wall) && pose.position_mm.x < 100.0)
        .map(|pose| pose.position_mm.y)
        .collect();
    assert!(
        left.iter().all(|y| *y <= 2500.0 || *y >= 3500.0),
        "{left:?}"
    );
    for pose in &poses {
        let forward = pose.sensor.pose.world_from_sensor().x_axis;
        let middle = DVec3::new(2.0, 3.0, 0.0) - pose.sensor.pose.position_m;
        assert!(scene.room().contains(pose.sensor.pose.position_m));
        match pose.mount {
            Some(Mount::Ceiling) => assert!(forward.z < -0.49),
            Some(Mount::Corner) => {
                // Along the bisector, at 45 degrees in a room of right angles.
                assert!((forward.x.abs() - forward.y.abs()).abs() < 1e-9);
                assert!(forward.truncate().dot(middle.truncate()) > 0.0);
            }
            _ => {
                let [x, y, _] = pose.position_mm.to_array();
                let inward = match (x, y) {
                    (20.0, _) => DVec2::X,
                    (3980.0, _) => -DVec2::X,
                    (_, 20.0) => DVec2::Y,
                    _ => -DVec2::Y,
                };
                assert!(forward.truncate().normalize().dot(inward) > 0.7, "{pose:?}");
            }
        }
    }
}
