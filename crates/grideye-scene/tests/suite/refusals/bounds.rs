//! Tests that reach every bound, and the possible shapes.

use super::*;

fn stool(index: usize) -> String {
    object(
        &format!("{index}"),
        [2000.0, 3000.0, 0.0],
        [100.0; 3],
        0.0,
        20.0,
    )
}

#[test]
fn every_bound_on_bodies_is_reached() {
    let refused = |text: &str| {
        Scene::parse(text, "room.toml", &no_files)
            .err()
            .map(|error| error.to_string())
    };
    let tables = |count, table: &dyn Fn(usize) -> String| {
        ROOM.to_owned() + &(0..count).map(table).collect::<String>()
    };
    let agent = |index| stool(index).replace("object", "agent");
    assert_eq!(refused(&tables(limits::AGENTS_MAX, &agent)), None);
    let too_many = refused(&tables(limits::AGENTS_MAX + 1, &agent)).unwrap();
    assert!(
        too_many.starts_with("room.toml:604:1: 101 [[agent]] tables, expected at most 100\nhint: "),
        "{too_many}"
    );
    let parts = |count| {
        let part = |index| stool(index).replace("object", "agent.part");
        let parts: String = (0..count).map(part).collect();
        format!("{ROOM}[[agent]]\nname = \"a\"\nposition_mm = [0, 0, 0]\n{parts}")
    };
    assert_eq!(refused(&parts(limits::PARTS_MAX)), None);
    let too_many = refused(&parts(limits::PARTS_MAX + 1)).unwrap();
    assert!(
        too_many.starts_with(
            "room.toml:607:1: 101 [[agent.part]] tables, expected at most 100\nhint: "
        ),
        "{too_many}"
    );
    let corners = |count: usize| {
        let vertices = "[0, 0, 0],".repeat(count - 2);
        format!(
            "{ROOM}[[object]]\nname = \"o\"\nposition_mm = [9, 9, 0]\nshape = \"polyhedron\"\n\
             vertices_mm = [[1, 0, 0], [0, 1, 0], {vertices}]\nfaces = [[0, 1, 2]]\n"
        )
    };
    assert_eq!(refused(&corners(limits::VERTICES_MAX)), None);
    let too_many = refused(&corners(limits::VERTICES_MAX + 1)).unwrap();
    assert!(
        too_many.starts_with("room.toml:8:15: 100001 vertices, expected at most 100000\nhint: "),
        "{too_many}"
    );
}

#[test]
fn every_bound_on_tables_and_text_is_reached() {
    let refused = |text: &str| {
        Scene::parse(text, "room.toml", &no_files)
            .err()
            .map(|error| error.to_string())
    };
    let tables = |count, table: &dyn Fn(usize) -> String| {
        ROOM.to_owned() + &(0..count).map(table).collect::<String>()
    };
    assert_eq!(refused(&tables(limits::OBJECTS_MAX, &stool)), None);
    let too_many = refused(&tables(limits::OBJECTS_MAX + 1, &stool)).unwrap();
    assert!(
        too_many.starts_with(
            "room.toml:60004:1: 10001 [[object]] tables, expected at most 10000\nhint: "
        ),
        "{too_many}"
    );
    let sensor = |index| CEILING.replace("ceiling", &format!("{index}"));
    assert_eq!(refused(&tables(limits::SENSORS_MAX, &sensor)), None);
    let too_many = refused(&tables(limits::SENSORS_MAX + 1, &sensor)).unwrap();
    assert!(
        too_many
            .starts_with("room.toml:6004:1: 1001 [[sensor]] tables, expected at most 1000\nhint: "),
        "{too_many}"
    );
    let padded = |bytes: usize| format!("{ROOM}#{}", " ".repeat(bytes - ROOM.len() - 1));
    assert_eq!(refused(&padded(limits::TEXT_BYTES_MAX)), None);
    let too_long = refused(&padded(limits::TEXT_BYTES_MAX + 1)).unwrap();
    assert!(
        too_long.starts_with(
            "room.toml:1:1: 16777217 bytes of text, expected at most 16777216\nhint: "
        ),
        "{too_long}"
    );
    let name = |length: usize| {
        let named = object(
            &"ü".repeat(length),
            [500.0, 500.0, 0.0],
            [100.0; 3],
            0.0,
            20.0,
        );
        format!("{ROOM}{named}")
    };
    assert_eq!(refused(&name(limits::NAME_CHARACTERS_MAX)), None);
    let too_long = refused(&name(limits::NAME_CHARACTERS_MAX + 1)).unwrap();
    assert!(
        too_long.contains("…, expected 1 to 100 visible characters"),
        "{too_long}"
    );
    let fine = format!("{ROOM}{CEILING}pixels_per_degree = 34.13\nresolution = [1024, 1024]\n");
    assert_eq!(refused(&fine), None, "2048 points and 1024 pixels an axis");
}

