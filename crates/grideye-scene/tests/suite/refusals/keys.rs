//! Keys and values of a scene file.

use super::*;

const SPELLING_AND_TYPES: &[Case] = &[
    (
        "ambient_c = 20",
        "ambient_c = 20\nambiant = 3",
        "room.toml:4:1: unknown field `ambiant`, expected one of `size_mm`, `plan_mm`, `height_mm`, `vertices_mm`, `faces`, `file`, `unit_mm`, `ambient_c`, `reflected_c`\n\
         hint: correct the spelling or remove the key; scenes/KEYS.md describes every key",
    ),
    (
        "preset = \"grid-eye\"",
        "presset = \"grid-eye\"",
        "room.toml:20:1: unknown field `presset`, expected one of `name`, `preset`, `position_mm`, `elevation_deg`, `azimuth_deg`, `roll_deg`, `tilt_deg`, `resolution`, `fov_deg`, `pixels_per_degree`, `noise_sigma_c`, `sampling_hz`, `operating_distance_mm`, `detectable_range_c`, `optics`, `pixel_width_deg`, `blur_deg`, `blur_px`, `spill`, `spill_px`, `profile`, `step_c`, `pixel_1`\n\
         hint: correct the spelling or remove the key; scenes/KEYS.md describes every key",
    ),
    (
        "[[object]]",
        "[[objct]]",
        "room.toml:5:3: unknown field `objct`, expected one of `model`, `law`, `band_um`, `collisions`, `duration_s`, `paper_experiment`, `room`, `object`, `mosaic`, `agent`, `sensor`, `uncertain`, `calibrated`, `vary`\n\
         hint: correct the spelling or remove the key; scenes/KEYS.md describes every key",
    ),
    (
        "[room]",
        "paper_experiment = 5\n[room]",
        "room.toml:1:20: `paper_experiment` is 5, expected 1, 2, 3 or 4\n\
         hint: the paper's experiment that this scene reproduces; omit it in your own scenes",
    ),
    (
        "ambient_c = 20\n",
        "",
        "room.toml:1:1: missing field `ambient_c`\n\
         hint: add the key to this table; scenes/KEYS.md describes every key",
    ),
    (
        "temperature_c = 28\n",
        "",
        "room.toml:11:1: agent `person` has no `temperature_c`\n\
         hint: give the body's size_mm and temperature_c, or [[agent.part]] tables",
    ),
    (
        "ambient_c = 20",
        "ambient_c = \"warm\"",
        "room.toml:3:13: `ambient_c`: invalid type: string \"warm\", expected a number\n\
         hint: scenes/KEYS.md gives each key's type; objects, agents and sensors are written [[object]], [[agent]], [[sensor]]",
    ),
    (
        "ambient_c = 20",
        "ambient_c = 20 21",
        "room.toml:3:13: `ambient_c`: string values must be quoted, expected literal string\n\
         hint: the file must be TOML: text in quotes, every key once, lists in brackets",
    ),
    (
        "ambient_c = 20",
        "ambient_c = 20\nambient_c = 21",
        "room.toml:4:1: duplicate key\n\
         hint: the file must be TOML: text in quotes, every key once, lists in brackets",
    ),
    (
        "[4000, 6000, 2700]",
        "[4000, 6000]",
        "room.toml:2:11: `size_mm`: invalid length 2, expected a list of 3 numbers\n\
         hint: scenes/KEYS.md gives each key's type; objects, agents and sensors are written [[object]], [[agent]], [[sensor]]",
    ),
    (
        "[4000, 6000, 2700]",
        "[4000, 6000, 2700, 1]",
        "room.toml:2:11: `size_mm`: invalid length 4, expected a list of 3 numbers\n\
         hint: scenes/KEYS.md gives each key's type; objects, agents and sensors are written [[object]], [[agent]], [[sensor]]",
    ),
    (
        "[[agent]]",
        "[agent]",
        "room.toml:11:1: invalid type: map, expected a sequence\n\
         hint: scenes/KEYS.md gives each key's type; objects, agents and sensors are written [[object]], [[agent]], [[sensor]]",
    ),
    (
        "azimuth_deg = -90",
        "azimuth_deg = -90\nfov_deg = [60, 60, 60]",
        "room.toml:24:11: `fov_deg`: invalid length 3, expected a list of 2 numbers\n\
         hint: scenes/KEYS.md gives each key's type; objects, agents and sensors are written [[object]], [[agent]], [[sensor]]",
    ),
    (
        "azimuth_deg = -90",
        "azimuth_deg = -90\nfov_deg = [60]",
        "room.toml:24:11: `fov_deg`: invalid length 1, expected a list of 2 numbers\n\
         hint: scenes/KEYS.md gives each key's type; objects, agents and sensors are written [[object]], [[agent]], [[sensor]]",
    ),
    (
        "azimuth_deg = -90",
        "azimuth_deg = -90\nfov_deg = true",
        "room.toml:24:11: `fov_deg`: invalid type: boolean `true`, expected a number, or a list of 2 numbers\n\
         hint: scenes/KEYS.md gives each key's type; objects, agents and sensors are written [[object]], [[agent]], [[sensor]]",
    ),
    (
        "azimuth_deg = -90",
        "azimuth_deg = -90\nresolution = [8.5, 8]",
        "room.toml:24:15: `resolution`: invalid type: floating point `8.5`, expected a whole number\n\
         hint: scenes/KEYS.md gives each key's type; objects, agents and sensors are written [[object]], [[agent]], [[sensor]]",
    ),
];

