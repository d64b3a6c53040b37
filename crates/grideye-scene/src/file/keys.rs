//! The keys of a scene file, one row each, in the order of the file.

use crate::geometry::count::float;
use crate::model::{Clothing, limits};
use crate::radiometry::ABSOLUTE_ZERO_C;
use grideye_frame::{NAME_RULE, is_name};
use grideye_text::Number::{Above, Any, Between, Integer, Whole, Within};
use grideye_text::{Kind, Number, Row, Rows, Rule, Style, rows};
use std::path::{Component, Path};

pub(crate) const STYLE: Style = Style {
    unknown: "correct the spelling or remove the key; scenes/KEYS.md describes every key",
    missing: "add the key to this table; scenes/KEYS.md describes every key",
    mistyped: "scenes/KEYS.md gives each key's type; objects, agents and sensors are written [[object]], [[agent]], [[sensor]]",
    bytes_max: (
        limits::TEXT_BYTES_MAX,
        "check that it is a scene file or a trajectory",
    ),
    ..Style::EMPTY
};

const TEMPERATURES: Number = Above(ABSOLUTE_ZERO_C, 5000.0);
const TEMPERATURE: &str = "°C above absolute zero (-273.15) and up to 5000";
const LENGTH_MAX_MM: f64 = 1_000_000.0;
const LENGTHS: Number = Above(0.0, LENGTH_MAX_MM);
const COORDINATES: Number = Within(-LENGTH_MAX_MM, LENGTH_MAX_MM);
const TURNS: Number = Within(-360.0, 360.0);
const PIXELS: Number = Integer(1.0, float(limits::PIXELS_PER_AXIS_MAX));
const SECONDS: Number = Within(0.0, limits::TIME_MAX_S);

/// A whole scene file.
pub static SCENE: Rows = Rows {
    title: "the scene",
    rows: &[rows! {
        "model" Kind::Word(&["paper", "paper-grid", "physical"]), "", "", "paper is the default; scenes/PHYSICS.md says when to use which";
        "law" Kind::Word(&["A", "B"]), "", "", "B is the default; scenes/PHYSICS.md has both formulas";
        "band_um" Kind::Rising(Within(0.1, 1000.0)), "µm", "[from, to], rising, each 0.1 to 1000 µm", "thermal sensors detect about [8, 14]; omit it for all wavelengths";
        "collisions" Kind::Word(&["warning", "error", "ignore"]), "", "", "warning is the default";
        "duration_s" Kind::Number(SECONDS), "seconds", "", "the shortest duration of the scene; agents' paths extend it";
        "paper_experiment" Kind::Number(Whole(1.0, 4.0)), "", "1, 2, 3 or 4", "the paper's experiment that this scene reproduces; omit it in your own scenes";
        "room" Kind::Table(&ROOM), "", "", "the walls, and how warm they are";
        "object" Kind::Tables(&OBJECT, limits::OBJECTS_MAX), "", "", "merge touching objects of the same temperature";
        "mosaic" Kind::Tables(&MOSAIC, usize::MAX), "", "", "adjacent cuboids, one for each number";
        "agent" Kind::Tables(&AGENT, limits::AGENTS_MAX), "", "", "write people who stand still as [[object]]";
        "sensor" Kind::Tables(&SENSOR, limits::SENSORS_MAX), "", "", "spread the sensors over several scene files";
        "uncertain" Kind::Tables(&UNCERTAIN, usize::MAX), "", "", "what is not exactly known";
        "calibrated" Kind::Tables(&CALIBRATED, usize::MAX), "", "", "which frames numbers were fitted to";
        "vary" Kind::Tables(&VARY, usize::MAX), "", "", "what varies in a dataset";
    }],
    required: &["room"],
    rules: &[],
};

