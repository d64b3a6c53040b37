//! Tests what edits change, and that they change nothing else.

use super::*;
use proptest::prelude::*;
use serde_json::{Value, json};

const TEXT: &str = "# A room, for trying.
# Its second line.

[room] # walls
size_mm = [4000, 3000, 2700] # measured
ambient_c = 20.5

# What stands about.

# The bed of the first patient.
[[object]]
name = \"bed\" # the old one
position_mm = [
    1_000, # from the left
    2000,
    0,
]
size_mm = [2000, 900, 550]
# No temperature: as warm as the room.

[[object]]
name = \"lamp\"
position_mm = [500, 500, 750]
size_mm = [100, 100, 200]
# Of what follows, or of the lamp: nobody knows.
[[agent]]
name = \"ana\"
position_mm = [2000, 1000, 0]
[[agent.part]]
name = \"trunk\"
position_mm = [0, 0, 500] # above the legs
size_mm = [180, 300, 500]

# At the ceiling.
[[sensor]]
name = \"c\"
preset = \"grid-eye\"
position_mm = [2000, 1500, 2700]
elevation_deg = 90 # straight down
azimuth_deg = -90
# The end.
";

fn made(text: &str, edit: Value) -> String {
    edited(text, &serde_json::from_value(edit).unwrap()).unwrap()
}

fn refused(text: &str, edit: Value) -> String {
    let edit = serde_json::from_value(edit).unwrap();
    edited(text, &edit).unwrap_err().to_json()["message"]
        .as_str()
        .unwrap()
        .to_owned()
}

fn parsed(text: &str) -> toml::Table {
    text.parse().unwrap()
}

#[test]
fn a_number_is_replaced_and_nothing_else() {
    let edit = json!({ "does": "set", "path": ["sensor", 0, "elevation_deg"], "to": 75.5 });
    let wanted = TEXT.replace("elevation_deg = 90 #", "elevation_deg = 75.5 #");
    assert_eq!(made(TEXT, edit), wanted);
}

#[test]
fn only_differing_list_elements_are_replaced() {
    let edit =
        json!({ "does": "set", "path": ["object", 0, "position_mm"], "to": [1000, 2050, 0] });
    assert_eq!(made(TEXT, edit), TEXT.replace("    2000,\n", "    2050,\n"));
    let one =
        json!({ "does": "set", "path": ["agent", 0, "part", 0, "position_mm", 2], "to": 600 });
    assert_eq!(
        made(TEXT, one),
        TEXT.replace("[0, 0, 500] # above", "[0, 0, 600] # above")
    );
}

#[test]
fn a_new_key_comes_last_in_its_table() {
    let edit = json!({ "does": "set", "path": ["object", 0, "yaw_deg"], "to": 45 });
    let wanted = TEXT.replace("550]\n", "550]\nyaw_deg = 45\n");
    assert_eq!(made(TEXT, edit), wanted);
    let part = json!({ "does": "set", "path": ["agent", 0, "yaw_deg"], "to": 45 });
    let wanted = TEXT.replace("[2000, 1000, 0]\n", "[2000, 1000, 0]\nyaw_deg = 45\n");
    assert_eq!(made(TEXT, part), wanted);
    let top = json!({ "does": "set", "path": ["duration_s"], "to": 10 });
    let wanted = TEXT.replace("[room]", "duration_s = 10\n\n[room]");
    assert_eq!(made(TEXT, top), wanted);
    let inline = "room = { ambient_c = 20 }\n";
    let edit = json!({ "does": "set", "path": ["room", "height_mm"], "to": 2500 });
    assert_eq!(
        made(inline, edit),
        "room = { ambient_c = 20, height_mm = 2500 }\n"
    );
}