#[test]
fn misspelled_and_mistyped_keys_are_refused() {
    assert_refused(SPELLING_AND_TYPES);
}

const VALUES: &[Case] = &[
    (
        "[room]",
        "model = \"physics\"\n[room]",
        "room.toml:1:9: `model` is \"physics\", expected \"paper\", \"paper-grid\" or \"physical\"\n\
         hint: paper is the default; scenes/PHYSICS.md says when to use which",
    ),
    (
        "[room]",
        "law = \"C\"\n[room]",
        "room.toml:1:7: `law` is \"C\", expected \"A\" or \"B\"\n\
         hint: B is the default; scenes/PHYSICS.md has both formulas",
    ),
    (
        "ambient_c = 20",
        "ambient_c = nan",
        "room.toml:3:13: `ambient_c` is nan, expected °C above absolute zero (-273.15) and up to 5000\n\
         hint: temperatures are degrees Celsius, not kelvin or raw counts",
    ),
    (
        "ambient_c = 20",
        "ambient_c = -273.15",
        "room.toml:3:13: `ambient_c` is -273.15, expected °C above absolute zero (-273.15) and up to 5000\n\
         hint: temperatures are degrees Celsius, not kelvin or raw counts",
    ),
    (
        "temperature_c = 28",
        "temperature_c = -300",
        "room.toml:14:17: `temperature_c` is -300, expected °C above absolute zero (-273.15) and up to 5000\n\
         hint: temperatures are degrees Celsius, not kelvin or raw counts",
    ),
    (
        "temperature_c = 28",
        "temperature_c = inf",
        "room.toml:14:17: `temperature_c` is inf, expected °C above absolute zero (-273.15) and up to 5000\n\
         hint: temperatures are degrees Celsius, not kelvin or raw counts",
    ),
    (
        "temperature_c = 28",
        "temperature_c = 28\nemissivity = 0",
        "room.toml:15:14: `emissivity` is 0, expected a number above 0 and up to 1\n\
         hint: skin has 0.98, cloth 0.9 to 0.95, the paper uses 0.8",
    ),
    (
        "temperature_c = 28",
        "temperature_c = 28\nemissivity = 1.01",
        "room.toml:15:14: `emissivity` is 1.01, expected a number above 0 and up to 1\n\
         hint: skin has 0.98, cloth 0.9 to 0.95, the paper uses 0.8",
    ),
    (
        "[1600, 1600, 750]",
        "[1600, -1600, 750]",
        "room.toml:8:11: `size_mm` is [1600, -1600, 750], expected three lengths above 0 and up to 1000000 mm\n\
         hint: sizes are [x, y, z] in millimeters before rotation",
    ),
    (
        "[1600, 1600, 750]",
        "[1600, 0, 750]",
        "room.toml:8:11: `size_mm` is [1600, 0, 750], expected three lengths above 0 and up to 1000000 mm\n\
         hint: sizes are [x, y, z] in millimeters before rotation",
    ),
    (
        "[1600, 1600, 750]",
        "[1600, nan, 750]",
        "room.toml:8:11: `size_mm` is [1600, nan, 750], expected three lengths above 0 and up to 1000000 mm\n\
         hint: sizes are [x, y, z] in millimeters before rotation",
    ),
    (
        "[2000, 3000, 0]",
        "[2000, inf, 0]",
        "room.toml:7:15: `position_mm` is [2000, inf, 0], expected three coordinates of at most 1000000 mm\n\
         hint: positions are [x, y, z] in millimeters from the room's bottom-left corner",
    ),
];