/// The table `[room]`.
pub static ROOM: Rows = Rows {
    title: "the room",
    rows: &[
        rows! {
            "size_mm" Kind::List(3, LENGTHS), "mm", SIZE, SIZE_DOC;
            "plan_mm" Kind::Each(&Kind::List(2, COORDINATES)), "mm", "two coordinates of at most 1000000 mm", "a floor plan lists its corners [x, y] in the order of the walls, each once; walls meet only at their ends";
            "height_mm" Kind::Number(LENGTHS), "mm", "a height above 0 and up to 1000000 mm", "from the floor, at z = 0, to the ceiling";
        },
        SURFACE,
        rows! {
            "ambient_c" Kind::Number(TEMPERATURES), "°C", TEMPERATURE, TEMPERATURE_DOC;
            "reflected_c" Kind::Number(TEMPERATURES), "°C", TEMPERATURE, TEMPERATURE_DOC;
        },
    ],
    required: &["ambient_c"],
    rules: &[Rule::OneWay(
        "size_mm | plan_mm height_mm | vertices_mm faces | file unit_mm",
        ROOM_WAYS,
    )],
};
pub(crate) const ROOM_WAYS: &str = "a room has size_mm, or plan_mm and height_mm, or vertices_mm and faces, or file and optionally unit_mm";

const SIZE: &str = "three lengths above 0 and up to 1000000 mm";
const SIZE_DOC: &str = "sizes are [x, y, z] in millimeters before rotation";
const POSITION: &str = "three coordinates of at most 1000000 mm";
const POSITION_DOC: &str =
    "positions are [x, y, z] in millimeters from the room's bottom-left corner";
const TEMPERATURE_DOC: &str = "temperatures are degrees Celsius, not kelvin or raw counts";
const NAME: &str = "1 to 100 visible characters";
const NAME_DOC: &str = "names appear in messages, reports and file names";
const YAW_DOC: &str = "angles are degrees, counter-clockwise as seen from above";
const PITCH_DOC: &str = "angles are degrees; an object is rolled about x, pitched about y, then turned about the vertical";
const BELOW: &str = "a path with / below the scene file's folder";
const BELOW_DOC: &str =
    "put the file beside the scene, as in trajectory = \"trajectories/walk.csv\"";
const COLOR: &str = "a color as \"#rrggbb\"";
const COLOR_DOC: &str = "two hexadecimal digits each for red, green and blue";
/// By the paper's formula, which would divide by 0; the physical model knows perfect mirrors.
pub(crate) const EMISSIVITIES: Number = Above(0.0, 1.0);
const EMISSIVITY_DOC: &str = "skin has 0.98, cloth 0.9 to 0.95, the paper uses 0.8";

/// A surface by its corners, or from a file.
const SURFACE: &[Row] = rows! {
    "vertices_mm" Kind::Each(&Kind::List(3, COORDINATES)), "mm", POSITION, "vertices are [x, y, z] in millimeters from the object's own position, before rotation";
    "faces" Kind::Each(&Kind::Each(&Kind::Number(Integer(f64::MIN, f64::MAX)))), "", "lists of whole numbers", "faces are lists of vertices, counted from 0, in the order of the outline";
    "file" Kind::Text(stays_below), "", BELOW, BELOW_DOC;
    "unit_mm" Kind::Number(Within(1e-3, 1e6)), "mm", "", "an OBJ file in meters has 1000, one in millimeters 1";
};

/// The body of an object, a part or an agent.
const BODY: &[Row] = rows! {
    "size_mm" Kind::List(3, LENGTHS), "mm", SIZE, SIZE_DOC;
    "shape" Kind::Word(&["cuboid", "pyramid", "ellipsoid", "capsule", "polyhedron", "obj"]), "", "\"cuboid\", \"pyramid\", \"ellipsoid\", \"capsule\", or for objects and parts \"polyhedron\" or \"obj\"", "scenes/README.md shows each; cuboid is the default";
    "yaw_deg" Kind::Number(TURNS), "", "", YAW_DOC;
    "temperature_c" Kind::Number(TEMPERATURES), "°C", TEMPERATURE, TEMPERATURE_DOC;
    "emissivity" Kind::Number(Any), "", "a number above 0 and up to 1", EMISSIVITY_DOC;
    "surface" Kind::Word(&["skin", "hair", "clothed", "coat"]), "", "", "the outermost layer; for anything else give temperature_c and emissivity";
    "color" Kind::Text(|color| rgb(color).is_some()), "", COLOR, COLOR_DOC;
};

