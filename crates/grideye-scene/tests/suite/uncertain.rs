//! What a scene does not know exactly: found by its path, refused with its place, and replaced without touching anything
//! else; and the laws it has.

use grideye_scene::uncertain::{FITTED_MAX, Normal, Uncertain, with_values};
use grideye_scene::{AgentLaws, Laws, Loaded, Scene, SceneError};
use std::collections::BTreeMap;

const SCENE: &str = r#"[room]
size_mm = [4000, 6000, 2700]
ambient_c = 20 # guessed

[[object]]
name = "lamp 2.5 W"
position_mm = [1000, 1000, 0]
size_mm = [100, 100, 100]
temperature_c = 40.5

[[agent]]
name = "child"
position_mm = [3000, 3000, 0]
[[agent.part]]
name = "head"
position_mm = [0, 0, 1000]
size_mm = [180, 160, 220]
temperature_c = +3.2e1

[[sensor]]
name = "ceiling"
preset = "grid-eye"
position_mm = [2000, 3_000, 2700]   # measured
elevation_deg = 90
azimuth_deg = -90
fov_deg = [60, 58]
"#;

fn parse(fits: &[(&str, &str)]) -> (String, Result<Loaded, SceneError>) {
    let tables = fits
        .iter()
        .map(|(key, bounds)| format!("\n[[uncertain]]\nkey = \"{key}\"\nbounds = {bounds}\n"));
    let text = SCENE.to_owned() + &tables.collect::<String>();
    let loaded = Scene::parse(&text, "room.toml", &BTreeMap::new());
    (text, loaded)
}

#[test]
fn numbers_are_found_by_their_paths_and_nothing_else_changes() {
    let (text, loaded) = parse(&[
        ("room.ambient_c", "[15, 25]"),
        ("object.lamp 2.5 W.temperature_c", "[30, 50]"),
        ("agent.child.head.temperature_c", "[30, 35]"),
        ("agent.child.position_mm.y", "[2000, 4000]"),
        ("sensor.ceiling.position_mm.y", "[2900, 3100]"),
        ("sensor.ceiling.fov_deg.down", "[50, 70]"),
        ("sensor.ceiling.azimuth_deg", "[-100, -80]"),
        ("recording.start_s", "[-2, 2]"),
    ]);
    let scene = loaded.unwrap().scene;
    let uncertain = scene.uncertain();
    let found: Vec<f64> = uncertain.iter().map(|one| one.value).collect();
    assert_eq!(found, [20.0, 40.5, 32.0, 3000.0, 3000.0, 58.0, -90.0, 0.0]);
    let new = with_values(
        &text,
        uncertain,
        &[21.25, 41.0, 33.0, 3001.0, 2999.5, 59.0, -91.5, 1.0],
    );
    let expected = text
        .replace("ambient_c = 20", "ambient_c = 21.25")
        .replace("40.5", "41")
        .replace("+3.2e1", "33")
        .replace("[3000, 3000, 0]", "[3000, 3001, 0]")
        .replace("3_000", "2999.5")
        .replace("[60, 58]", "[60, 59]")
        .replace("azimuth_deg = -90", "azimuth_deg = -91.5");
    assert_eq!(new, expected);
    for one in uncertain {
        assert!(text[one.remark_at..].starts_with(&format!("key = \"{}\"", one.key)));
    }
}

/// A law is around the value in the file or the given mean; people have laws of their own where their mean is allowed.
#[test]
fn laws_are_given_or_those_of_people() {
    let text = r#"[room]
size_mm = [4000, 6000, 2700]
ambient_c = 20

[[agent]]
name = "anna"
position_mm = [2000, 3000, 0]
person = { height_mm = 1650, build = 1.1, clothing = 0.9 }

[[sensor]]
name = "ceiling"
preset = "grid-eye"
position_mm = [2000, 3000, 2700]
elevation_deg = 90
azimuth_deg = -90
tilt_deg = [1.5, -2]
"#;
    let laws = |fits: &[(&str, &str)]| -> Vec<(f64, Option<[f64; 2]>)> {
        let tables = fits
            .iter()
            .map(|(key, keys)| format!("\n[[uncertain]]\nkey = \"{key}\"\n{keys}\n"));
        let text = text.to_owned() + &tables.collect::<String>();
        let loaded = Scene::parse(&text, "room.toml", &BTreeMap::new()).unwrap();
        let law = |one: &Uncertain| (one.value, one.law.map(|law| [law.mean, law.sd]));
        loaded.scene.uncertain().iter().map(law).collect()
    };
    let found = laws(&[
        ("room.ambient_c", "bounds = [15, 25]\nsd = 0.5"),
        (
            "sensor.ceiling.tilt_deg.y",
            "bounds = [-5, 5]\nsd = 1\nmean = 0",
        ),
        ("sensor.ceiling.tilt_deg.x", "bounds = [-5, 5]"),
        ("agent.anna.person.height_mm", "bounds = [1400, 2000]"),
        ("agent.anna.person.build", "bounds = [0.8, 1.4]"),
        ("agent.anna.person.clothing", "bounds = [0, 3]\nsd = 0.2"),
    ]);
    let expected = [
        (20.0, Some([20.0, 0.5])),
        (-2.0, Some([0.0, 1.0])),
        (1.5, None),
        (1650.0, Some([1700.0, 100.0])),
        (1.1, Some([1.0, 0.1])),
        (0.9, Some([0.9, 0.2])),
    ];
    assert_eq!(found, expected);
    // Bounds without the mean of adults are those of somebody known better.
    assert_eq!(
        laws(&[("agent.anna.person.height_mm", "bounds = [1500, 1690]")])[0].1,
        None
    );
}