#[test]
fn values_outside_their_range_are_refused() {
    assert_refused(VALUES);
}

const NAMES_AND_COUNTS: &[Case] = &[
    (
        "name = \"person\"",
        "name = \"table\"",
        "room.toml:12:8: the name `table` is taken by line 6\n\
         hint: give each object and agent its own name",
    ),
    (
        "name = \"person\"",
        "name = \"\"",
        "room.toml:12:8: `name` is \"\", expected 1 to 100 visible characters\n\
         hint: names appear in messages, reports and file names",
    ),
    (
        "name = \"person\"",
        "name = \"a\\nb\"",
        "room.toml:12:8: `name` is \"a\\nb\", expected 1 to 100 visible characters\n\
         hint: names appear in messages, reports and file names",
    ),
    (
        "name = \"ceiling\"",
        "name = \"right arm\"",
        "room.toml:19:8: `name` is \"right arm\", expected a name of 1 to 64 characters A-Z a-z 0-9 . _ : - that begins with a letter or a digit\n\
         hint: a sensor's name goes into its recordings; write `-` instead of a space, as in right-arm",
    ),
    (
        "[[sensor]]\nname = \"ceiling\"\n",
        "[[sensor]]\nname = \"ceiling\"\npreset=\"grid-eye\"\nposition_mm=[1,1,1]\nelevation_deg=0\nazimuth_deg=0\n[[sensor]]\nname = \"ceiling\"\n",
        "room.toml:25:8: the name `ceiling` is taken by line 19\n\
         hint: give each sensor its own name",
    ),
    (
        "[[agent]]\n",
        "[[agent]]\nname = \"second\"\ntemperature_c = 1\nposition_mm = [9, 9, 0]\n[[agent.part]]\nname = \"head\"\nposition_mm = [0, 0, 0]\nsize_mm = [1, 1, 1]\n[[agent]]\n",
        "room.toml:11:1: agent `second` has both `temperature_c` and `part`\n\
         hint: an agent with parts has a name, parts and a position or a trajectory; all other keys go into its parts",
    ),
    (
        "[[agent]]\n",
        "[[agent]]\nname = \"second\"\nposition_mm = [9, 9, 0]\n[[agent.part]]\nname = \"head\"\nposition_mm = [0, 0, 0]\nsize_mm = [1, 1, 1]\n[[agent.part]]\nname = \"head\"\nposition_mm = [0, 0, 0]\nsize_mm = [1, 1, 1]\n[[agent]]\n",
        "room.toml:19:8: the name `head` is taken by line 15\n\
         hint: give each part of an agent its own name",
    ),
];

#[test]
fn names_are_unique_and_counts_are_bounded() {
    assert_refused(NAMES_AND_COUNTS);
}

