//! The scenes with one uncertain number a standard deviation off: their values, and when they are refused.

use crate::support::{CEILING, object, parse, scene};
use grideye_scene::{Scene, Variant};

const PEOPLE: &str = r#"collisions = "error"
[room]
size_mm = [4000, 6000, 2700]
ambient_c = 20

[[agent]]
name = "anna"
position_mm = [1000, 1000, 0]
person = { height_mm = 1650, build = 1.1 }
"#;

fn text(tables: &[(&str, &str)]) -> String {
    let tables = tables
        .iter()
        .map(|(key, keys)| format!("\n[[uncertain]]\nkey = \"{key}\"\n{keys}\n"));
    let table = object("table", [2000.0, 1000.0, 0.0], [400.0; 3], 0.0, 20.0);
    format!("{PEOPLE}{table}{CEILING}{}", tables.collect::<String>())
}

fn both<T>(variant: &Variant, number: impl Fn(&Scene) -> T) -> [T; 2] {
    [number(&variant.below), number(&variant.above)]
}

fn near([below, above]: [f64; 2], expected: [f64; 2]) {
    let is_near = (below - expected[0]).abs() < 1e-9 && (above - expected[1]).abs() < 1e-9;
    assert!(is_near, "{below} {above}, expected {expected:?}");
}

/// Around the given mean, the value or the mean of adults, cut at given bounds and those of the key.
#[test]
fn each_number_with_a_law_is_off_by_its_sd_each_way() {
    let scene = scene(&text(&[
        ("room.ambient_c", "sd = 0.5\nmean = 20.25"),
        ("sensor.ceiling.position_mm.x", "sd = 20"),
        ("agent.anna.person.height_mm", "bounds = [1500, 1900]"),
        ("agent.anna.person.build", "bounds = [0.95, 1.15]\nsd = 0.2"),
        ("sensor.ceiling.elevation_deg", "sd = 2"),
    ]));
    let [ambient, place, height, build, elevation] = scene.variants() else {
        panic!("{:?}", scene.variants());
    };
    let keys: Vec<&str> = scene
        .variants()
        .iter()
        .map(|one| one.key.as_str())
        .collect();
    let uncertain: Vec<&str> = scene
        .uncertain()
        .iter()
        .map(|one| one.key.as_str())
        .collect();
    assert_eq!(keys, uncertain);
    let ambient_c = |scene: &Scene| f64::from(scene.ambient().get());
    near(both(ambient, ambient_c), [19.75, 20.75]);
    let x_m = |scene: &Scene| scene.sensors()[0].pose.position_m.x;
    near(both(place, x_m), [1.98, 2.02]);
    let person = |scene: &Scene| scene.agents()[0].person.unwrap();
    near(both(height, |scene| person(scene).height_m), [1.6, 1.8]);
    near(both(build, |scene| person(scene).girth), [0.95, 1.15]);
    let elevation_deg = |scene: &Scene| scene.sensors()[0].pose.elevation_rad.to_degrees();
    near(both(elevation, elevation_deg), [88.0, 90.0]);
    // The scene itself stays as written, and so does everything else in a variant.
    assert!((scene.agents()[0].person.unwrap().height_m - 1.65).abs() < 1e-9);
    near(both(height, x_m), [2.0, 2.0]);
    assert_eq!(
        both(place, |scene| scene.agents().to_vec()),
        [scene.agents(); 2]
    );
    // A law around the value does not move with it, and no variant has variants.
    assert_eq!(place.above.laws(), scene.laws());
    assert_eq!(both(place, |scene| scene.variants().len()), [0, 0]);
}

#[test]
fn only_numbers_of_the_file_with_a_law_have_variants() {
    let scene = scene(&text(&[
        ("room.ambient_c", "bounds = [15, 25]"),
        ("recording.start_s", "bounds = [-1, 1]\nsd = 0.5"),
        ("agent.anna.aside_m", "sd = 0.1"),
        ("agent.*.wander_m", "sd = 0.1"),
        ("agent.*.contrast", "sd = 0.1"),
        ("room.background_c", "sd = 0.3"),
        ("agent.anna.person.height_mm", "bounds = [1500, 1690]"),
    ]));
    assert_eq!(scene.variants(), []);
}

#[test]
fn scenes_with_other_sensors_or_without_agents_keep_fitting_variants() {
    let tables = [
        ("sensor.ceiling.position_mm.x", "sd = 20"),
        ("room.ambient_c", "sd = 0.5"),
    ];
    let scene = scene(&text(&tables));
    let mut moved = scene.sensors().to_vec();
    moved[0].pose.position_m.y = 1.0;
    let other = scene.with_sensors(moved.clone());
    let [ambient] = other.variants() else {
        panic!("{:?}", other.variants());
    };
    assert_eq!(ambient.key, "room.ambient_c");
    assert_eq!(
        both(ambient, |scene| scene.sensors().to_vec()),
        [moved.clone(), moved]
    );
    assert_eq!(both(ambient, |scene| scene.ambient().get()), [19.5, 20.5]);
    assert_eq!(scene.without_agents().variants(), []);
}

#[test]
fn a_refused_variant_is_refused_at_its_table() {
    for (key, keys, message) in [
        (
            "agent.anna.position_mm.x",
            "sd = 400\nmean = 1400",
            "`agent.anna.position_mm.x` may be 1800 by its law, but then room.toml:7:8: `anna` runs into `table` after 0 s",
        ),
        (
            "agent.anna.position_mm.y",
            "sd = 1000",
            "`agent.anna.position_mm.y` may be 0 by its law, but then room.toml:",
        ),
        // A table less is another room.
        (
            "object.table.position_mm.y",
            "sd = 900",
            "`object.table.position_mm.y` may be 100 by its law, but then room.toml:11:8: object `table` was removed",
        ),
        (
            "room.ambient_c",
            "bounds = [-400, 400]\nsd = 350",
            "`room.ambient_c` may be -330 by its law, but then room.toml:4:13: `ambient_c` is -330",
        ),
    ] {
        let text = text(&[(key, keys)]);
        let refused = parse(&text).unwrap_err();
        let line = text
            .lines()
            .position(|line| line.starts_with("key"))
            .unwrap()
            + 1;
        let place = format!("room.toml:{line}:7: {message}");
        let shown = refused.to_string();
        assert!(shown.starts_with(&place), "{shown}");
        assert!(shown.ends_with("give a smaller sd, or bounds"), "{shown}");
        assert_eq!(shown.lines().count(), 2, "{shown}");
        assert_eq!(refused.place().unwrap().line, line);
        // Whoever needs no variants can still read the scene, and so can bounds help.
        let without = Scene::parse_without_variants(&text, "room.toml", &crate::no_files);
        assert_eq!(without.unwrap().scene.variants(), []);
    }
    let bounded = [("agent.anna.position_mm.x", "sd = 900\nbounds = [900, 1100]")];
    assert_eq!(scene(&text(&bounded)).variants().len(), 1);
}