/// A person in braces, with a table of its own, and with dotted keys.
#[test]
fn the_keys_of_a_person_are_changed_however_they_are_written() {
    let agent = "[[agent]] # who\nname = \"a\"\n";
    let braces = |keys: &str| format!("{agent}person = {keys} # tall\nyaw_deg = 90\n");
    let table = |keys: &str| format!("{agent}yaw_deg = 90\n\n[agent.person] # tall\n{keys}");
    let set = |key: &str, to: Value| json!({ "does": "set", "path": ["agent", 0, "person", key], "to": to });
    let unset = |key: &str| json!({ "does": "unset", "path": ["agent", 0, "person", key] });
    let both = "{ build = \"stout\", height_mm = 1600 }";
    for (from, edit, to) in [
        ("{}", set("height_mm", json!(1600)), "{ height_mm = 1600 }"),
        ("{ }", set("height_mm", json!(1600)), "{ height_mm = 1600 }"),
        ("{ build = \"stout\" }", set("height_mm", json!(1600)), both),
        (
            "{build=\"stout\",height_mm=1_600}",
            set("build", json!("slight")),
            "{build=\"slight\",height_mm=1_600}",
        ),
        (both, unset("height_mm"), "{ build = \"stout\" }"),
        (both, unset("build"), "{ height_mm = 1600 }"),
        ("{ height_mm = 1600 }", unset("height_mm"), "{}"),
        (
            "{ build = 1.1 }",
            set("build", json!("stout")),
            "{ build = \"stout\" }",
        ),
    ] {
        assert_eq!(made(&braces(from), edit), braces(to), "{from}");
    }
    let tall = "height_mm = 1800 # with shoes\n";
    for (from, edit, to) in [
        (
            "",
            set("posture", json!("sit")),
            "posture = \"sit\"\n".to_owned(),
        ),
        (
            tall,
            set("posture", json!("sit")),
            format!("{tall}posture = \"sit\"\n"),
        ),
        (tall, unset("height_mm"), "# with shoes\n".to_owned()),
    ] {
        assert_eq!(made(&table(from), edit), table(&to), "{from}");
    }
    let dotted = format!("{agent}person.height_mm = 1800 # with shoes\nyaw_deg = 90\n");
    let stout = dotted.replace("shoes\n", "shoes\nperson.build = \"stout\"\n");
    assert_eq!(made(&dotted, set("build", json!("stout"))), stout);
    let remarked = braces("{\n  height_mm = 1600, # barefoot\n  build = \"stout\",\n}");
    let shorter = remarked.replace("1600", "1500");
    assert_eq!(made(&remarked, set("height_mm", json!(1500))), shorter);
    let said = refused(&remarked, unset("build"));
    assert!(said.contains("would delete its comment"), "{said}");
}

#[test]
fn deleting_a_key_keeps_its_comment() {
    let edit = json!({ "does": "unset", "path": ["sensor", 0, "elevation_deg"] });
    let wanted = TEXT.replace("elevation_deg = 90 # straight", "# straight");
    assert_eq!(made(TEXT, edit), wanted);
    let bare = json!({ "does": "unset", "path": ["sensor", 0, "azimuth_deg"] });
    assert_eq!(made(TEXT, bare), TEXT.replace("azimuth_deg = -90\n", ""));
}

#[test]
fn deleting_a_table_takes_only_its_own_comments() {
    let without_bed = made(TEXT, json!({ "does": "remove", "path": ["object", 0] }));
    assert!(!without_bed.contains("first patient") && !without_bed.contains("as warm as"));
    assert!(without_bed.contains("# What stands about.\n\n[[object]]\nname = \"lamp\""));
    let without_lamp = made(TEXT, json!({ "does": "remove", "path": ["object", 1] }));
    assert!(
        without_lamp.contains("as warm as the room.\n\n# Of what follows"),
        "{without_lamp}"
    );
    let without_ana = made(TEXT, json!({ "does": "remove", "path": ["agent", 0] }));
    assert!(
        without_ana.contains("nobody knows.\n# At the ceiling."),
        "{without_ana}"
    );
    assert!(!without_ana.contains("trunk"));
    let without_sensor = made(TEXT, json!({ "does": "remove", "path": ["sensor", 0] }));
    assert!(
        without_sensor.ends_with("size_mm = [180, 300, 500]\n"),
        "{without_sensor}"
    );
}

#[test]
fn an_added_table_comes_after_the_others_of_its_kind() {
    let edit = json!({ "does": "add", "kind": "object", "name": "chair", "at_mm": [10, 20.4, 0] });
    let chair =
        "[[object]]\nname = \"chair\"\nposition_mm = [10, 20, 0]\nsize_mm = [600, 400, 500]\n";
    let wanted = TEXT.replace("200]\n# Of", &format!("200]\n\n{chair}\n# Of"));
    assert_eq!(made(TEXT, edit), wanted);
    let edit = json!({ "does": "add", "kind": "agent", "name": "bob", "at_mm": [10, 20, 0] });
    let bob = "[[agent]]\nname = \"bob\"\nposition_mm = [10, 20, 0]\nperson = {}\n";
    let wanted = TEXT.replace("300, 500]\n\n", &format!("300, 500]\n\n{bob}\n"));
    assert_eq!(made(TEXT, edit), wanted);
    let first = json!({ "does": "add", "kind": "sensor", "name": "a \"b\"", "at_mm": [1, 2, 3] });
    let text = made("[room]\nambient_c = 20", first);
    assert_eq!(parsed(&text)["sensor"][0]["name"].as_str(), Some("a \"b\""));
}

#[test]
fn a_copy_has_everything_but_the_name() {
    let edit = json!({ "does": "copy", "path": ["agent", 0], "name": "bob" });
    let text = made(TEXT, edit);
    let document = parsed(&text);
    let [ana, bob] = &document["agent"].as_array().unwrap()[..] else {
        panic!("{text}");
    };
    assert_eq!(bob["name"].as_str(), Some("bob"));
    assert_eq!(ana["part"], bob["part"]);
    assert!(
        text.contains("size_mm = [180, 300, 500]\n\n[[agent]]\nname = \"bob\""),
        "{text}"
    );
}

