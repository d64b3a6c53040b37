//! Scenes that vary: what is drawn, where it is inserted, and what is refused.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    clippy::as_conversions,
    reason = "a test that panics has failed, and its counts are small"
)]

mod laws;
mod tables;

use grideye_scene::{Scene, Simulator};
use grideye_variation::{Draw, Recipe, TRIES_MAX, Value, VariationError};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

const ROOM: &str = "[room]\nsize_mm = [4000, 6000, 2700]\nambient_c = 20.1\n";

const CEILING: &str = "[[sensor]]\nname = \"ceiling\"\npreset = \"grid-eye\"\n\
    position_mm = [2000, 3000, 2700]\nelevation_deg = 90\nazimuth_deg = -90\n";

fn no_files(_: &str) -> std::io::Result<String> {
    Err(std::io::ErrorKind::NotFound.into())
}

fn parsed(text: &str) -> Scene {
    Scene::parse(text, "room.toml", &no_files).unwrap().scene
}

const PEOPLE: &str = r#"
[[object]]
name = "table"
position_mm = [2000, 3000, 0]   # in the middle
size_mm = [1600, 1600, 750]

[[object]]
name = "lamp 1.5"
position_mm = [500, 500, 0]
size_mm = [100, 100, 100]
temperature_c = 60

[[agent]]
name = "person"
size_mm = [200, 500, 1750]
temperature_c = 28
position_mm = [500, 2000, 0]

[[agent]]
name = "walker"
size_mm = [200, 500, 1750]
temperature_c = 28
trajectory = "walk.csv"
speed_mm_per_s = 800
motion = "trapezoidal"
acceleration_mm_per_s2 = 1000
faces = "way"
"#;

const WALK: &str = "x_mm,y_mm,z_mm\n1000,1000,0\n3000,1000,0\n";

fn text() -> String {
    format!("{ROOM}{PEOPLE}{CEILING}")
}

fn files() -> BTreeMap<String, String> {
    BTreeMap::from([("walk.csv".to_owned(), WALK.to_owned())])
}

fn recipe(asked: &[&str]) -> Result<Recipe, VariationError> {
    let asked: Vec<String> = asked.iter().map(|asked| (*asked).to_owned()).collect();
    Recipe::new(&text(), "room.toml", &asked)
}

fn drawn(asked: &[&str], count: u64) -> Vec<Draw> {
    let recipe = recipe(asked).unwrap();
    recipe.check(&files()).unwrap();
    (0..count).map(|index| recipe.draw(1, index)).collect()
}

fn scene_of(recipe: &Recipe, index: u64) -> Scene {
    let draw = recipe.draw(1, index);
    recipe.scene(1, index, &draw, &files()).unwrap().scene
}

fn refusal(asked: &str) -> String {
    match recipe(&[asked]).and_then(|recipe| recipe.check(&files())) {
        Ok(()) => "accepted".to_owned(),
        Err(error) => error.to_string(),
    }
}

fn number(draw: &Draw, at: usize) -> f64 {
    match draw.values[at] {
        Value::Number(number) => number,
        Value::Text(_) => panic!("a number: {draw:?}"),
    }
}

#[test]
fn a_key_draws_the_same_with_other_keys_and_in_any_order() {
    let alone = drawn(&["room.ambient_c=18..26"], 50);
    let beside = drawn(&["law=A,B", "room.ambient_c=18..26", "time_s=0..9"], 50);
    for (alone, beside) in alone.iter().zip(&beside) {
        assert_eq!(alone.values[0], beside.values[1]);
        assert_eq!(alone.noise_seed, beside.noise_seed);
        assert_eq!(beside.time_s, Some(number(beside, 2)));
    }
    let seeds: BTreeSet<u64> = alone.iter().map(|draw| draw.noise_seed).collect();
    assert_eq!(seeds.len(), 50, "every frame has its own noise");
    let other = recipe(&["room.ambient_c=18..26"]).unwrap().draw(2, 0);
    assert_ne!(other.values, alone[0].values, "another seed, another draw");
    assert_ne!(other.noise_seed, alone[0].noise_seed);
}

