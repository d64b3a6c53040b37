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
