//! Rooms that are not boxes: what their walls hide, what they contain, and what is refused.

use crate::{no_files, object, parse, picture, scene};
use glam::{DVec2, DVec3};
use grideye_scene::{Room, Scene, SceneError, Simulator, Warning};
use proptest::prelude::*;
use std::time::Duration;

const L_PLAN: &str = "[[0, 0], [5000, 0], [5000, 2500], [2500, 2500], [2500, 5000], [0, 5000]]";

fn room(plan_mm: &str) -> String {
    format!("[room]\nplan_mm = {plan_mm}\nheight_mm = 2500\nambient_c = 20\n")
}

fn sensor(position_mm: [f64; 3], elevation_deg: f64, azimuth_deg: f64) -> String {
    format!(
        "[[sensor]]\nname = \"eye\"\npreset = \"grid-eye\"\npixels_per_degree = 5\nposition_mm = {position_mm:?}\nelevation_deg = {elevation_deg:?}\nazimuth_deg = {azimuth_deg:?}\n"
    )
}

fn person(position_mm: [f64; 3], size_mm: [f64; 3]) -> String {
    format!(
        "[[agent]]\nname = \"person\"\nsize_mm = {size_mm:?}\ntemperature_c = 30\nposition_mm = {position_mm:?}\n"
    )
}

fn walker(room: &str, way: &str) -> Result<Scene, SceneError> {
    let text = format!(
        "{room}[[agent]]\nname = \"walker\"\nsize_mm = [200, 200, 1700]\ntemperature_c = 28\ntrajectory = \"way.csv\"\nspeed_mm_per_s = 1000\n"
    );
    let files = |_: &str| Ok(format!("x_mm,y_mm,z_mm\n{way}"));
    Scene::parse(&text, "room.toml", &files).map(|loaded| loaded.scene)
}

fn both(scene: &Scene) -> [Simulator; 2] {
    let name = &scene.sensors()[0].name;
    [
        Simulator::new(&scene.on_grid(), name).unwrap(),
        Simulator::new(scene, name).unwrap(),
    ]
}

/// Where a ray in the plane meets the first wall of a plan, as a multiple of its direction; uses none of the crate's
/// code.
fn first_wall(plan_m: &[DVec2], from: DVec2, direction: DVec2) -> f64 {
    let mut nearest = f64::INFINITY;
    for index in 0..plan_m.len() {
        let (a, b) = (plan_m[index], plan_m[(index + 1) % plan_m.len()]);
        let wall = b - a;
        let across = direction.perp_dot(wall);
        if across.abs() < 1e-12 {
            continue;
        }
        let along = (a - from).perp_dot(wall) / across;
        let share = (a - from).perp_dot(direction) / across;
        if along > 1e-9 && (0.0..=1.0).contains(&share) {
            nearest = nearest.min(along);
        }
    }
    nearest
}

/// Even-odd rule, by counting the walls to the right of a point.
fn is_inside(plan_m: &[DVec2], point: DVec2) -> bool {
    let mut inside = false;
    for index in 0..plan_m.len() {
        let (a, b) = (plan_m[index], plan_m[(index + 1) % plan_m.len()]);
        if (a.y > point.y) != (b.y > point.y) {
            let x = a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x);
            inside ^= point.x < x;
        }
    }
    inside
}

fn plan_text(plan_m: &[DVec2]) -> String {
    let corners: Vec<String> = plan_m
        .iter()
        .map(|corner| format!("[{:?}, {:?}]", corner.x * 1000.0, corner.y * 1000.0))
        .collect();
    format!("[{}]", corners.join(", "))
}

/// A star: corners sorted by their angles about the origin, so that the outline is simple; some jut in.
fn star() -> impl Strategy<Value = Vec<DVec2>> {
    prop::collection::vec((1.2_f64..4.0, -0.3_f64..0.3), 5..9).prop_map(|corners| {
        let count = corners.len() as f64;
        let corners = corners.into_iter().enumerate();
        corners
            .map(|(index, (radius, shift))| {
                let angle = (index as f64 + shift) / count * std::f64::consts::TAU;
                radius * DVec2::new(angle.cos(), angle.sin())
            })
            .collect()
    })
}