#[test]
fn unknowns_do_not_change_the_scene() {
    let with = parse(&[("room.ambient_c", "[15, 25]")]).1.unwrap();
    let without = parse(&[]).1.unwrap();
    assert!(with.scene.has_the_room_of(&without.scene));
    assert_eq!(with.scene.agents(), without.scene.agents());
}

#[test]
fn invalid_unknowns_are_refused_with_their_place() {
    for (fits, message) in [
        (
            vec![("room.ambiant_c", "[1, 2]")],
            "room.toml:29:7: `key` is \"room.ambiant_c\", expected the path of a number",
        ),
        (
            vec![("sensor.ceiling.preset", "[1, 2]")],
            "room.toml:29:7: `key`",
        ),
        (
            vec![("sensor.ceiling.roll_deg", "[-1, 2]")],
            "a default must be written out first",
        ),
        (
            vec![("sensor.wall.azimuth_deg", "[-1, 2]")],
            "room.toml:29:7: `key`",
        ),
        (
            vec![("sensor.ceiling.position_mm.w", "[-1, 2]")],
            "room.toml:29:7: `key`",
        ),
        (
            vec![("agent.child.temperature_c", "[-1, 2]")],
            "room.toml:29:7: `key`",
        ),
        (
            vec![("room.ambient_c", "[25, 15]")],
            "room.toml:30:10: `bounds` is [25, 15], expected [lowest, highest]",
        ),
        (
            vec![("room.ambient_c", "[15, 15]")],
            "room.toml:30:10: `bounds`",
        ),
        (
            vec![("room.ambient_c", "[15, inf]")],
            "room.toml:30:10: `bounds`",
        ),
        (
            vec![("room.ambient_c", "[21, 25]")],
            "room.toml:30:10: `bounds` is [21, 25], expected bounds around 20, the",
        ),
        (
            vec![("room.ambient_c", "[15, 25]"); 2],
            "room.toml:33:7: `key` is \"room.ambient_c\", expected each key once",
        ),
        (
            vec![("room.ambient_c", "[15, 20, 25]")],
            "room.toml:30:10: `bounds`: invalid length 3",
        ),
    ] {
        let refused = parse(&fits).1.unwrap_err().to_string();
        assert!(
            refused.contains(message) && refused.contains("\nhint: "),
            "{refused}"
        );
    }
}

#[test]
fn invalid_laws_are_refused_with_their_place() {
    for (keys, message) in [
        (
            "sd = 0",
            "room.toml:31:6: `sd` is 0, expected a number above 0",
        ),
        (
            "mean = 21",
            "room.toml:31:8: `mean` is 21, expected sd beside it",
        ),
        (
            "sd = 1\nmean = 26",
            "room.toml:32:8: `mean` is 26, expected 15 to 25, the bounds",
        ),
    ] {
        let refused = parse(&[("room.ambient_c", &format!("[15, 25]\n{keys}"))]).1;
        let refused = refused.unwrap_err().to_string();
        assert!(
            refused.contains(message) && refused.contains("\nhint: "),
            "{refused}"
        );
    }
}