#[test]
fn only_the_value_changes_in_the_text() {
    let before = text();
    for (asked, line) in [
        (
            "agent.person.temperature_c=31",
            "temperature_c = 31\nposition_mm = [500",
        ),
        ("agent.person.yaw_deg=45", "name = \"person\"\nyaw_deg = 45"),
        (
            "object.table.temperature_c=40",
            "name = \"table\"\ntemperature_c = 40",
        ),
        (
            "object.lamp 1.5.emissivity=0.5",
            "name = \"lamp 1.5\"\nemissivity = 0.5",
        ),
        (
            "object.table.position_mm=[2000, 3000, 10]",
            "[2000, 3000, 10]   # in the middle",
        ),
        ("agent.walker.motion=constant", "motion = \"constant\""),
        ("duration_s=5", "duration_s = 5\n[room]"),
        (
            "sensor.ceiling.position_mm.z=2650",
            "position_mm = [2000, 3000, 2650]",
        ),
        ("sensor.ceiling.noise_sigma_c=0.5", "noise_sigma_c = 0.5"),
    ] {
        let draw = recipe(&[asked]).unwrap().draw(1, 0);
        assert!(draw.text.contains(line), "{asked}:\n{}", draw.text);
        let lines: Vec<&str> = before.lines().collect();
        let changed = draw
            .text
            .lines()
            .filter(|line| !lines.contains(line))
            .count();
        assert!(changed <= 1, "{asked}:\n{}", draw.text);
    }
    assert_eq!(recipe(&[]).unwrap().draw(1, 3).text, before);
}

#[test]
fn keys_of_inline_and_nested_tables_are_found() {
    let text = format!(
        "{ROOM}{CEILING}\n[[object]]\nname = \"box\"\nposition_mm = [2000, 1000, 0]\nsize_mm = [500, 500, 500]\nfaces_c = {{ top = 30 }}\n\
         [[agent]]\nname = \"sitter\"\nposition_mm = [2000, 3000, 0]\n\
         part = [{{ name = \"head\", position_mm = [0, 0, 1000], size_mm = [200, 200, 200], temperature_c = 32 }}]\n"
    );
    let asked = [
        "object.box.faces_c.top=40..60",
        "object.box.faces_c.left=25",
        "agent.sitter.part.head.temperature_c=33",
        "agent.sitter.part.head.emissivity=0.9",
    ]
    .map(String::from);
    let recipe = Recipe::new(&text, "room.toml", &asked).unwrap();
    recipe.check(&no_files).unwrap();
    let draw = recipe.draw(1, 0);
    assert!(draw.text.contains("left = 25"), "{}", draw.text);
    let scene = recipe.scene(1, 0, &draw, &no_files).unwrap().scene;
    let head = scene.agents()[0].parts[0].surface;
    assert_eq!((head.celsius, head.emissivity), (33.0, 0.9));
}

#[test]
fn agents_placed_on_the_floor_are_in_the_room_and_do_not_collide() {
    let recipe = recipe(&["agent.person.position=floor", "agent.walker.position=floor"]).unwrap();
    let mut places = Vec::new();
    for index in 0..200 {
        let scene = scene_of(&recipe, index);
        assert_eq!(scene.contacts(), []);
        // Bodies of 200 x 500 mm beside a table of 1600 mm in the middle of 4000 x 6000 mm.
        for agent in scene.agents() {
            assert!(agent.trajectory.is_none());
            let [x, y, z] = agent.start_m.to_array();
            assert!((0.1..=3.9).contains(&x) && (0.25..=5.75).contains(&y) && z == 0.0);
            assert!(
                (x - 2.0).abs() > 0.899 || (y - 3.0).abs() > 1.049,
                "in the table: {x} {y}"
            );
            places.push((x, y));
        }
    }
    // All four quarters of the room, about equally often.
    for (right, back) in [(false, false), (false, true), (true, false), (true, true)] {
        let count = places
            .iter()
            .filter(|(x, y)| (*x > 2.0, *y > 3.0) == (right, back))
            .count();
        assert!((60..140).contains(&count), "{count} of 400 in one quarter");
    }
}