#[test]
fn an_l_shaped_room_hides_the_person_around_the_corner() {
    // From (4.9, 1.25) the corner at (2.5, 2.5) hides everything above the line through both: y = 3.151 at x = 1.25.
    let looks = sensor([4900.0, 1250.0, 1000.0], 0.0, 150.0);
    for (y_mm, is_seen) in [(1250.0, true), (2500.0, true), (3500.0, false)] {
        let stands = person([1250.0, y_mm, 0.0], [200.0, 400.0, 1700.0]);
        let l_shaped = scene(&format!("{}{stands}{looks}", room(L_PLAN)));
        let open = scene(&format!(
            "[room]\nsize_mm = [5000, 5000, 2500]\nambient_c = 20\n{stands}{looks}"
        ));
        for (hidden, free) in both(&l_shaped).iter().zip(both(&open)) {
            let truth = |simulator: &Simulator| -> f64 {
                simulator.truth(Duration::ZERO).share.iter().sum()
            };
            assert!(truth(&free) > 0.5, "in the angle of view at {y_mm}");
            let image = hidden.image(Duration::ZERO);
            if is_seen {
                assert!((truth(hidden) - truth(&free)).abs() < 1e-9, "{y_mm}");
                assert_eq!(image, free.image(Duration::ZERO));
            } else {
                assert_eq!(truth(hidden), 0.0, "{y_mm}");
                assert!(image.celsius.iter().all(|celsius| *celsius == 20.0));
            }
        }
    }
}

#[test]
fn a_wall_hides_only_the_part_behind_it() {
    // A thin sheet across the far arm at x = 1, y from 0.5 to 4.5, seen level from (4, 1.25): the line past the corner
    // (2.5, 2.5) meets it at y = 1.25 + 3 * 1.25 / 1.5 = 3.75, so 81.25 % of it is seen.
    let sheet = "[[agent]]\nname = \"sheet\"\nposition_mm = [1000, 2500, 0]\n[[agent.part]]\nname = \"part\"\nposition_mm = [0, 0, 0]\nshape = \"polyhedron\"\n\
        vertices_mm = [[0, -2000, 900], [0, 2000, 900], [0, 2000, 1100], [0, -2000, 1100]]\nfaces = [[0, 1, 2, 3]]\ntemperature_c = 30\n";
    let looks = "[[sensor]]\nname = \"eye\"\nposition_mm = [4000, 1250, 1000]\nelevation_deg = 0\nazimuth_deg = 180\nfov_deg = 120\nresolution = [1, 1]\nnoise_sigma_c = 0\nsampling_hz = 10\npixels_per_degree = 10\n";
    let share = |room: &str| {
        let scene = scene(&format!("{room}{sheet}{looks}"));
        both(&scene).map(|simulator| simulator.truth(Duration::ZERO).share[0])
    };
    let whole = share("[room]\nsize_mm = [5000, 5000, 2500]\nambient_c = 20\n");
    let rest = share(&room(L_PLAN));
    for (whole, rest) in whole.iter().zip(rest) {
        // One pixel weighs its whole image evenly.
        assert!((rest / whole - 0.8125).abs() < 2e-3, "{rest} of {whole}");
    }
}

#[test]
fn a_plan_of_four_right_angles_is_the_box() {
    let rest = object(
        "stove",
        [1000.0, 4000.0, 0.0],
        [600.0, 600.0, 900.0],
        20.0,
        60.0,
    ) + &person([2000.0, 3000.0, 0.0], [200.0, 500.0, 1750.0])
        + &sensor([2000.0, 3000.0, 2500.0], 90.0, -90.0);
    let as_box = format!("[room]\nsize_mm = [4000, 6000, 2500]\nambient_c = 20\n{rest}");
    let mesh = "[room]\nambient_c = 20\nvertices_mm = [[0, 0, 0], [4000, 0, 0], [4000, 6000, 0], [0, 6000, 0], [0, 0, 2500], [4000, 0, 2500], [4000, 6000, 2500], [0, 6000, 2500]]\n\
        faces = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]\n";
    let inside_out = mesh.replace(
        "[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]",
        "[0, 1, 2, 3], [7, 6, 5, 4], [4, 5, 1, 0], [5, 6, 2, 1], [6, 7, 3, 2], [7, 4, 0, 3]",
    );
    let expected = picture(&as_box);
    for room in [
        room("[[0, 0], [4000, 0], [4000, 6000], [0, 6000]]"),
        room("[[0, 6000], [4000, 6000], [4000, 0], [2000, 0], [0, 0]]"),
        mesh.to_owned(),
        inside_out,
    ] {
        let text = format!("{room}{rest}");
        assert_eq!(picture(&text), expected);
        let scene = scene(&text);
        assert!(!scene.room().is_box());
        assert_eq!(
            scene.room().bounds_m(),
            (DVec3::ZERO, DVec3::new(4.0, 6.0, 2.5))
        );
        let outline_m = scene.room().outline_m();
        assert!((shoelace(&outline_m) - 24.0).abs() < 1e-12, "{outline_m:?}");
    }
}