/// The tables `[[object]]` and `[[agent.part]]`.
pub static OBJECT: Rows = Rows {
    title: "",
    rows: &[
        rows! {
            "name" Kind::Text(is_visible), "", NAME, NAME_DOC;
            "position_mm" Kind::List(3, COORDINATES), "mm", POSITION, POSITION_DOC;
            "present" Kind::Flag, "", "", "false leaves it out of the scene";
        },
        BODY,
        SURFACE,
        rows! {
            "pitch_deg" Kind::Number(TURNS), "", "", PITCH_DOC;
            "roll_deg" Kind::Number(TURNS), "", "", PITCH_DOC;
            "faces_c" Kind::Map(&Kind::Number(TEMPERATURES)), "°C", TEMPERATURE, "as in faces_c = { top = 31.5 }; front is the side of low y before rotation";
            "gradient_c_per_m" Kind::List(3, Within(-1000.0, 1000.0)), "°C per meter", "three numbers from -1000 to 1000 °C per meter", "along the body's own x, y and z; temperature_c applies at its position";
            "texture_c" Kind::Each(&Kind::Each(&Kind::Number(TEMPERATURES))), "°C", TEMPERATURE, "the first row is at the top, or at the back if the face is level";
            "texture_on" Kind::Word(&["all", "left", "right", "front", "back", "bottom", "top"]), "", "\"all\", or of a cuboid \"left\", \"right\", \"front\", \"back\", \"bottom\" or \"top\"", "\"all\" is the default: the grid is laid over the body from above";
            "texture_filter" Kind::Word(&["nearest", "bilinear"]), "", "", "nearest is the default: each cell has one temperature";
            "time_constant_s" Kind::Number(Within(1e-3, 1e9)), "seconds", "", "the time in which an unheated object loses 63 % of its difference from ambient: a cup of tea 1800, a kettle 3600";
            "power_w" Kind::Number(Within(-1e9, 1e9)), "W", "", "heats the object while on; a negative power cools it";
            "heat_capacity_j_per_k" Kind::Number(Within(1e-3, 1e12)), "J/K", "", "a liter of water has 4186 J/K, 10 kg of steel 4600 J/K";
            "on_s" Kind::Each(&Kind::List(2, Any)), "seconds", "[[from, until], …] in seconds from 0 on, one after the other", "as in on_s = [[60, 600], [900, 1200]]";
            "material" Kind::Word(&["foam", "textile", "wood"]), "", "", "an object with a material keeps a warm print of whoever stood, sat or lay on it";
        },
    ],
    required: &["name", "position_mm"],
    rules: &[
        Rule::OneWay(
            "faces_c | gradient_c_per_m | texture_c",
            "faces, gradient and texture are alternatives; give one of them",
        ),
        Rule::Needs("texture_on texture_filter", "texture_c", WARMTH),
        Rule::Needs("power_w", "time_constant_s", WARMTH),
        Rule::Needs("power_w", "heat_capacity_j_per_k", WARMTH),
        Rule::Needs("heat_capacity_j_per_k on_s", "power_w", WARMTH),
    ],
};
const WARMTH: &str = "texture_on and texture_filter go with texture_c; power_w with time_constant_s and heat_capacity_j_per_k; on_s with power_w";

/// The tables `[[mosaic]]`.
pub static MOSAIC: Rows = Rows {
    title: "mosaic ",
    rows: &[rows! {
        "name" Kind::Text(is_visible), "", NAME, NAME_DOC;
        "position_mm" Kind::List(3, COORDINATES), "mm", POSITION, POSITION_DOC;
        "size_mm" Kind::List(3, LENGTHS), "mm", SIZE, SIZE_DOC;
        "temperatures_c" Kind::Each(&Kind::Each(&Kind::Number(TEMPERATURES))), "°C", TEMPERATURE, "one number for each cell, rows from the back to the front: [[23, 24], [25, 26]]";
        "emissivity" Kind::Number(Any), "", "a number above 0 and up to 1", EMISSIVITY_DOC;
        "color" Kind::Text(|color| rgb(color).is_some()), "", COLOR, COLOR_DOC;
        "present" Kind::Flag, "", "", "false leaves it out of the scene";
    }],
    required: &["name", "position_mm", "size_mm", "temperatures_c"],
    rules: &[],
};

