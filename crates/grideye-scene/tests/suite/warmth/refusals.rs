//! Invalid keys, and limits.

use super::faces::texture;
use super::time::moving;
use super::*;

/// Keys of an object, and the start of the message.
const REFUSED: &[(&str, &str)] = &[
    (
        "faces_c = { top = 30, lid = 31 }\n",
        "room.toml:10:11: `faces_c` is { top = 30, lid = 31 }, expected left, right,",
    ),
    (
        "faces_c = { 0 = 30 }\n",
        "room.toml:10:11: `faces_c` is { 0 = 30 }, expected left, right,",
    ),
    (
        "faces_c = { top = -300 }\n",
        "room.toml:10:19: `faces_c` is -300, expected °C above",
    ),
    (
        "gradient_c_per_m = [0, 0, 1001]\n",
        "room.toml:10:20: `gradient_c_per_m` is [0, 0, 1001], expected three numbers from -1000",
    ),
    (
        "gradient_c_per_m = [0, 0, nan]\n",
        "room.toml:10:20: `gradient_c_per_m` is [0, 0, nan], expected three numbers from -1000",
    ),
    (
        "gradient_c_per_m = [0, 0, 1]\nfaces_c = { top = 3 }\n",
        "room.toml:4:1: `thing` has both `faces_c` and `gradient_c_per_m`",
    ),
    (
        "texture_c = [[1]]\nfaces_c = { top = 3 }\n",
        "room.toml:4:1: `thing` has both `faces_c` and `texture_c`",
    ),
    (
        "texture_c = []\n",
        "room.toml:10:13: `texture_c` is [], expected rows of the same number",
    ),
    (
        "texture_c = [[]]\n",
        "room.toml:10:13: `texture_c` is [[]], expected rows of the same number",
    ),
    (
        "texture_c = [[1, 2], [3]]\n",
        "room.toml:10:22: `texture_c` is [3], expected rows of the same number",
    ),
    (
        "texture_c = [[1, 6000]]\n",
        "room.toml:10:18: `texture_c` is 6000, expected °C above",
    ),
    (
        "texture_c = [[1]]\ntexture_on = \"lid\"\n",
        "room.toml:11:14: `texture_on` is \"lid\", expected \"all\", or",
    ),
    (
        "texture_c = [[1]]\ntexture_filter = \"cubic\"\n",
        "room.toml:11:18: `texture_filter` is \"cubic\", expected \"nearest\" or",
    ),
    (
        "texture_on = \"top\"\n",
        "room.toml:4:1: `thing` has no `texture_c`",
    ),
    (
        "texture_filter = \"nearest\"\n",
        "room.toml:4:1: `thing` has no `texture_c`",
    ),
    (
        "time_constant_s = 0\n",
        "room.toml:10:19: `time_constant_s` is 0, expected 0.001",
    ),
    (
        "power_w = 5\n",
        "room.toml:4:1: `thing` has no `time_constant_s`",
    ),
    (
        "time_constant_s = 5\npower_w = 5\n",
        "room.toml:4:1: `thing` has no `heat_capacity_j_per_k`",
    ),
    (
        "time_constant_s = 5\nheat_capacity_j_per_k = 5\n",
        "room.toml:4:1: `thing` has no `power_w`",
    ),
    (
        "time_constant_s = 5\non_s = [[0, 5]]\n",
        "room.toml:4:1: `thing` has no `power_w`",
    ),
    (
        "time_constant_s = 5\npower_w = 1e10\nheat_capacity_j_per_k = 1\n",
        "room.toml:11:11: `power_w` is 1e10, expected",
    ),
    (
        "time_constant_s = 5\npower_w = 5\nheat_capacity_j_per_k = 0\n",
        "room.toml:12:25: `heat_capacity_j_per_k` is 0, expected",
    ),
    (
        "time_constant_s = 5\npower_w = 5\nheat_capacity_j_per_k = 1\non_s = [[5, 9], [8, 12]]\n",
        "room.toml:13:8: `on_s` is [[5, 9], [8, 12]], expected [[from, until], …]",
    ),
    (
        "time_constant_s = 5\npower_w = 5\nheat_capacity_j_per_k = 1\non_s = [[-5, 9]]\n",
        "room.toml:13:8: `on_s` is [[-5, 9]], expected [[from, until], …]",
    ),
    (
        "material = \"steel\"\n",
        "room.toml:10:12: `material` is \"steel\", expected \"foam\", \"textile\" or",
    ),
];

#[test]
fn invalid_keys_are_refused() {
    let thing = object(
        "thing",
        [2000.0, 3000.0, 0.0],
        [600.0, 400.0, 900.0],
        0.0,
        22.0,
    );
    let refusal = |keys: &str| {
        let text = format!("{ROOM}{thing}{keys}");
        parse(&text).map_or_else(|error| error.to_string(), |_| "accepted".to_owned())
    };
    for (keys, expected) in REFUSED {
        let found = refusal(keys);
        assert!(found.starts_with(expected), "with {keys}: {found}");
        assert!(found.contains("\nhint: "), "{found}");
    }
    let part = "[[agent]]\nname = \"a\"\nposition_mm = [2000, 3000, 0]\n[[agent.part]]\nname = \"p\"\nposition_mm = [0, 0, 0]\nsize_mm = [200, 200, 200]\nmaterial = \"foam\"\n";
    let found = parse(&format!("{ROOM}{part}")).unwrap_err().to_string();
    assert!(
        found.starts_with("room.toml:7:1: part `p` has both `material` and `part`"),
        "{found}"
    );
    let found = parse(&format!("duration_s = -1\n{ROOM}"))
        .unwrap_err()
        .to_string();
    assert!(
        found.starts_with("room.toml:1:14: `duration_s` is -1, expected 0 to 31622400"),
        "{found}"
    );
}

#[test]
fn cells_and_prints_are_limited() {
    let columns = limits::TEXTURE_CELLS_MAX + 1;
    let grid = format!("texture_c = [[{}]]\n", "25, ".repeat(columns));
    let refused = parse(&format!("{ROOM}{}", texture(&grid)))
        .unwrap_err()
        .to_string();
    assert!(
        refused.contains("10001 cells of a texture, expected at most 10000"),
        "{refused}"
    );
    let most = format!("texture_c = [[{}]]\n", "25, ".repeat(columns - 1));
    assert!(parse(&format!("{ROOM}{}", texture(&most))).is_ok());

    let stops = |count: usize| {
        let rows = (0..count).map(|stop| format!("{stop},2000,3000,450,0.5\n"));
        format!("t_s,x_mm,y_mm,z_mm,dwell_s\n{}", rows.collect::<String>())
    };
    let sofa = object(
        "sofa",
        [2000.0, 3000.0, 0.0],
        [2200.0, 900.0, 450.0],
        0.0,
        20.1,
    );
    let body = "[[agent]]\nname = \"a\"\ntrajectory = \"w.csv\"\n";
    let parts: String = (0..100)
        .map(|part| format!("[[agent.part]]\nname = \"{part}\"\nposition_mm = [0, 0, 0]\nsize_mm = [200, 200, 200]\n"))
        .collect();
    let text = format!("{ROOM}{sofa}material = \"foam\"\n{body}{parts}");
    let load = |count: usize| {
        let files = BTreeMap::from([("w.csv".to_owned(), moving(&stops(count)))]);
        Scene::parse(&text, "room.toml", &files)
    };
    let refused = load(101).unwrap_err().to_string();
    assert!(
        refused.contains("10100 warm prints, expected at most 10000"),
        "{refused}"
    );
    assert!(load(100).is_ok());
}