#[test]
fn a_calibration_is_read_with_its_lines() {
    let table = "[[calibrated]]\n# why\nkeys = [\"room.ambient_c\"]\nevery_s = 0.5\nframes = \"\"\"\n00000000 0123abcd\nffffffff\"\"\"\n";
    let read = |text: &str| Scene::parse(text, "room.toml", &BTreeMap::new());
    let text =
        format!("{SCENE}\n{table}\n[[uncertain]]\nkey = \"room.ambient_c\"\nbounds = [15, 25]\n");
    let scene = read(&text).unwrap().scene;
    let [found] = scene.calibrated() else {
        panic!("{:?}", scene.calibrated());
    };
    assert_eq!(found.keys, ["room.ambient_c"]);
    assert_eq!(found.frames, [0, 0x0123_abcd, 0xffff_ffff]);
    assert_eq!((found.every_s, &text[found.lines.clone()]), (0.5, table));
    for wrong in ["0123abc", "0123abcdef", "walkwalk", "+123abcd", ""] {
        let refused = read(
            &text
                .replace("ffffffff", wrong)
                .replace("00000000 0123abcd", wrong),
        );
        let refused = refused.unwrap_err().to_string();
        assert!(
            refused.contains("expected marks of 8 hexadecimal digits"),
            "{refused}"
        );
    }
}

/// What a calibration left open is what is known now; what was known before it stays the law of the next calibration.
#[test]
fn a_calibration_narrows_a_law() {
    let read = |sd: &str| {
        let text = format!(
            "{SCENE}\n[[calibrated]]\nkeys = [\"room.ambient_c\"]\nsd = {{ {sd} }}\nevery_s = 0.5\nframes = \"00000000\"\n\
             [[uncertain]]\nkey = \"room.ambient_c\"\nbounds = [15, 25]\nsd = 2\nmean = 18\n"
        );
        Scene::parse(&text, "room.toml", &BTreeMap::new()).map(|loaded| loaded.scene)
    };
    for (sd, mean_sd) in [("0.05", [20.0, 0.05]), ("3", [20.0, 2.0])] {
        let scene = read(&format!("\"room.ambient_c\" = {sd}")).unwrap();
        let one = &scene.uncertain()[0];
        let [law, known] = [one.law, one.known()].map(|law| law.map(|law| [law.mean, law.sd]));
        assert_eq!((law, known), (Some([18.0, 2.0]), Some(mean_sd)));
        let [variant] = scene.variants() else {
            panic!("{:?}", scene.variants());
        };
        let ambient = variant.below.room().ambient_c;
        assert!((ambient - (20.0 - mean_sd[1])).abs() < 1e-9, "{ambient}");
        let told = &scene.laws().source[0];
        assert!(told.contains("as calibrated (room.toml:"), "{told}");
    }
    for (wrong, expected) in [
        ("\"room.ambient_c\" = 0", "expected a number above 0"),
        ("\"room.size_mm.x\" = 1", "expected one of `keys`"),
    ] {
        let refused = read(wrong).unwrap_err().to_string();
        assert!(
            refused.contains(expected) && refused.contains("hint: "),
            "{refused}"
        );
    }
}

#[test]
fn unknowns_are_limited() {
    let too_many = vec![("room.ambient_c", "[15, 25]"); FITTED_MAX + 1];
    let refused = parse(&too_many).1.unwrap_err().to_string();
    assert!(
        refused.contains("17 [[uncertain]] tables of numbers, expected at most 16"),
        "{refused}"
    );
}

const TWO: &str = r#"[room]
size_mm = [4000, 6000, 2700]
ambient_c = 20

[[agent]]
name = "anna"
position_mm = [1000, 1000, 0]
person = { height_mm = 1650 }

[[agent]]
name = "b. b."
person = {}
trajectory = "walk.csv"
speed_mm_per_s = 800

[[sensor]]
name = "ceiling"
preset = "grid-eye"
position_mm = [2000, 3000, 2700]
elevation_deg = 88
azimuth_deg = -90
"#;

fn two(tables: &[(&str, &str)]) -> Result<Scene, SceneError> {
    let tables = tables
        .iter()
        .map(|(key, keys)| format!("\n[[uncertain]]\nkey = \"{key}\"\n{keys}\n"));
    let text = TWO.to_owned() + &tables.collect::<String>();
    let walk = "x_mm,y_mm,z_mm\n1000,4000,0\n3000,4000,0\n".to_owned();
    let files = BTreeMap::from([("walk.csv".to_owned(), walk)]);
    Scene::parse(&text, "room.toml", &files).map(|loaded| loaded.scene)
}

/// Place, wander, its time, contrast.
fn of_agents(laws: &Laws) -> Vec<[f64; 4]> {
    let of = |one: &AgentLaws| {
        [
            one.place_sd_m,
            one.wander_sd_m,
            one.wander_over_s,
            one.contrast_sd,
        ]
    };
    laws.agents.iter().map(of).collect()
}