fn shoelace(outline_m: &[DVec2]) -> f64 {
    (0..outline_m.len())
        .map(|index| outline_m[index].perp_dot(outline_m[(index + 1) % outline_m.len()]))
        .sum::<f64>()
        / 2.0
}

#[test]
fn an_obj_file_may_be_the_room() {
    let obj = "v 0 0 0\nv 5 0 0\nv 5 2.5 0\nv 2.5 2.5 0\nv 2.5 5 0\nv 0 5 0\nv 0 0 2.5\nv 5 0 2.5\nv 5 2.5 2.5\nv 2.5 2.5 2.5\nv 2.5 5 2.5\nv 0 5 2.5\n\
        f 6 5 4 3 2 1\nf 7 8 9 10 11 12\nf 1 2 8 7\nf 2 3 9 8\nf 3 4 10 9\nf 4 5 11 10\nf 5 6 12 11\nf 6 1 7 12\n";
    let files = |_: &str| Ok(obj.to_owned());
    let rest = person([1250.0, 3500.0, 0.0], [200.0, 400.0, 1700.0])
        + &sensor([4900.0, 1250.0, 1000.0], 0.0, 150.0);
    let text = format!("[room]\nambient_c = 20\nfile = \"room.obj\"\n{rest}");
    let by_mesh = Scene::parse(&text, "room.toml", &files).unwrap().scene;
    let by_plan = scene(&format!("{}{rest}", room(L_PLAN)));
    for (mesh, plan) in both(&by_mesh).iter().zip(both(&by_plan)) {
        assert_eq!(mesh.image(Duration::ZERO), plan.image(Duration::ZERO));
        assert_eq!(mesh.truth(Duration::ZERO), plan.truth(Duration::ZERO));
    }
    let outline_m = by_mesh.room().outline_m();
    assert_eq!(outline_m.len(), 6);
    assert!((shoelace(&outline_m) - 18.75).abs() < 1e-12);
    let millimeters = text.replace("file = \"room.obj\"", "file = \"room.obj\"\nunit_mm = 100");
    let refused = Scene::parse(&millimeters, "room.toml", &files).unwrap_err();
    assert!(leaves(&refused), "{refused}");
    let open = obj.replace("f 6 1 7 12\n", "");
    let files = |_: &str| Ok(open.clone());
    let refused = Scene::parse(&text, "room.toml", &files)
        .unwrap_err()
        .to_string();
    assert!(
        refused.starts_with("room.toml:3:8: `file` is \"room.obj\", expected a closed surface"),
        "{refused}"
    );
}

