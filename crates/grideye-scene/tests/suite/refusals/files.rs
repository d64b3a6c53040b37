//! Mistakes in rows of trajectories and in whole files.

use super::*;

/// A trajectory and the message.
const ROWS: &[(&str, &str)] = &[
    (
        "",
        "walks/walk.csv:1:1: found an empty file, expected the header `x_mm,y_mm,z_mm` and at least one waypoint\n\
         hint: a trajectory has the columns x_mm, y_mm, and optionally z_mm, t_s or utc, dwell_s and posture, in any order, and one waypoint per row",
    ),
    (
        "x_mm,y_mm,z_mm\n",
        "walks/walk.csv:1:1: found a header and no row, expected the header `x_mm,y_mm,z_mm` and at least one waypoint\n\
         hint: a trajectory has the columns x_mm, y_mm, and optionally z_mm, t_s or utc, dwell_s and posture, in any order, and one waypoint per row",
    ),
    (
        "1000,1000,0\n2000,1000,0\n",
        "walks/walk.csv:1:1: found the column `1000`, expected only x_mm, y_mm, z_mm, t_s, utc, dwell_s, posture\n\
         hint: a trajectory has the columns x_mm, y_mm, and optionally z_mm, t_s or utc, dwell_s and posture, in any order, and one waypoint per row",
    ),
    (
        "x,y,z\n1,2,3\n",
        "walks/walk.csv:1:1: found the column `x`, expected only x_mm, y_mm, z_mm, t_s, utc, dwell_s, posture\n\
         hint: a trajectory has the columns x_mm, y_mm, and optionally z_mm, t_s or utc, dwell_s and posture, in any order, and one waypoint per row",
    ),
    (
        "x_mm,y_mm,confidence\n1,2,0.9\n",
        "walks/walk.csv:1:11: found the column `confidence`, expected only x_mm, y_mm, z_mm, t_s, utc, dwell_s, posture\n\
         hint: a trajectory has the columns x_mm, y_mm, and optionally z_mm, t_s or utc, dwell_s and posture, in any order, and one waypoint per row",
    ),
    (
        "z_mm,x_mm,t_s\n1,2,3\n",
        "walks/walk.csv:1:1: found no column `y_mm`, expected x_mm and y_mm\n\
         hint: a trajectory has the columns x_mm, y_mm, and optionally z_mm, t_s or utc, dwell_s and posture, in any order, and one waypoint per row",
    ),
    (
        "x_mm,y_mm,dwell_s,x_mm\n1,2,3,4\n",
        "walks/walk.csv:1:19: found the column `x_mm` again, expected each column once\n\
         hint: a trajectory has the columns x_mm, y_mm, and optionally z_mm, t_s or utc, dwell_s and posture, in any order, and one waypoint per row",
    ),
    (
        "t_s,x_mm,y_mm,utc\n1,2,3,1795600800\n",
        "walks/walk.csv:1:15: found both `t_s` and `utc`, expected one of them\n\
         hint: a trajectory has the columns x_mm, y_mm, and optionally z_mm, t_s or utc, dwell_s and posture, in any order, and one waypoint per row",
    ),
    (
        "utc,x_mm,y_mm\n2026-11-25T10:00:00,1,2\n",
        "walks/walk.csv:2:1: found `2026-11-25T10:00:00` as utc, expected a time zone\n\
         hint: a local time is ambiguous: append Z if it is UTC, or its offset, such as +01:00",
    ),
    (
        "x_mm,utc,y_mm\n1,1795600800123,2\n",
        "walks/walk.csv:2:3: found `1795600800123` as utc, expected a time stamp\n\
         hint: write 2026-11-25T10:00:00.123Z, or seconds since 1970 such as 1795600800.123, from 1970 to 2199 (Unix: from 2001), with at most nine decimals",
    ),
    (
        "x_mm,y_mm,z_mm\n1000,1000,0\n2000,1000\n",
        "walks/walk.csv:3:1: found 2 fields, expected 3 fields\n\
         hint: a trajectory has the columns x_mm, y_mm, and optionally z_mm, t_s or utc, dwell_s and posture, in any order, and one waypoint per row",
    ),
    (
        "x_mm,y_mm,z_mm\n1000,1000,0\n\n# note\n2000,1o00,0\n",
        "walks/walk.csv:5:6: found `1o00` as y_mm, expected a finite number of millimeters\n\
         hint: a trajectory has the columns x_mm, y_mm, and optionally z_mm, t_s or utc, dwell_s and posture, in any order, and one waypoint per row",
    ),
    (
        "x_mm,y_mm,z_mm\n1000,nan,0\n",
        "walks/walk.csv:2:6: found `nan` as y_mm, expected a finite number of millimeters\n\
         hint: a trajectory has the columns x_mm, y_mm, and optionally z_mm, t_s or utc, dwell_s and posture, in any order, and one waypoint per row",
    ),
    (
        "x_mm,y_mm,z_mm\n1000,1000,inf\n",
        "walks/walk.csv:2:11: found `inf` as z_mm, expected a finite number of millimeters\n\
         hint: a trajectory has the columns x_mm, y_mm, and optionally z_mm, t_s or utc, dwell_s and posture, in any order, and one waypoint per row",
    ),
    (
        "x_mm,y_mm,z_mm\n1000,1000,0\n2000,1000,0\n3950,1000,0\n",
        "walks/walk.csv:4:1: agent `person` leaves the room of [4000, 6000, 2700] mm: its body reaches from [3850, 750, 0] to [4050, 1250, 1750] mm there\n\
         hint: a position is the center of the base; move the waypoint or shrink the body",
    ),
    (
        "x_mm,y_mm,z_mm\n1000,1000,950.001\n",
        "walks/walk.csv:2:1: agent `person` leaves the room of [4000, 6000, 2700] mm: its body reaches from [900, 750, 950.001] to [1100, 1250, 2700.001] mm there\n\
         hint: a position is the center of the base; move the waypoint or shrink the body",
    ),
    (
        "x_mm,y_mm,z_mm\n1000,,0\n",
        "walks/walk.csv:2:6: found `` as y_mm, expected a finite number of millimeters\n\
         hint: a trajectory has the columns x_mm, y_mm, and optionally z_mm, t_s or utc, dwell_s and posture, in any order, and one waypoint per row",
    ),
    (
        "x_mm,y_mm,z_mm\n1000,\"1000,0\n",
        "walks/walk.csv:2:1: found 2 fields, expected 3 fields\n\
         hint: a trajectory has the columns x_mm, y_mm, and optionally z_mm, t_s or utc, dwell_s and posture, in any order, and one waypoint per row",
    ),
];