#[test]
fn files_may_be_a_closure_or_a_map() {
    let map = HashMap::from([("walks/walk.csv".to_owned(), WALK.to_owned())]);
    let tree = BTreeMap::from([("walks/walk.csv".to_owned(), WALK.to_owned())]);
    let closure = |name: &str| {
        if name == "walks/walk.csv" {
            Ok(WALK.to_owned())
        } else {
            no_files(name)
        }
    };
    let from_map = Scene::parse(GOOD, "room.toml", &map).unwrap();
    assert_eq!(Scene::parse(GOOD, "room.toml", &tree).unwrap(), from_map);
    assert_eq!(Scene::parse(GOOD, "room.toml", &closure).unwrap(), from_map);
    let empty = HashMap::<String, String>::new();
    assert!(matches!(
        Scene::parse(GOOD, "room.toml", &empty),
        Err(SceneError::FileUnreadable { source, .. }) if source.kind() == std::io::ErrorKind::NotFound
    ));
}

const SHAPES: &[(&str, &str)] = &[
    (
        "shape = \"cone\"\nsize_mm = [1, 1, 1]",
        "room.toml:7:9: `shape` is \"cone\", expected \"cuboid\", \"pyramid\", \"ellipsoid\", \"capsule\", or for objects and parts \"polyhedron\" or \"obj\"\n\
         hint: scenes/README.md shows each; cuboid is the default",
    ),
    (
        "shape = \"pyramid\"",
        "room.toml:4:1: `thing` has no `size_mm`\n\
         hint: cuboid, pyramid, ellipsoid and capsule need size_mm, polyhedron vertices_mm and faces, obj file",
    ),
    (
        "shape = \"obj\"\nfile = \"a.obj\"\nsize_mm = [1, 1, 1]",
        "room.toml:4:1: `thing` has both `size_mm` and `shape`\n\
         hint: cuboid, pyramid, ellipsoid and capsule have size_mm, polyhedron vertices_mm and faces, obj file and unit_mm",
    ),
    (
        "shape = \"polyhedron\"\nvertices_mm = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\nfaces = [[0, 1, 3]]",
        "room.toml:9:9: `thing` is not a solid: face 0 names vertex 3, expected 0 to 2\n\
         hint: faces are lists of vertices, counted from 0, in the order of the outline",
    ),
    (
        "shape = \"obj\"\nfile = \"../chair.obj\"",
        "room.toml:8:8: `file` is \"../chair.obj\", expected a path with / below the scene file's folder\n\
         hint: put the file beside the scene, as in trajectory = \"trajectories/walk.csv\"",
    ),
    (
        "shape = \"obj\"\nfile = \"chair.obj\"",
        "room.toml:8:8: cannot read the OBJ file `chair.obj`: entity not found\n\
         hint: the path is relative to the scene file's folder",
    ),
    (
        "size_mm = [1, 1, 1]\ncolor = \"red\"",
        "room.toml:8:9: `color` is \"red\", expected a color as \"#rrggbb\"\n\
         hint: two hexadecimal digits each for red, green and blue",
    ),
    (
        "size_mm = [1, 1, 1]\npitch_deg = 361",
        "room.toml:8:13: `pitch_deg` is 361, expected -360 to 360\n\
         hint: angles are degrees; an object is rolled about x, pitched about y, then turned about the vertical",
    ),
];

#[test]
fn impossible_shapes_are_refused() {
    for (keys, expected) in SHAPES {
        let text =
            format!("{ROOM}[[object]]\nname = \"thing\"\nposition_mm = [99, 99, 0]\n{keys}\n");
        let found = crate::parse(&text).unwrap_err().to_string();
        assert_eq!(found, *expected, "with {keys}");
    }
}

#[test]
fn a_scene_names_files_up_to_a_bound_of_all_their_bytes() {
    let obj = |bytes: usize| {
        let solid =
            "v 0 0 0\nv 500 0 0\nv 0 500 0\nv 0 0 500\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
        format!("{solid}#{}\n", "x".repeat(bytes - solid.len() - 2))
    };
    let stool = |index: usize| {
        format!(
            "[[object]]\nname = \"s{index}\"\nshape = \"obj\"\nfile = \"s.obj\"\nunit_mm = 1\nposition_mm = [1000, 1000, 0]\ntemperature_c = 20\n"
        )
    };
    let refused = |stools: usize, bytes: usize| {
        let stools: String = (0..stools).map(stool).collect();
        let text = format!("{ROOM}{stools}{CEILING}");
        let files = BTreeMap::from([("s.obj".to_owned(), obj(bytes))]);
        Scene::parse(&text, "room.toml", &files)
            .err()
            .map(|error| error.to_string())
    };
    let bytes = limits::NAMED_BYTES_MAX / 128;
    assert_eq!(refused(128, bytes), None);
    let told = refused(129, bytes).unwrap();
    let expected =
        "the files named up to `s.obj` have 67633152 bytes, expected at most 67108864\nhint: ";
    assert!(told.contains(expected), "{told}");
    // A bomb of one file: ten thousand times the time of one.
    let begun = processor_s();
    assert!(refused(10_000, 1 << 20).is_some());
    assert!(processor_s() - begun < 10.0);
}