#[test]
fn agents_are_placed_only_inside_an_l_shaped_room() {
    let text = "[room]\nplan_mm = [[0, 0], [4000, 0], [4000, 2000], [2000, 2000], [2000, 6000], [0, 6000]]\nheight_mm = 2700\nambient_c = 20\n\
        [[agent]]\nname = \"a\"\nsize_mm = [200, 200, 1750]\nposition_mm = [1000, 1000, 0]\ntemperature_c = 30\n";
    let asked = ["agent.a.position=floor".to_owned()];
    let recipe = Recipe::new(text, "room.toml", &asked).unwrap();
    recipe.check(&no_files).unwrap();
    let mut arms = [0; 3];
    for index in 0..300 {
        let draw = recipe.draw(1, index);
        let scene = recipe.scene(1, index, &draw, &no_files).unwrap().scene;
        let [x, y, _] = scene.agents()[0].start_m.to_array();
        assert!(x <= 1.9 || y <= 1.9, "beyond the corner: {x} {y}");
        arms[usize::from(x > 2.0) + 2 * usize::from(y > 2.0)] += 1;
    }
    // By area, minus the bodies' own width at the walls: 1.8 x 1.8 (about), 2 x 1.8 and 1.8 x 3.9 square meters.
    assert!(arms.iter().all(|count| *count > 40), "{arms:?}");
}

#[test]
fn a_full_room_is_reported() {
    let full = text().replace("size_mm = [1600, 1600, 750]", "size_mm = [3700, 5600, 750]");
    let asked = [
        "agent.person.position=floor".to_owned(),
        "agent.walker.present=off".to_owned(),
    ];
    let recipe = Recipe::new(&full, "room.toml", &asked).unwrap();
    let error = recipe
        .scene(1, 5, &recipe.draw(1, 5), &files())
        .unwrap_err();
    let VariationError::NoPlace {
        index,
        agent,
        tries,
    } = &error
    else {
        panic!("{error}");
    };
    assert_eq!((*index, agent.as_str(), *tries), (5, "person", TRIES_MAX));
    assert!(error.to_string().contains("hint: the room is full"));
}

#[test]
fn absent_tables_are_ignored() {
    let recipe = recipe(&["object.table.present=off", "agent.walker.present=false"]).unwrap();
    let scene = scene_of(&recipe, 0);
    assert_eq!(scene.objects().len(), 1);
    assert_eq!(scene.agents().len(), 1);
    assert_eq!(recipe.agents(), ["person", "walker"]);
    let (head, tail) = PEOPLE.split_once("[[object]]\nname = \"lamp").unwrap();
    let written = PEOPLE
        .replace(head, "")
        .split("[[agent]]\nname = \"walker\"")
        .next()
        .unwrap()
        .to_owned();
    assert!(tail.len() < PEOPLE.len());
    let written = parsed(&format!("{ROOM}{written}{CEILING}"));
    let pictures = [&scene, &written].map(|scene| {
        Simulator::new(scene, "ceiling")
            .unwrap()
            .image(Duration::ZERO)
    });
    assert_eq!(pictures[0], pictures[1]);
}

#[test]
fn frames_take_the_sensors_times_in_turn() {
    let recipe = recipe(&[]).unwrap();
    let scene = scene_of(&recipe, 0);
    let sensor = scene.sensor("ceiling").unwrap();
    let count = scene.frame_count(sensor);
    assert!(count > 10);
    let time = |index| recipe.times((1, index, 1), &recipe.draw(1, index), &scene, sensor)[0];
    assert_eq!(time(0), Duration::ZERO);
    assert_eq!(time(3), sensor.frame_time(3));
    assert_eq!(time(count + 3), sensor.frame_time(3));
}

#[test]
fn visibility_is_the_share_that_nothing_hides() {
    // Seen from the side at eye level: a wall of half its height in front of the lower half of a flat, far agent.
    let wall = |z_mm: u32| {
        format!(
            "{ROOM}[[object]]\nname = \"wall\"\nposition_mm = [1000, 3000, 0]\nsize_mm = [10, 3000, {z_mm}]\n\
             [[agent]]\nname = \"a\"\nposition_mm = [3000, 3000, 500]\nsize_mm = [10, 400, 1000]\ntemperature_c = 30\n\
             [[sensor]]\nname = \"s\"\npreset = \"grid-eye\"\nposition_mm = [0, 3000, 1000]\nelevation_deg = 0\nazimuth_deg = 0\n"
        )
    };
    for on_grid in [false, true] {
        let seen = |z_mm| {
            let scene = parsed(&wall(z_mm));
            let scene = if on_grid { scene.on_grid() } else { scene };
            Simulator::new(&scene, "s")
                .unwrap()
                .labeled(Duration::ZERO, 1)
                .2[0]
                .visibility()
        };
        assert_eq!(seen(100), 1.0, "a low wall hides nothing");
        // The line of sight over the wall's far edge at 1010 mm meets the agent's face at 2995 mm.
        let edge_mm = 1000.0 - (1000.0 - 900.0) * 2995.0 / 995.0;
        let expected = (1500.0 - edge_mm) / 1000.0;
        assert!(
            (seen(900) - expected).abs() < 0.02,
            "{} {expected}",
            seen(900)
        );
        assert_eq!(seen(2000), 0.0, "a high wall hides all");
    }
}