/// The tables `[[agent]]`.
pub static AGENT: Rows = Rows {
    title: "agent ",
    rows: &[
        rows! {
            "name" Kind::Text(is_visible), "", NAME, NAME_DOC;
            "person" Kind::Table(&PERSON), "", "", "a body made of segments, which walks, sits and lies";
        },
        BODY,
        rows! {
            "agent.part" Kind::Tables(&OBJECT, limits::PARTS_MAX), "", "", "a mesh, shape = \"obj\", may have more faces than parts can";
            "position_mm" Kind::List(3, COORDINATES), "mm", POSITION, POSITION_DOC;
            "trajectory" Kind::Text(stays_below), "", BELOW, BELOW_DOC;
            "speed_mm_per_s" Kind::Number(Above(0.0, 100_000.0)), "mm/s", "a speed above 0 and up to 100000 mm/s", "a person walks at 500 to 1500 mm/s; omit trajectory and speed if the agent stands still";
            "motion" Kind::Word(&["constant", "trapezoidal", "minimum-jerk"]), "", "", "constant is the default; scenes/README.md describes each";
            "acceleration_mm_per_s2" Kind::Number(Above(0.0, 100_000.0)), "mm/s²", "an acceleration above 0 and up to 100000 mm/s²", "a person starting to walk accelerates at about 1000 mm/s²";
            "faces" Kind::Word(&["fixed", "way"]), "", "", "\"way\" turns the body's front, its own +x, to where it goes; \"fixed\" is the default";
            "touches" Kind::Each(&Kind::Text(|_| true)), "", "names of objects or agents of this scene", "list what the agent may touch, as in touches = [\"chair\"]";
            "present" Kind::Flag, "", "", "false leaves it out of the scene";
        },
    ],
    required: &["name"],
    rules: &[
        Rule::OneWay(
            "position_mm | trajectory",
            "an agent that walks starts at the first row of its trajectory",
        ),
        Rule::OneOf(
            "position_mm trajectory",
            "give position_mm if it stands still, or trajectory and speed_mm_per_s if it walks",
        ),
        Rule::NeedsHere(
            "speed_mm_per_s motion faces",
            "trajectory",
            "only an agent with a trajectory has a speed",
        ),
        Rule::Excludes(
            "person",
            "part size_mm shape temperature_c emissivity surface",
            "a person's body follows from height_mm, build, posture and clothing",
        ),
        Rule::Excludes(
            "part",
            "size_mm shape yaw_deg temperature_c emissivity surface color",
            "an agent with parts has a name, parts and a position or a trajectory; all other keys go into its parts",
        ),
    ],
};

/// The table `person` of an agent.
pub static PERSON: Rows = Rows {
    title: "the person",
    rows: &[rows! {
        "height_mm" Kind::Number(Within(500.0, 2800.0)), "mm", "", "a person's height when standing";
        "build" Kind::NumberOrWord(Within(0.5, 2.0), &["slight", "average", "stout"]), "", "\"slight\", \"average\", \"stout\" or 0.5 to 2", "average is the default; girths are 0.9, 1 or 1.15 times the mean adult's, or the number";
        "posture" Kind::Word(&["stand", "walk", "sit", "lie"]), "", "", "stand is the default, walk that of an agent with a trajectory";
        "clothing" Kind::NumberOrWord(Within(0.0, Clothing::CLO_MAX), &["light", "indoor", "coat"]), "clo", "\"light\", \"indoor\", \"coat\" or 0 to 4 clo", "indoor is the default; light is 0.5 clo, indoor 1 and coat 2";
    }],
    required: &[],
    rules: &[],
};