#[test]
fn a_mesh_with_a_step_contains_the_right_points() {
    // A podium of 0.3 m on the right half of a room of 4 x 3 x 2.5 m.
    let mesh = "[room]\nambient_c = 20\nvertices_mm = [[0, 0, 0], [2000, 0, 0], [2000, 3000, 0], [0, 3000, 0], [2000, 0, 300], [4000, 0, 300], [4000, 3000, 300], [2000, 3000, 300], [0, 0, 2500], [4000, 0, 2500], [4000, 3000, 2500], [0, 3000, 2500]]\n\
        faces = [[0, 3, 2, 1], [1, 2, 7, 4], [4, 7, 6, 5], [8, 9, 10, 11], [0, 1, 4, 5, 9, 8], [5, 6, 10, 9], [6, 7, 2, 3, 11, 10], [3, 0, 8, 11]]\n";
    let scene = scene(mesh);
    let room = scene.room();
    for (point, expected) in [
        ([1.0, 1.0, 0.1], true),
        ([3.0, 1.0, 0.1], false),
        ([3.0, 1.0, 0.3], true),
        ([2.0, 1.0, 0.2], true),
        ([2.000_001, 1.0, 0.2], false),
        ([3.0, 1.0, 2.6], false),
    ] {
        assert_eq!(
            room.contains(DVec3::from_array(point)),
            expected,
            "{point:?}"
        );
    }
    assert!((shoelace(&room.outline_m()) - 12.0).abs() < 1e-12);
    // A rug below the podium sticks out; one on it does not; a pipe lying across the step goes through it.
    for (position_mm, size_mm, stays) in [
        ([3000.0, 1500.0, 0.0], [500.0, 500.0, 200.0], false),
        ([3000.0, 1500.0, 300.0], [500.0, 500.0, 200.0], true),
        ([2000.0, 1500.0, 300.0], [3000.0, 100.0, 100.0], true),
        ([2000.0, 1500.0, 299.5], [3000.0, 100.0, 100.0], false),
    ] {
        let loaded = parse(&format!(
            "{mesh}{}",
            object("thing", position_mm, size_mm, 0.0, 20.0)
        ));
        assert_eq!(
            loaded.unwrap().warnings.is_empty(),
            stays,
            "{position_mm:?}"
        );
    }
}

#[test]
fn objects_crossing_a_wall_are_removed() {
    for (position_mm, size_mm, stays) in [
        // In the missing quarter; across its corner with all eight corners in the room; against its walls.
        ([4000.0, 4000.0, 0.0], [500.0, 500.0, 500.0], false),
        ([1000.0, 1000.0, 0.0], [100.0, 100.0, 100.0], true),
        ([2000.0, 3750.0, 0.0], [1000.0, 400.0, 500.0], true),
        ([2002.0, 3750.0, 0.0], [1000.0, 400.0, 500.0], false),
    ] {
        let text = format!(
            "{}{}",
            room(L_PLAN),
            object("box", position_mm, size_mm, 0.0, 25.0)
        );
        let loaded = parse(&text).unwrap();
        assert_eq!(loaded.scene.objects().len() == 1, stays, "{position_mm:?}");
        let is_told = matches!(&loaded.warnings[..], [Warning::ObjectOutsideRoom { name, .. }] if name == "box");
        assert_eq!(is_told, !stays);
    }
    // A pole from (2.3, 4) to (4, 2.3) has its ends in the room and its middle, at (3.15, 3.15), beyond the corner.
    let pole = object(
        "pole",
        [3150.0, 3150.0, 1000.0],
        [2404.0, 50.0, 50.0],
        -45.0,
        25.0,
    );
    let warning = parse(&format!("{}{pole}", room(L_PLAN)))
        .unwrap()
        .warnings
        .remove(0);
    assert!(
        warning.to_string().starts_with(
            "room.toml:6:8: object `pole` was removed: it reaches from [2282.38, 2282.38, 1000] to [4017.62, 4017.62, 1050] mm, \
             beyond the room of 8 sides within [0, 0, 0] to [5000, 5000, 2500] mm"
        ),
        "{warning}"
    );
}

fn leaves(refused: &SceneError) -> bool {
    refused.to_string().contains("` leaves the room of ")
}