const SENSORS: &[Case] = &[
    (
        "[2000, 3000, 2700]",
        "[2000, 3000, 2700.5]",
        "room.toml:21:15: sensor `ceiling` at [2000, 3000, 2700.5] mm is outside the room of [4000, 6000, 2700] mm\n\
         hint: the room's origin is its bottom-left corner; move the sensor or enlarge the room",
    ),
    (
        "[200, 500, 1750]",
        "[200, 500, 1750]\nyaw_deg = 400",
        "room.toml:14:11: `yaw_deg` is 400, expected -360 to 360\n\
         hint: angles are degrees, counter-clockwise as seen from above",
    ),
    (
        "preset = \"grid-eye\"",
        "preset = \"leopard\"",
        "room.toml:20:10: `preset` is \"leopard\", expected \"grid-eye\" or \"grid-eye-wide\" or \"lepton\"\n\
         hint: or omit it and give resolution, fov_deg, noise_sigma_c and sampling_hz",
    ),
    (
        "preset = \"grid-eye\"\n",
        "",
        "room.toml:18:1: sensor `ceiling` has no `resolution`\n\
         hint: give the key, or preset = \"grid-eye\", which has it",
    ),
    (
        "elevation_deg = 90",
        "elevation_deg = 90.5",
        "room.toml:22:17: `elevation_deg` is 90.5, expected -90 to 90\n\
         hint: 90 looks straight down, 0 is level, -90 looks straight up",
    ),
    (
        "azimuth_deg = -90",
        "azimuth_deg = -400",
        "room.toml:23:15: `azimuth_deg` is -400, expected -360 to 360\n\
         hint: angles are degrees, counter-clockwise as seen from above",
    ),
    (
        "azimuth_deg = -90",
        "azimuth_deg = -90\nroll_deg = nan",
        "room.toml:24:12: `roll_deg` is nan, expected -360 to 360\n\
         hint: angles are degrees, clockwise as seen from behind the sensor",
    ),
    (
        "azimuth_deg = -90",
        "azimuth_deg = -90\nfov_deg = 180",
        "room.toml:24:11: `fov_deg` is 180, expected a full angle between 0 and 180, both excluded\n\
         hint: the Grid-EYE has 60",
    ),
    (
        "azimuth_deg = -90",
        "azimuth_deg = -90\nfov_deg = [60, 0]",
        "room.toml:24:11: `fov_deg` is [60, 0], expected a full angle between 0 and 180, both excluded\n\
         hint: the Grid-EYE has 60",
    ),
    (
        "azimuth_deg = -90",
        "azimuth_deg = -90\nresolution = [8, 0]",
        "room.toml:24:14: `resolution` is [8, 0], expected [columns, rows], each 1 to 1024\n\
         hint: the Grid-EYE has [8, 8]",
    ),
    (
        "azimuth_deg = -90",
        "azimuth_deg = -90\nresolution = [-8, 8]",
        "room.toml:24:14: `resolution` is [-8, 8], expected [columns, rows], each 1 to 1024\n\
         hint: the Grid-EYE has [8, 8]",
    ),
    (
        "azimuth_deg = -90",
        "azimuth_deg = -90\nresolution = [8, 1025]",
        "room.toml:24:14: `resolution` is [8, 1025], expected [columns, rows], each 1 to 1024\n\
         hint: the Grid-EYE has [8, 8]",
    ),
    (
        "azimuth_deg = -90",
        "azimuth_deg = -90\npixels_per_degree = 0",
        "room.toml:24:21: `pixels_per_degree` is 0, expected a number above 0 and up to 10000\n\
         hint: the paper uses 5",
    ),
    (
        "azimuth_deg = -90",
        "azimuth_deg = -90\npixels_per_degree = 35",
        "room.toml:24:21: `pixels_per_degree` is 35, expected a grid of at most 2048 x 2048 points, not 2100 x 2100\n\
         hint: the paper uses 5",
    ),
    (
        "azimuth_deg = -90",
        "azimuth_deg = -90\nnoise_sigma_c = -0.1",
        "room.toml:24:17: `noise_sigma_c` is -0.1, expected 0 to 1000 °C\n\
         hint: the paper uses 0.2 for the Grid-EYE and 1.6 for the Lepton; 0 for no noise",
    ),
    (
        "azimuth_deg = -90",
        "azimuth_deg = -90\nsampling_hz = 0",
        "room.toml:24:15: `sampling_hz` is 0, expected 0.001 to 10000 frames per second\n\
         hint: the Grid-EYE has 1 or 10",
    ),
    (
        "azimuth_deg = -90",
        "azimuth_deg = -90\noperating_distance_mm = 1",
        "room.toml:24:25: `operating_distance_mm` is 1, expected 10 to 1000000 mm\n\
         hint: the paper uses 5000",
    ),
];