/// Processor time of this thread so far, in seconds.
fn processor_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/thread-self/stat").unwrap();
    let fields = stat.rsplit(')').next().unwrap().split_whitespace();
    let ticks = fields
        .skip(11)
        .take(2)
        .map(|field| field.parse::<u32>().unwrap());
    f64::from(ticks.sum::<u32>()) / 100.0
}

/// An OBJ file of one upright face with this outline, in millimeters.
fn face(outline: impl Iterator<Item = (f64, f64)>) -> String {
    let mut text = String::new();
    let mut corners = String::from("f");
    for ((x, z), number) in outline.zip(1..) {
        text += &format!("v {x} 0 {z}\n");
        corners += &format!(" {number}");
    }
    text + &corners + "\n"
}

#[test]
fn a_face_of_many_corners_is_read_in_time_or_refused() {
    let load = |obj: String| {
        let sheet = "[[object]]\nname = \"sheet\"\nshape = \"obj\"\nfile = \"s.obj\"\nunit_mm = 1\nposition_mm = [1500, 1500, 0]\ntemperature_c = 20\n";
        let files = BTreeMap::from([("s.obj".to_owned(), obj)]);
        Scene::parse(&format!("{ROOM}{sheet}{CEILING}"), "room.toml", &files)
    };
    let ring = |corners: i32, dent: f64| {
        face((0..corners).map(move |corner| {
            let angle = f64::from(corner) / f64::from(corners) * std::f64::consts::TAU;
            let radius = if corner % 2 == 0 { 500.0 } else { 500.0 * dent };
            (600.0 + radius * angle.cos(), 600.0 + radius * angle.sin())
        }))
    };
    let area_m2 = |obj: String| {
        let loaded = load(obj).unwrap();
        let mesh = &loaded.scene.objects()[0].mesh;
        let corner = |index: &usize| mesh.vertices_m()[*index];
        let doubled = mesh.faces().map(|face| {
            let fan = face.windows(2).map(|pair| {
                (corner(&pair[0]) - corner(&face[0])).cross(corner(&pair[1]) - corner(&face[0]))
            });
            fan.sum::<glam::DVec3>().length()
        });
        0.5 * doubled.sum::<f64>()
    };
    let begun = processor_s();
    let disk = 0.25 * std::f64::consts::PI;
    assert!((area_m2(ring(90_000, 1.0)) - disk).abs() < 1e-6);
    // A star: half of each sector of the regular polygon with as many corners.
    let star = 0.5 * 8_000.0 * 0.25 * 0.5 * (std::f64::consts::TAU / 8_000.0).sin();
    assert!((area_m2(ring(8_000, 0.5)) - star).abs() < 1e-6);
    // Spirals, of which nearly every corner is within many triangles.
    let spiral = |corners: i32| {
        let at = move |corner: i32, radius: f64| {
            let turn = f64::from(corner) / 50.0 * std::f64::consts::TAU;
            let radius = radius + 400.0 * f64::from(corner) / f64::from(corners);
            (600.0 + radius * turn.cos(), 600.0 + radius * turn.sin())
        };
        let there = (0..corners / 2).map(move |corner| at(corner, 100.0));
        let back = (0..corners / 2).rev().map(move |corner| at(corner, 99.0));
        face(there.chain(back))
    };
    assert!(load(spiral(8_000)).is_ok());
    for many in [ring(90_000, 0.5), spiral(20_000)] {
        let told = load(many).unwrap_err().to_string();
        assert!(
            told.contains("`sheet` is not a solid: face 0 is not convex and has "),
            "{told}"
        );
        assert!(told.contains("cut them into triangles"), "{told}");
    }
    let took = processor_s() - begun;
    println!("faces of 90,000 corners, and others: {took:.1} s");
    assert!(took < 20.0, "{took}");
    for wrong in [
        "f 1 2 999999999999\n",
        "f 1 2 99999999999999999999\n",
        "f -9 1 2\n",
        "f 1 1 1\n",
        "f\n",
    ] {
        let told = load("v 0 0 0\nv 1 0 0\nv 0 0 1\n".to_owned() + wrong)
            .unwrap_err()
            .to_string();
        assert!(told.starts_with("s.obj:"), "{told}");
    }
}