#[test]
fn a_path_that_cuts_the_corner_leaves_the_room() {
    let l_shaped = room(L_PLAN);
    assert!(walker(&l_shaped, "4000,1250,0\n1250,1250,0\n1250,4000,0\n").is_ok());
    // Straight from one arm to the other, the body, 0.1 m to either side, meets the wall y = 2.5 when y + 0.1 = 2.5.
    let refused = walker(&l_shaped, "4000,1400,0\n1400,4000,0\n").unwrap_err();
    let SceneError::Refused(why) = refused else {
        panic!("{refused}");
    };
    assert_eq!((why.place.file.as_ref(), why.place.line), ("way.csv", 3));
    let (before, after) = why.problem.split_once(" s, at ").unwrap();
    let seconds = before.strip_prefix("agent `walker` goes through a wall after ");
    let seconds: f64 = seconds.unwrap().parse().unwrap();
    // y = 2.4 after 1 m along y: a path of 1.414 m at 1 m/s; a millimeter may overlap.
    assert!((seconds - 2.0_f64.sqrt()).abs() < 3e-3, "{seconds}");
    assert!(after.contains("2500"), "{after}");
    // Leaning against the wall is free; 2 mm deeper is not.
    assert!(walker(&l_shaped, "4000,2400,0\n1250,2400,0\n").is_ok());
    let refused = walker(&l_shaped, "4000,2402,0\n1250,2402,0\n").unwrap_err();
    assert!(leaves(&refused), "{refused}");
    // Convex plans have no wall in the way, only an outside.
    let triangle = room("[[0, 0], [6000, 0], [0, 6000]]");
    assert!(walker(&triangle, "500,500,0\n500,4000,0\n4000,500,0\n").is_ok());
    let refused = walker(&triangle, "500,500,0\n3000,3000,0\n")
        .unwrap_err()
        .to_string();
    assert!(
        refused.starts_with("way.csv:3:1: agent `walker` leaves the room of 5 sides within"),
        "{refused}"
    );
}

#[test]
fn a_sensor_hangs_in_the_room_or_on_its_walls() {
    for (position_mm, is_inside) in [
        ([2500.0, 2500.0, 2500.0], true),
        ([2500.0, 3000.0, 1000.0], true),
        ([2500.1, 3000.0, 1000.0], false),
        ([4000.0, 4000.0, 1000.0], false),
        ([5000.0, 1000.0, 2500.0], true),
        ([1000.0, 1000.0, 2500.1], false),
    ] {
        let parsed = parse(&format!(
            "{}{}",
            room(L_PLAN),
            sensor(position_mm, 0.0, 180.0)
        ));
        match parsed {
            Ok(_) => assert!(is_inside, "{position_mm:?}"),
            Err(other) => {
                assert!(other.to_string().contains("is outside the room"), "{other}");
                assert!(!is_inside, "{position_mm:?}");
            }
        }
    }
    // On the wall that juts in, looking along it: that wall fills half of the image, the person the other half.
    let stands = person([2300.0, 4500.0, 0.0], [390.0, 100.0, 2000.0]);
    let looks = sensor([2500.0, 2600.0, 1000.0], 0.0, 90.0);
    let scene = scene(&format!("{}{stands}{looks}", room(L_PLAN)));
    for simulator in both(&scene) {
        let truth = simulator.truth(Duration::ZERO);
        let side = |columns: std::ops::Range<usize>| -> f64 {
            columns.map(|column| truth.share[3 * 8 + column]).sum()
        };
        assert!(side(0..4) > 0.5, "{truth:?}");
        assert!(side(5..8) < 1e-9, "{truth:?}");
    }
}

#[test]
fn objects_on_a_wall_that_juts_in_are_in_front_of_it() {
    // A cold window, a sheet in the wall's own plane: colder than the wall, and visible.
    let window = "[[object]]\nname = \"window\"\nposition_mm = [2500, 3750, 1200]\nshape = \"polyhedron\"\nvertices_mm = [[0, -400, -400], [0, 400, -400], [0, 400, 400], [0, -400, 400]]\nfaces = [[0, 1, 2, 3]]\ntemperature_c = 5\n";
    let looks = sensor([500.0, 3750.0, 1200.0], 0.0, 0.0);
    let scene = scene(&format!("{}{window}{looks}", room(L_PLAN)));
    assert_eq!(scene.objects().len(), 1);
    for simulator in both(&scene) {
        assert!(simulator.image(Duration::ZERO).at(3, 3) < 19.0);
    }
}