#[test]
fn mistaken_requests_are_named() {
    for (asked, words) in [
        (
            "room.ambient_c",
            "missing `=`, and the scene has no [[uncertain]]",
        ),
        ("agent.person.position", "missing `=`"),
        ("time_s", "missing `=`"),
        ("room.ambient_c=20+-0", "write MEAN+-SD with SD above 0"),
        (
            "sensor.ceiling.elevation_deg=88+-1",
            "with sensor.ceiling.elevation_deg = 92.0: room.toml:",
        ),
        ("room.ambient_c=", "a value is missing"),
        ("room.ambient_c=26..18", "write the lower number first"),
        (
            "rom.ambient_c=18..26",
            "the scene has no `rom`\nhint: the scene has agent, object, room, sensor; besides these, time_s",
        ),
        (
            "agent.persn.yaw_deg=1",
            "the scene has no agent `persn`\nhint: it has person, walker",
        ),
        ("mosaic.rug.emissivity=1", "the scene has no `mosaic`"),
        (
            "agent.person=1",
            "name one of its keys, as in agent.person.KEY",
        ),
        ("agent=1", "agent.NAME.KEY, with person, walker"),
        ("room=1", "room.KEY"),
        (
            "room.size_mm.w=1",
            "`size_mm` is a value; name it as a whole, or one number",
        ),
        (
            "agent.person.temprature_c=28..30",
            "unknown field `temprature_c`, expected one of",
        ),
        (
            "agent.person.temperature_c=28..9000",
            "with agent.person.temperature_c = 9000.0: room.toml:",
        ),
        ("agent.person.motion=constant", "room.toml:"),
        (
            "object.table.position=floor",
            "only agents can be placed on the floor",
        ),
        (
            "agent.person.position=ceiling",
            "`position` can only be floor",
        ),
        ("agent.nobody.position=floor", "no agent `nobody`"),
        ("time_s=-1..5", "0 to 31622400 seconds"),
        ("time_s=any", "0 to 31622400 seconds"),
        ("time_s=0..31622401", "0 to 31622400 seconds"),
        (
            "agent.person.temperature_c=-9000..28",
            "with agent.person.temperature_c = -9000.0: room.toml:",
        ),
        ("sensor.ceiling.present=on,off", "unknown field `present`"),
    ] {
        let refusal = refusal(asked);
        assert!(refusal.contains(words), "{asked}: {refusal}");
        assert!(
            refusal.starts_with(&format!("`{asked}`")),
            "{asked}: {refusal}"
        );
    }
}

#[test]
fn requests_for_one_key_overlap() {
    for pair in [
        ["law=A", "law=B"],
        ["time_s=1", "time_s=2"],
        [
            "agent.person.position=floor",
            "agent.person.position_mm=[1, 2, 3]",
        ],
        [
            "agent.walker.position=floor",
            "agent.walker.motion=constant",
        ],
        ["agent.walker.position=floor", "agent.walker.position=floor"],
        [
            "sensor.ceiling.position_mm=[1000, 1000, 2700]",
            "sensor.ceiling.position_mm.z=2500",
        ],
        [
            "sensor.ceiling.position_mm.x=1000",
            "sensor.ceiling.position_mm.across=1500",
        ],
    ] {
        let error = recipe(&pair).unwrap_err().to_string();
        assert!(error.contains("overlaps"), "{pair:?}: {error}");
    }
}

#[test]
fn time_is_used_as_drawn_and_may_reach_both_ends_of_its_range() {
    assert_eq!(refusal("time_s=0..31622400"), "accepted");
    let recipe = recipe(&["time_s=1.25"]).unwrap();
    let scene = scene_of(&recipe, 7);
    let sensor = scene.sensor("ceiling").unwrap();
    let times = recipe.times((1, 7, 3), &recipe.draw(1, 7), &scene, sensor);
    assert_eq!(times, [1_250, 1_350, 1_450].map(Duration::from_millis));
}