#[test]
fn impossible_sensors_are_refused() {
    assert_refused(SENSORS);
}

const WAYS: &[Case] = &[
    (
        "speed_mm_per_s = 800\n",
        "",
        "room.toml:15:14: agent `person` has no `speed_mm_per_s`\n\
         hint: a person walks at 500 to 1500 mm/s; the paper's examples have 800 and 1600",
    ),
    (
        "speed_mm_per_s = 800",
        "speed_mm_per_s = 0",
        "room.toml:16:18: `speed_mm_per_s` is 0, expected a speed above 0 and up to 100000 mm/s\n\
         hint: a person walks at 500 to 1500 mm/s; omit trajectory and speed if the agent stands still",
    ),
    (
        "speed_mm_per_s = 800",
        "speed_mm_per_s = 1e-9",
        "room.toml:16:18: `speed_mm_per_s` is 1e-9, expected a speed at which the path takes at most 366 days\n\
         hint: a person walks at 500 to 1500 mm/s; omit trajectory and speed if the agent stands still",
    ),
    (
        "trajectory = \"walks/walk.csv\"\n",
        "",
        "room.toml:11:1: agent `person` has no `position_mm`\n\
         hint: give position_mm if it stands still, or trajectory and speed_mm_per_s if it walks",
    ),
    (
        "trajectory = \"walks/walk.csv\"",
        "position_mm = [1000, 1000, 0]",
        "room.toml:16:18: agent `person` has no `trajectory`\n\
         hint: only an agent with a trajectory has a speed",
    ),
    (
        "trajectory = \"walks/walk.csv\"\nspeed_mm_per_s = 800",
        "position_mm = [100, 200, 0]",
        "room.toml:15:15: agent `person` leaves the room of [4000, 6000, 2700] mm: its body reaches from [0, -50, 0] to [200, 450, 1750] mm there\n\
         hint: a position is the center of the base; move the waypoint or shrink the body",
    ),
    (
        "trajectory = \"walks/walk.csv\"",
        "trajectory = \"walks/walk.csv\"\nposition_mm = [1000, 1000, 0]",
        "room.toml:11:1: agent `person` has both `position_mm` and `trajectory`\n\
         hint: an agent that walks starts at the first row of its trajectory",
    ),
    (
        "\"walks/walk.csv\"",
        "\"walks/other.csv\"",
        "room.toml:15:14: cannot read the trajectory `walks/other.csv`: no such file in the map\n\
         hint: the path is relative to the scene file's folder",
    ),
    (
        "\"walks/walk.csv\"",
        "\"../walk.csv\"",
        "room.toml:15:14: `trajectory` is \"../walk.csv\", expected a path with / below the scene file's folder\n\
         hint: put the file beside the scene, as in trajectory = \"trajectories/walk.csv\"",
    ),
    (
        "\"walks/walk.csv\"",
        "\"/etc/passwd\"",
        "room.toml:15:14: `trajectory` is \"/etc/passwd\", expected a path with / below the scene file's folder\n\
         hint: put the file beside the scene, as in trajectory = \"trajectories/walk.csv\"",
    ),
    (
        "\"walks/walk.csv\"",
        "\"\"",
        "room.toml:15:14: `trajectory` is \"\", expected a path with / below the scene file's folder\n\
         hint: put the file beside the scene, as in trajectory = \"trajectories/walk.csv\"",
    ),
];

#[test]
fn agents_stay_in_the_room_and_arrive() {
    assert_refused(WAYS);
}