#[test]
fn malformed_plans_are_refused() {
    for (plan, message) in [
        (
            "[[0, 0], [1000, 0]]",
            "room.toml:2:11: `plan_mm` is [[0, 0], [1000, 0]], expected at least 3 corners",
        ),
        (
            "[[0, 0], [4000, 0], [4000, 4000], [0, 0]]",
            "room.toml:2:45: `plan_mm` is [0, 0], expected a corner away from the next one",
        ),
        (
            "[[0, 0], [4000, 0], [4000, 0], [0, 4000]]",
            "room.toml:2:20: `plan_mm` is [4000, 0], expected a corner away",
        ),
        (
            "[[0, 0], [4000, 4000], [4000, 0], [0, 3000]]",
            "room.toml:2:12: `plan_mm` is [0, 0], expected a wall that meets only its neighbors",
        ),
        (
            "[[0, 0], [4000, 0], [2000, 0]]",
            "room.toml:2:12: `plan_mm` is [0, 0], expected a wall that the next one does not double back on",
        ),
        (
            "[[0, 0], [4000, 0], [4000, 4000], [2000, 0], [0, 4000]]",
            "room.toml:2:12: `plan_mm` is [0, 0], expected a wall that meets only its neighbors",
        ),
        (
            "[[0, 0], [4000, 0], [4000, nan]]",
            "room.toml:2:31: `plan_mm` is [4000, nan], expected two coordinates",
        ),
        (
            "[[0, 0], [4000, 0], [4000, 1e7]]",
            "room.toml:2:31: `plan_mm` is [4000, 1e7], expected two coordinates",
        ),
    ] {
        let refused = parse(&room(plan)).unwrap_err().to_string();
        assert!(refused.starts_with(message), "{refused}");
        assert!(refused.contains("\nhint: "), "{refused}");
    }
}

#[test]
fn a_room_is_given_in_exactly_one_form() {
    let faces = "vertices_mm = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]\n";
    for (keys, message) in [
        ("", "room.toml:1:1: the room has no `size_mm`"),
        (
            "height_mm = 2500\n",
            "room.toml:1:1: the room has no `plan_mm`",
        ),
        (
            "plan_mm = [[0, 0], [1, 0], [0, 1]]\n",
            "room.toml:1:1: the room has no `height_mm`",
        ),
        ("unit_mm = 1\n", "room.toml:1:1: the room has no `file`"),
        (
            "faces = [[0, 1, 2]]\n",
            "room.toml:1:1: the room has no `vertices_mm`",
        ),
        (faces, "room.toml:1:1: the room has no `faces`"),
        (
            "size_mm = [1, 2, 3]\nplan_mm = [[0, 0], [1, 0], [0, 1]]\n",
            "room.toml:1:1: the room has both `size_mm` and `plan_mm`",
        ),
        (
            "plan_mm = [[0, 0], [1, 0], [0, 1]]\nheight_mm = 1\nfile = \"a.obj\"\n",
            "room.toml:1:1: the room has both `plan_mm` and `file`",
        ),
        (
            "plan_mm = [[0, 0], [9, 0], [0, 9]]\nheight_mm = 0\n",
            "room.toml:4:13: `height_mm` is 0, expected a height above 0",
        ),
        (
            &format!("{faces}faces = [[0, 1, 2]]\n"),
            "room.toml:4:9: `faces` is [[0, 1, 2]], expected a closed surface",
        ),
        (
            &format!("{faces}faces = [[0, 1, 7]]\n"),
            "room.toml:4:9: `room` is not a solid: face 0 names vertex 7, expected 0 to 3",
        ),
    ] {
        let refused = parse(&format!("[room]\nambient_c = 20\n{keys}"))
            .unwrap_err()
            .to_string();
        assert!(refused.starts_with(message), "{refused}");
    }
}