/// Numbers stay numbers, true and false become 1 and 0, lists become one column per element, everything else becomes
/// text without quotes.
#[test]
fn columns_and_values_follow_the_choices() {
    let asked = [
        "object.table.present=on",
        "law=B",
        "agent.person.position_mm=[500, 2000..2000, 0]",
        "agent.person.faces=fixed",
    ];
    let recipe = recipe(&asked).unwrap();
    let columns: Vec<(&str, bool)> = recipe
        .columns()
        .iter()
        .map(|column| (column.name.as_str(), column.is_number))
        .collect();
    let expected = [
        ("object.table.present", true),
        ("law", false),
        ("agent.person.position_mm[0]", true),
        ("agent.person.position_mm[1]", true),
        ("agent.person.position_mm[2]", true),
        ("agent.person.faces", false),
    ];
    assert_eq!(columns, expected);
    let draw = recipe.draw(1, 0);
    let text = |text: &str| Value::Text(text.to_owned());
    let numbers = [1.0, 500.0, 2000.0, 0.0].map(Value::Number);
    let [on, x, y, z] = numbers;
    assert_eq!(draw.values, [on, text("B"), x, y, z, text("fixed")]);
    for line in [
        "\npresent = true",
        "law = \"B\"\n",
        "position_mm = [500, 2000.0, 0]\n",
        "\nfaces = \"fixed\"",
    ] {
        assert!(draw.text.contains(line), "{line}:\n{}", draw.text);
    }
    assert!(!recipe.places_agents());
}

#[test]
fn two_keys_may_be_added_at_the_same_place() {
    let recipe = recipe(&["agent.person.yaw_deg=45", "agent.person.emissivity=0.9"]).unwrap();
    let scene = scene_of(&recipe, 0);
    assert_eq!(scene.agents()[0].parts[0].surface.emissivity, 0.9);
}

/// Next to a dotted key, an added key would belong to the table above.
#[test]
fn a_key_that_would_end_up_in_another_table_is_refused() {
    let text = format!(
        "{ROOM}{CEILING}\n[[object]]\nname = \"box\"\nposition_mm = [2000, 1000, 0]\nsize_mm = [500, 500, 500]\nfaces_c.top = 30\n"
    );
    let asked = ["object.box.faces_c.left=25".to_owned()];
    let error = Recipe::new(&text, "room.toml", &asked).unwrap_err();
    let words = "cannot be added to its table";
    assert!(error.to_string().contains(words), "{error}");
}

/// A table fills the room: the error names the agent that found no place, not another placed agent.
#[test]
fn the_agent_without_a_free_place_is_named() {
    let full = text().replace("size_mm = [1600, 1600, 750]", "size_mm = [3700, 5600, 750]");
    for agents in [["person", "walker"], ["walker", "person"]] {
        let asked = agents.map(|agent| format!("agent.{agent}.position=floor"));
        let recipe = Recipe::new(&full, "room.toml", &asked).unwrap();
        assert!(recipe.places_agents());
        let error = recipe
            .scene(1, 5, &recipe.draw(1, 5), &files())
            .unwrap_err();
        let VariationError::NoPlace { agent, tries, .. } = &error else {
            panic!("{error}");
        };
        // The first agent of the scene is placed first, whatever the order of the requests.
        assert_eq!((agent.as_str(), *tries), ("person", 10_000));
    }
}

#[test]
fn a_refused_frame_is_reported_with_its_values() {
    let of = |asked: &[&str]| {
        let recipe = recipe(asked).unwrap();
        let draw = recipe.draw(1, 4);
        recipe
            .scene(1, 4, &draw, &no_files)
            .unwrap_err()
            .to_string()
    };
    let values = of(&["law=A", "room.ambient_c=21.5"]);
    assert!(
        values.starts_with("frame 4 (law = A, room.ambient_c = 21.5)"),
        "{values}"
    );
    let places = of(&["agent.person.position=floor"]);
    assert!(places.starts_with("frame 4 (only places vary)"), "{places}");
}

#[test]
fn conflicting_values_are_reported_with_their_frame() {
    // Each alone is in the room; together they are not.
    let asked = [
        "agent.person.position_mm=[3800, 2000, 0]",
        "agent.person.size_mm=[600, 500, 1750]",
    ];
    let recipe = recipe(&asked).unwrap();
    recipe.check(&files()).unwrap();
    let error = recipe
        .scene(1, 3, &recipe.draw(1, 3), &files())
        .unwrap_err()
        .to_string();
    for words in [
        "frame 3 (",
        "agent.person.size_mm[0] = 600",
        "leaves the room",
        "hint:",
    ] {
        assert!(error.contains(words), "{error}");
    }
}