/// The tables `[[sensor]]`.
pub static SENSOR: Rows = Rows {
    title: "sensor ",
    rows: &[rows! {
        "name" Kind::Text(is_name), "", NAME_RULE, "a sensor's name goes into its recordings; write `-` instead of a space, as in right-arm";
        "preset" Kind::Word(&["grid-eye", "grid-eye-wide", "lepton"]), "", "\"grid-eye\" or \"grid-eye-wide\" or \"lepton\"", "or omit it and give resolution, fov_deg, noise_sigma_c and sampling_hz";
        "position_mm" Kind::List(3, COORDINATES), "mm", POSITION, POSITION_DOC;
        "elevation_deg" Kind::Number(Within(-90.0, 90.0)), "", "", "90 looks straight down, 0 is level, -90 looks straight up";
        "azimuth_deg" Kind::Number(TURNS), "", "", YAW_DOC;
        "roll_deg" Kind::Number(TURNS), "", "", "angles are degrees, clockwise as seen from behind the sensor";
        "tilt_deg" Kind::List(2, Within(-45.0, 45.0)), "", "two angles of -45 to 45", "[toward the image's right, toward its bottom]; larger turns are azimuth_deg and elevation_deg";
        "resolution" Kind::List(2, PIXELS), "", "[columns, rows], each 1 to 1024", "the Grid-EYE has [8, 8]";
        "fov_deg" Kind::ListOrOne(2, Between(0.0, 180.0)), "", "a full angle between 0 and 180, both excluded", "the Grid-EYE has 60";
        "pixels_per_degree" Kind::Number(Above(0.0, 10_000.0)), "", "a number above 0 and up to 10000", "the paper uses 5";
        "noise_sigma_c" Kind::Number(Within(0.0, 1000.0)), "°C", "", "the paper uses 0.2 for the Grid-EYE and 1.6 for the Lepton; 0 for no noise";
        "sampling_hz" Kind::Number(Within(0.001, 10_000.0)), "frames per second", "", "the Grid-EYE has 1 or 10";
        "operating_distance_mm" Kind::Number(Within(10.0, LENGTH_MAX_MM)), "mm", "", "the paper uses 5000";
        "detectable_range_c" Kind::Rising(TEMPERATURES), "°C", "[lowest, highest] °C, rising, above absolute zero (-273.15) and up to 5000", "the paper gives the Grid-EYE 0 to 80: [0, 80]";
        "optics" Kind::Word(&["datasheet", "pinhole"]), "", "", "datasheet uses the pixel directions of an AMG88, pinhole even steps on the image plane";
        "pixel_width_deg" Kind::ListOrOne(2, Within(0.01, 90.0)), "", "", "the full angle within which a pixel has more than half its response: about 8 for a Grid-EYE";
        "blur_deg" Kind::ListOrOne(2, Within(0.0, 90.0)), "", "", "the full width at half height of the point spread; 0 for none";
        "blur_px" Kind::ListOrOne(2, Within(0.0, 10.0)), "", "", "the full width at half height of the point spread, in pixels; 0 for none";
        "spill" Kind::Number(Within(0.0, 1.0)), "", "", "the share of each pixel's response that its neighbors get instead; 0 for none, about 0.4 for a Grid-EYE";
        "spill_px" Kind::Number(Within(0.1, 100.0)), "", "", "how far the spill reaches: the standard deviation of a Gaussian, in pixels; 1.2 if omitted";
        "profile" Kind::Text(stays_below), "", BELOW, BELOW_DOC;
        "step_c" Kind::Number(Within(0.0, 100.0)), "°C", "", "the Grid-EYE has steps of 0.25; 0 for none";
        "pixel_1" Kind::Word(&["top-left", "bottom-right"]), "", "", "where pixel 1 is in the image; a lens rotates an image but never mirrors it";
    }],
    required: &["name", "position_mm", "elevation_deg", "azimuth_deg"],
    rules: &[
        Rule::OneWayHere(
            "blur_px | blur_deg",
            "give the width of the point spread in pixels or in degrees",
        ),
        Rule::OneWayHere(
            "noise_sigma_c | profile",
            "a profile includes all of the sensor's noise",
        ),
    ],
};