#[test]
fn a_room_has_at_most_a_thousand_corners_or_faces() {
    let circle = |count: usize| -> Vec<DVec2> {
        (0..count)
            .map(|index| {
                let angle = index as f64 / count as f64 * std::f64::consts::TAU;
                3.0 * DVec2::new(angle.cos(), angle.sin())
            })
            .collect()
    };
    assert!(parse(&room(&plan_text(&circle(1000)))).is_ok());
    let refused = parse(&room(&plan_text(&circle(1001))))
        .unwrap_err()
        .to_string();
    assert!(
        refused.starts_with("room.toml:2:11: 1001 corners, expected at most 1000"),
        "{refused}"
    );
    // 500 triangles about each end of an axis make a closed spindle.
    let spindle = |around: usize| {
        let mut obj = "v 0 0 0\nv 0 0 3\n".to_owned();
        for corner in circle(around) {
            obj.push_str(&format!("v {} {} 1\n", corner.x, corner.y));
        }
        for index in 0..around {
            let (here, next) = (index + 3, (index + 1) % around + 3);
            obj.push_str(&format!("f 1 {next} {here}\nf 2 {here} {next}\n"));
        }
        obj
    };
    let text = "[room]\nambient_c = 20\nfile = \"room.obj\"\n";
    for (around, fits) in [(500, true), (501, false)] {
        let obj = spindle(around);
        let files = |_: &str| Ok(obj.clone());
        let parsed = Scene::parse(text, "room.toml", &files);
        assert_eq!(parsed.is_ok(), fits, "{around}");
    }
    assert!(
        parse(text)
            .unwrap_err()
            .to_string()
            .contains("cannot read the OBJ file")
    );
    assert!(no_files("room.obj").is_err());
}

/// A grid of places over the plan's bounds.
fn places(room: &Room) -> Vec<DVec3> {
    let (low_m, high_m) = room.bounds_m();
    let steps = 0..=12;
    steps
        .flat_map(|x| (0..=12).map(move |y| (f64::from(x) / 12.0, f64::from(y) / 12.0)))
        .map(|(x, y)| low_m + DVec3::new(0.01 + 0.98 * x, 0.01 + 0.98 * y, 0.4) * (high_m - low_m))
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// For any plan in either direction, the room contains what the even-odd rule says.
    #[test]
    fn a_room_contains_the_inside_of_its_plan(plan_m in star(), clockwise in any::<bool>()) {
        let mut given_m = plan_m.clone();
        if clockwise {
            given_m.reverse();
        }
        let scene = scene(&room(&plan_text(&given_m)));
        for place in places(scene.room()) {
            prop_assert_eq!(scene.room().contains(place), is_inside(&plan_m, place.truncate()), "{}", place);
        }
        prop_assert!(shoelace(&scene.room().outline_m()) > 0.0);
        prop_assert!((shoelace(&scene.room().outline_m()) - shoelace(&plan_m)).abs() < 1e-9);
    }

    /// A thin warm pole is seen if and only if no wall of the plan crosses the straight line to it.
    #[test]
    fn a_pole_is_seen_unless_a_wall_hides_it(plan_m in star(), angle in 0.0_f64..360.0, radius in 0.2_f64..3.5) {
        let angle_rad = angle.to_radians();
        let pole = radius * DVec2::new(angle_rad.cos(), angle_rad.sin());
        let from = 0.8 * DVec2::new(-angle_rad.sin(), angle_rad.cos());
        // Poles and sensors too close to a wall, or to the line past a corner, would be half hidden.
        let apart = 0.03;
        prop_assume!(is_inside(&plan_m, from) && is_inside(&plan_m, pole));
        let towards = pole - from;
        let reach = first_wall(&plan_m, from, towards);
        let aside = apart * towards.perp().normalize();
        let reaches = [aside, -aside].map(|aside| first_wall(&plan_m, from, towards + aside));
        prop_assume!(reaches.iter().all(|other| (*other > 1.05) == (reach > 1.05) && (*other < 0.95) == (reach < 0.95)));
        prop_assume!(!(0.95..=1.05).contains(&reach));
        let azimuth = towards.y.atan2(towards.x).to_degrees();
        let stands = person([pole.x * 1000.0, pole.y * 1000.0, 0.0], [40.0, 40.0, 1800.0]);
        let looks = sensor([from.x * 1000.0, from.y * 1000.0, 1200.0], 0.0, azimuth);
        let parsed = parse(&format!("{}{stands}{looks}", room(&plan_text(&plan_m))));
        let is_refused = |error: &SceneError| leaves(error) || error.to_string().contains("goes through a wall");
        prop_assume!(!parsed.as_ref().is_err_and(is_refused));
        let scene = parsed.unwrap().scene;
        for simulator in both(&scene) {
            let share: f64 = simulator.truth(Duration::ZERO).share.iter().sum();
            prop_assert_eq!(share > 1e-6, reach > 1.0, "{} at {} of {:?}", share, reach, plan_m);
        }
    }
}