#[test]
fn windows_line_endings_are_preserved() {
    let text = TEXT.replace('\n', "\r\n");
    for edit in [
        json!({ "does": "set", "path": ["object", 0, "yaw_deg"], "to": 45 }),
        json!({ "does": "add", "kind": "agent", "name": "bob", "at_mm": [1, 2, 0] }),
        json!({ "does": "copy", "path": ["object", 0], "name": "other" }),
        json!({ "does": "unset", "path": ["sensor", 0, "azimuth_deg"] }),
        json!({ "does": "remove", "path": ["sensor", 0] }),
    ] {
        let made = made(&text, edit);
        assert_eq!(made.matches('\n').count(), made.matches("\r\n").count());
    }
}

#[test]
fn impossible_edits_are_rejected() {
    let inline = "object = [{ name = \"a\" }]\n";
    let apart = "[[agent]]\nname = \"a\"\n[[object]]\nname = \"o\"\n[[agent.part]]\nname = \"p\"\n";
    let of_text = r#"no object 7: { "does": "set", "path": ["object", 7, "yaw_deg"], "to": 1 }
whole table: { "does": "set", "path": ["room"], "to": 1 }
a value must be: { "does": "set", "path": ["room", "ambient_c"], "to": null }
0 steps: { "does": "set", "path": [], "to": 1 }
no object 0 yaw_deg: { "does": "unset", "path": ["object", 0, "yaw_deg"] }
not a table of a list: { "does": "remove", "path": ["room"] }"#;
    let of_inline = r#"one piece: { "does": "remove", "path": ["object", 0] }
does not allow: { "does": "add", "kind": "object", "name": "b", "at_mm": [0, 0, 0] }"#;
    for (text, refusals) in [
        (TEXT, of_text),
        (inline, of_inline),
        (
            apart,
            r#"one piece: { "does": "remove", "path": ["agent", 0] }"#,
        ),
        ("[room\n", r#": { "does": "unset", "path": ["a"] }"#),
    ] {
        for line in refusals.lines() {
            let (why, edit) = line.split_once(": ").unwrap();
            let said = refused(text, serde_json::from_str(edit).unwrap());
            assert!(said.contains(why), "{edit}: {said}");
        }
    }
}

/// All comments of a text, in order.
fn remarks(text: &str) -> Vec<String> {
    let lines = text.lines().filter_map(|line| line.split_once('#'));
    lines.map(|(_, remark)| remark.to_owned()).collect()
}

/// Paths of numbers for the edits to change.
fn paths() -> impl Strategy<Value = Value> {
    let keys = [
        json!(["room", "ambient_c"]),
        json!(["room", "size_mm", 1]),
        json!(["object", 0, "position_mm", 0]),
        json!(["object", 0, "yaw_deg"]),
        json!(["object", 1, "temperature_c"]),
        json!(["agent", 0, "part", 0, "position_mm", 2]),
        json!(["agent", 0, "yaw_deg"]),
        json!(["sensor", 0, "elevation_deg"]),
        json!(["sensor", 0, "roll_deg"]),
        json!(["duration_s"]),
    ];
    prop::sample::select(keys.to_vec())
}

fn number_at(text: &str, path: &Value) -> f64 {
    let mut value = toml::Value::Table(parsed(text));
    for step in path.as_array().unwrap() {
        value = match step.as_str() {
            Some(key) => value[key].clone(),
            None => value[usize::try_from(step.as_u64().unwrap()).unwrap()].clone(),
        };
    }
    value
        .as_float()
        .or_else(|| value.as_integer()?.to_string().parse().ok())
        .unwrap()
}

proptest! {
    /// Sets random numbers, existing and new, and adds tables in between: every comment stays, in order, and each
    /// number has its value.
    #[test]
    fn edits_keep_every_remark(
        edits in prop::collection::vec((paths(), -1e6..1e6_f64, prop::bool::ANY), 1..12),
    ) {
        let mut text = TEXT.to_owned();
        for (index, (path, number, is_whole)) in edits.iter().enumerate() {
            let number = if *is_whole { number.round() } else { *number };
            let edit = json!({ "does": "set", "path": path, "to": number });
            text = made(&text, edit);
            prop_assert_eq!(number_at(&text, path), number);
            let kind = ["object", "agent", "sensor"][index % 3];
            let name = format!("new {index}");
            text = made(&text, json!({ "does": "add", "kind": kind, "name": name, "at_mm": [number, 0, 0] }));
            prop_assert_eq!(remarks(&text), remarks(TEXT));
        }
    }

    /// Adding a table and deleting it leaves the text as it was.
    #[test]
    fn what_is_added_and_removed_leaves_no_trace(kind in prop::sample::select(vec![("object", 2), ("agent", 1), ("sensor", 1)])) {
        let (key, index) = kind;
        let with = made(TEXT, json!({ "does": "add", "kind": key, "name": "new", "at_mm": [1, 2, 3] }));
        let without = made(&with, json!({ "does": "remove", "path": [key, index] }));
        prop_assert_eq!(remarks(&without), remarks(TEXT));
        prop_assert_eq!(parsed(&without), parsed(TEXT));
    }
}