/// The tables `[[uncertain]]`.
pub static UNCERTAIN: Rows = Rows {
    title: "the [[uncertain]] table of ",
    rows: &[rows! {
        "key" Kind::Text(|_| true), "", "the path of a number in this file, or recording.start_s, room.background_c, agent.NAME.aside_m, .wander_m or .contrast", "room.ambient_c, sensor.NAME.elevation_deg, sensor.NAME.position_mm.x, object.NAME.temperature_c, agent.NAME.temperature_c, agent.NAME.PART.emissivity, agent.NAME.person.height_mm; a default must be written out first: the search starts from it";
        "bounds" Kind::Rising(Number::FINITE), "", "[lowest, highest], the first below the second", "both bounds are included";
        "sd" Kind::Number(Any), "", "a number above 0", SD_DOC;
        "mean" Kind::Number(Any), "", "a number", "mean is the middle of a normal law; without a law every value between the bounds is alike";
        "over_s" Kind::Number(Within(0.01, 1000.0)), "seconds", "", "how long an error of the place lasts; 0.7 is the default";
    }],
    required: &["key"],
    rules: &[],
};
pub(crate) const SD_DOC: &str =
    "how well you know the value: its standard deviation, in the key's unit";

const FIT_DOC: &str = "`grideye calibrate` writes this table; fit again, or delete it together with the fitted values";

/// The tables `[[calibrated]]`.
pub static CALIBRATED: Rows = Rows {
    title: "the [[calibrated]] table",
    rows: &[rows! {
        "keys" Kind::Each(&Kind::Text(|_| true)), "", "a list of keys", FIT_DOC;
        "sd" Kind::Map(&Kind::Number(Above(0.0, f64::MAX))), "", "a number above 0", SD_DOC;
        "every_s" Kind::Number(SECONDS), "seconds", "", FIT_DOC;
        "frames" Kind::Text(|_| true), "", "marks of 8 hexadecimal digits, separated by spaces or new lines", FIT_DOC;
    }],
    required: &["keys", "every_s", "frames"],
    rules: &[],
};

/// The tables `[[vary]]`.
pub static VARY: Rows = Rows {
    title: "the [[vary]] table of ",
    rows: &[rows! {
        "key" Kind::Text(|_| true), "", "", "what varies, as in --vary KEY=VALUES; * in place of a name stands for all of them";
        "values" Kind::Text(|_| true), "", "", "its values; without them, by the law of its [[uncertain]] table";
        "weights" Kind::Each(&Kind::Number(Any)), "", "numbers from 0 on, not all 0", "one weight for each of the values, as in values = \"0,1,2\" and weights = [3, 2, 1]";
        "with" Kind::Text(|_| true), "", "", WITH;
        "slope" Kind::Number(Number::FINITE), "", "a number", WITH;
    }],
    required: &["key"],
    rules: &[],
};
pub(crate) const WITH: &str = "`with` names another key, and slope is added for each unit that its value is off the middle of its law";

fn is_visible(name: &str) -> bool {
    !name.trim().is_empty()
        && name.chars().count() <= limits::NAME_CHARACTERS_MAX
        && !name.contains(char::is_control)
}

fn stays_below(path: &str) -> bool {
    let mut parts = Path::new(path).components();
    let stays_below = parts.all(|part| matches!(part, Component::Normal(_)));
    !path.is_empty() && !path.contains('\\') && stays_below
}

/// The color `#rrggbb`.
pub(crate) fn rgb(color: &str) -> Option<[u8; 3]> {
    let digits = color.strip_prefix('#')?;
    let is_color = digits.len() == 6 && digits.bytes().all(|digit| digit.is_ascii_hexdigit());
    let number = u32::from_str_radix(digits, 16).ok().filter(|_| is_color)?;
    let [_, red, green, blue] = number.to_be_bytes();
    Some([red, green, blue])
}

/// The numbers that a path such as `agent.anna.person.height_mm` allows.
pub(crate) fn of_number(path: &str) -> Option<Number> {
    let parts: Vec<&str> = path.split('.').collect();
    let (last, before) = match parts.as_slice() {
        [before @ .., key, "x" | "y" | "z" | "across" | "down"] => (key, before),
        [before @ .., key] => (key, before),
        [] => return None,
    };
    let rows = match before {
        [.., "person"] if PERSON.row(last).is_some() => &PERSON,
        [kind, ..] => SCENE.below(kind)?,
        [] => &SCENE,
    };
    match *last {
        "emissivity" => Some(EMISSIVITIES),
        last => rows.row(last).or(OBJECT.row(last))?.numbers(),
    }
}