#[test]
fn without_tables_laws_are_the_defaults_with_their_source() {
    let laws = two(&[]).unwrap().laws();
    // A standing agent does not wander.
    let defaults = [[0.07, 0.0, 0.7, 0.35], [0.07, 0.07, 0.7, 0.35]];
    assert_eq!(of_agents(&laws), defaults);
    assert_eq!((laws.lag_sd_s, laws.background_sd_c), (0.07, None));
    assert_eq!(laws.numbers, []);
    let source = laws.source.join("\n");
    for words in [
        "delay: sd 0.07 s by default",
        "`anna`, `b. b.`, place: sd 0.07 m",
        "\n`b. b.`, wander",
        "contrast: sd 0.35 of its logarithm",
        "doi 10.1109/JIOT.2022.3161646",
    ] {
        assert!(source.contains(words), "{words}: {source}");
    }
}

#[test]
fn tables_of_one_agent_come_before_those_of_all_and_both_before_the_defaults() {
    let scene = two(&[
        ("agent.b. b..wander_m", "sd = 0.1\nover_s = 2"),
        ("agent.*.wander_m", "sd = 0.02"),
        ("agent.anna.aside_m", "sd = 0"),
        ("agent.*.aside_m", "sd = 0.15"),
        ("agent.*.contrast", "sd = 0.5"),
        ("room.background_c", "sd = 0.3"),
        ("recording.start_s", "sd = 0.2"),
        ("sensor.ceiling.position_mm.x", "sd = 20\nmean = 2010"),
        ("room.ambient_c", "bounds = [18, 22]"),
    ]);
    let scene = scene.unwrap();
    let laws = scene.laws();
    let expected = [[0.0, 0.0, 0.7, 0.5], [0.15, 0.1, 2.0, 0.5]];
    assert_eq!(of_agents(&laws), expected);
    assert_eq!((laws.lag_sd_s, laws.background_sd_c), (0.2, Some(0.3)));
    // A number between bounds alone has no normal law.
    let numbers: Vec<&str> = laws.numbers.iter().map(|one| one.key.as_str()).collect();
    assert_eq!(numbers, ["sensor.ceiling.position_mm.x"]);
    assert!(
        laws.source
            .contains(&"`agent.b. b..wander_m`: sd 0.1 over 2 s (room.toml:24)".to_owned())
    );
    assert!(
        !laws.source.join("\n").contains("default"),
        "{:?}",
        laws.source
    );
    let height = [("agent.anna.person.height_mm", "bounds = [1500, 1900]")];
    let source = two(&height).unwrap().laws().source;
    assert!(
        source[0].contains("height_mm`: sd 100, as of adults (ANSUR II"),
        "{source:?}"
    );
    // Only numbers, or a start between bounds, are for a calibration to find.
    let fitted = scene.uncertain().iter().filter(|one| one.is_fitted);
    let fitted: Vec<&str> = fitted.map(|one| one.key.as_str()).collect();
    assert_eq!(fitted, ["sensor.ceiling.position_mm.x", "room.ambient_c"]);
    // Of one scene without its people, none is left.
    assert_eq!(scene.without_agents().laws().agents, []);
}

/// Without bounds, those of four standard deviations, as far as the key allows.
#[test]
fn bounds_follow_the_law_and_the_scene() {
    let scene = two(&[
        ("room.ambient_c", "sd = 0.5"),
        ("sensor.ceiling.elevation_deg", "sd = 1"),
        ("sensor.ceiling.position_mm.y", "sd = 10\nmean = 2990"),
        ("agent.anna.person.height_mm", "sd = 300\nmean = 1700"),
        ("recording.start_s", "bounds = [1, 2]\nsd = 0.5\nmean = 1.5"),
        ("agent.anna.contrast", "sd = 0.1"),
    ]);
    let bounds: Vec<[f64; 2]> = scene
        .unwrap()
        .uncertain()
        .iter()
        .map(|one| one.bounds)
        .collect();
    let expected = [
        [18.0, 22.0],
        [84.0, 90.0],
        [2950.0, 3030.0],
        [500.0, 2800.0],
        [1.0, 2.0],
        [-0.4, 0.4],
    ];
    assert_eq!(bounds, expected);
}

/// Key, the table's other keys, what the error says.
fn assert_refused<const N: usize>(tables: [(&str, &str, &str); N]) {
    for (key, keys, message) in tables {
        let refused = two(&[(key, keys)]).unwrap_err().to_string();
        assert!(
            refused.contains(message) && refused.contains("\nhint: "),
            "{key}: {refused}"
        );
    }
}