#[test]
fn trajectories_are_named_by_file_row_and_column() {
    for (walk, expected) in ROWS {
        assert_eq!(&walk_refusal(walk), expected, "with {walk}");
    }
}

#[test]
fn trajectories_from_a_spreadsheet_are_read() {
    for walk in [
        "\u{feff}x_mm,y_mm,z_mm\r\n1000,1000,0\r\n3000,1000,0\r\n",
        "x_mm, y_mm, z_mm\n1000, 1000, 0\n3e3, 1000.0, 0",
        "# way\n\n\"x_mm\",\"y_mm\",\"z_mm\"\n\"1000\",\"1000\",\"0\"\n3000,1000,0\n",
    ] {
        let loaded = load(GOOD, walk).unwrap();
        assert_eq!(loaded.scene, load(GOOD, WALK).unwrap().scene);
    }
}

#[test]
fn columns_count_characters_and_lines_may_end_as_on_windows() {
    let text = GOOD
        .replace(
            "name = \"table\"",
            "name = \"Küchentisch\" # größer\nsize = 1",
        )
        .replace('\n', "\r\n");
    let refused = load(&text, WALK).unwrap_err().to_string();
    assert!(
        refused.starts_with("room.toml:7:1: unknown field `size`"),
        "{refused}"
    );
    let text = GOOD
        .replace("[1600, 1600, 750]", "[1600, 1600, 750] # ä")
        .replace("name = \"table\"", "name = \"ä\"; x = 1");
    let refused = load(&text, WALK).unwrap_err().to_string();
    assert!(refused.starts_with("room.toml:6:11: "), "{refused}");
}

#[test]
fn an_object_outside_the_room_is_removed_and_named() {
    let high = object(
        "antenna",
        [500.0, 500.0, 2000.0],
        [100.0, 100.0, 700.5],
        0.0,
        30.0,
    );
    let turned = object(
        "bench",
        [400.0, 3000.0, 0.0],
        [1000.0, 300.0, 400.0],
        0.0,
        30.0,
    );
    let fits = object(
        "stool",
        [150.0, 3000.0, 0.0],
        [1000.0, 300.0, 400.0],
        90.0,
        30.0,
    );
    let flush = object(
        "cupboard",
        [2000.0, 5000.0, 0.0],
        [4000.0, 2000.0, 2700.0],
        0.0,
        30.0,
    );
    let text = format!("{ROOM}{CEILING}{high}{turned}{fits}{flush}");
    let loaded = Scene::parse(&text, "room.toml", &no_files).unwrap();
    let kept: Vec<&str> = loaded
        .scene
        .objects()
        .iter()
        .map(|object| object.name.as_str())
        .collect();
    assert_eq!(kept, ["stool", "cupboard"]);
    let warnings: Vec<String> = loaded.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(
        warnings,
        [
            "room.toml:11:8: object `antenna` was removed: it reaches from [450, 450, 2000] to [550, 550, 2700.5] mm, \
             beyond the room of [4000, 6000, 2700] mm\n\
             hint: a position is the center of the base; move or shrink the object",
            "room.toml:17:8: object `bench` was removed: it reaches from [-100, 2850, 0] to [900, 3150, 400] mm, \
             beyond the room of [4000, 6000, 2700] mm\n\
             hint: a position is the center of the base; move or shrink the object",
        ]
    );
}

#[test]
fn an_unknown_sensor_is_answered_with_the_known_ones() {
    let two = format!("{ROOM}{CEILING}{}", CEILING.replace("ceiling", "door"));
    let scene = Scene::parse(&two, "room.toml", &no_files).unwrap().scene;
    let refused = grideye_scene::Simulator::new(&scene, "cieling").unwrap_err();
    assert_eq!(
        refused.to_string(),
        "no sensor `cieling` in this scene\nhint: choose one of ceiling, door"
    );
    let bare = Scene::parse(ROOM, "room.toml", &no_files).unwrap().scene;
    let refused = bare.sensor("ceiling").unwrap_err();
    assert_eq!(
        refused.to_string(),
        "no sensor `ceiling` in this scene\nhint: it has none; add a [[sensor]] table"
    );
}

#[test]
fn an_empty_file_names_a_missing_key() {
    let refused = Scene::parse("", "room.toml", &no_files)
        .unwrap_err()
        .to_string();
    assert!(
        refused.starts_with("room.toml:1:1: missing field `room`\nhint: "),
        "{refused}"
    );
}