#[test]
fn invalid_differences_from_the_scene_are_refused_with_their_place() {
    assert_refused([
        (
            "agent.anna.aside_m",
            "sd = 0.16",
            "room.toml:25:6: `sd` is 0.16, expected 0 to 0.15 m\nhint: a comparison that allows for more agrees with any scene; measure the place",
        ),
        ("agent.*.wander_m", "sd = -0.1", "expected 0 to 0.15 m"),
        ("agent.*.contrast", "sd = 0.6", "expected 0 to 0.5"),
        (
            "agent.anna.wander_m",
            "sd = 0.1\nover_s = 0",
            "room.toml:26:10: `over_s` is 0, expected 0.01 to 1000",
        ),
        (
            "agent.anna.aside_m",
            "sd = 0.1\nover_s = 1",
            "`over_s` is 1, expected key = \"agent.NAME.wander_m\"",
        ),
        ("room.background_c", "sd = nan", "expected a number from 0"),
        (
            "room.background_c",
            "sd = 1\nmean = 2",
            "`mean` is 2, expected only sd",
        ),
        (
            "agent.anna.contrast",
            "bounds = [0, 1]",
            "`bounds` is [0, 1], expected only sd",
        ),
        (
            "agent.anna.contrast",
            "",
            "room.toml:24:7: the [[uncertain]] table of `agent.anna.contrast` has no `sd`",
        ),
        (
            "agent.otto.contrast",
            "sd = 0.1",
            "room.toml:24:7: `key` is \"agent.otto.contrast\", but the scene has no agent `otto`\nhint: it has anna, b. b.",
        ),
        (
            "recording.start_s",
            "",
            "has no `sd`\nhint: give bounds for `grideye calibrate`",
        ),
        (
            "recording.start_s",
            "sd = 0.1\nmean = 1",
            "`mean` is 1, expected only sd",
        ),
    ]);
}

#[test]
fn invalid_laws_of_numbers_are_refused_with_their_place() {
    assert_refused([
        (
            "sensor.wall.roll_deg",
            "sd = 1",
            "but the scene has no sensor `wall`\nhint: it has ceiling",
        ),
        (
            "room.ambient_c",
            "",
            "the [[uncertain]] table of `room.ambient_c` has no `bounds`",
        ),
        (
            "room.ambient_c",
            "sd = 1\nmean = 30",
            "`mean` is 30, expected within 4 sd of 20, the scene's value",
        ),
        (
            "room.ambient_c",
            "sd = 1\nwidth = 3",
            "unknown field `width`",
        ),
        ("duration_s", "sd = 1", "expected the path of a number"),
    ]);
    // One number by two of its paths.
    let twice = [
        ("sensor.ceiling.position_mm.x", "sd = 20"),
        ("sensor.ceiling.position_mm.across", "sd = 10"),
    ];
    let refused = two(&twice).unwrap_err().to_string();
    assert!(
        refused.contains(
            "room.toml:28:7: `key` is \"sensor.ceiling.position_mm.across\", expected each key once"
        ),
        "{refused}"
    );
}

#[test]
fn the_old_name_of_the_table_is_refused_with_the_new_one() {
    let old = Scene::parse(
        &format!("{TWO}\n[[fit]]\nkey = \"room.ambient_c\"\n"),
        "room.toml",
        &BTreeMap::new(),
    );
    let refused = old.unwrap_err().to_string();
    assert_eq!(
        refused,
        "room.toml:23:3: [[fit]] is now [[uncertain]]\nhint: rename the table; its keys are the same"
    );
}

/// Against the table of the standard normal law: 97.5 % are below 1.959964, 84.13447 % below 1.
#[test]
fn quantiles_are_those_of_the_normal_law() {
    let law = Normal {
        mean: 10.0,
        sd: 2.0,
    };
    let wide = [-1e3, 1e3];
    for (share, sds) in [
        (0.975, 1.959_964),
        (0.841_344_7, 1.0),
        (0.5, 0.0),
        (0.025, -1.959_964),
    ] {
        let found = (law.quantile(wide, share) - 10.0) / 2.0;
        assert!((found - sds).abs() < 1e-5, "{share}: {found}");
    }
    // Cut at the mean, its upper half: the median is the upper quartile, 0.674490.
    let half = (law.quantile([10.0, 1e3], 0.5) - 10.0) / 2.0;
    assert!((half - 0.674_490).abs() < 1e-5, "{half}");
    assert_eq!([0.0, 1.0].map(|share| law.quantile(wide, share)), wide);
}
