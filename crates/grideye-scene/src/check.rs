//! From the file's tables to a scene that can be simulated, or to the error that says why not.

use crate::body;
use crate::clothes;
use crate::collision::Walls;
use crate::count;
use crate::document::{SceneTable, SensorTable};
use crate::error::{SceneError, Warning};
use crate::files::Files;
use crate::fit;
use crate::mosaic;
use crate::perceived::Law;
use crate::physical::keys::{self, Given, Unit};
use crate::plan;
use crate::pose::Pose;
use crate::profile::Profile;
use crate::residual;
use crate::room::Room;
use crate::rule::{
    AZIMUTH, DURATION, ELEVATION, NOISE, OPERATING_DISTANCE, PAPER_EXPERIMENT, PIXELS_PER_DEGREE,
    RANGE, REFLECTED, ROLL, SAMPLING, paper_experiment,
};
use crate::scene::{Body, Loaded, Model, Scene, Sensor, limits};
use crate::solid::Solid;
use crate::source::{MM_PER_M, Source};
use crate::way;
use glam::{DVec2, DVec3, USizeVec2};
use std::collections::HashSet;
use std::path::{Component, Path};
use toml::Spanned;

pub(crate) fn parse(
    model: Option<Model>,
    text: &str,
    origin: &str,
    files: &dyn Files,
) -> Result<Loaded, SceneError> {
    let mut source = Source {
        origin,
        text,
        model: Model::default(),
    };
    source.check_length()?;
    let mut tables: SceneTable = toml::from_str(text).map_err(|error| source.malformed(&error))?;
    source.check_counts(&tables)?;
    source.check_names(&tables)?;
    let of_file = keys::model(&source, tables.model.as_ref())?;
    source.model = model.unwrap_or(of_file);
    check_touches(&source, &tables)?;
    tables.leave_out_absent();
    let room = plan::room(&source, &tables.room, files)?;
    let walls = Walls::new(&room);
    let (objects, mut warnings) = objects(&source, &tables, (&room, &walls), files)?;
    let agents = collect(&tables.agent, |table| {
        way::agent(&source, table, (&room, &walls), files)
    })?;
    warnings.extend(clothes::warnings(&source, &tables));
    let sensors = collect(&tables.sensor, |table| sensor(&source, table, &room, files))?;
    let law = law(&source, tables.law.as_ref())?;
    let duration_s = source.number_or(tables.duration_s.as_ref(), &DURATION, 0.0)?;
    let experiment = source.optional(tables.paper_experiment.as_ref(), &PAPER_EXPERIMENT)?;
    let reflected = tables.room.get_ref().reflected_c.as_ref();
    let reflected_c = source.number_or(reflected, &REFLECTED, room.ambient_c)?;
    let mut scene = Scene {
        screen: room.screen(),
        room,
        objects,
        agents,
        sensors,
        model: source.model,
        law,
        band: keys::band(&source, &tables)?,
        reflected_c,
        duration_s,
        paper_experiment: experiment.and_then(paper_experiment),
        prints: Vec::new(),
    };
    scene.prints = residual::prints(&source, &scene)?;
    warnings.extend(contacts(&source, &tables, &scene)?);
    let fits = fit::fits(&source, &tables.fit)?;
    Ok(Loaded {
        scene,
        warnings,
        fits,
    })
}

/// The objects that are in the room, each mosaic as its cells, and a warning for each that is not.
fn objects(
    source: &Source<'_>,
    tables: &SceneTable,
    (room, walls): (&Room, &Walls),
    files: &dyn Files,
) -> Result<(Vec<Body>, Vec<Warning>), SceneError> {
    let (mut objects, mut warnings) = (Vec::new(), Vec::new());
    let mut keep = |object: Body, byte: usize| match beyond(&object.solid, room, walls) {
        None => objects.push(object),
        Some(reach_mm) => warnings.push(Warning::ObjectOutsideRoom {
            place: source.place(byte),
            name: object.name,
            reach_mm,
            room_mm: room.described(),
        }),
    };
    for table in &tables.object {
        let object = body::object(source, table, room.ambient_c, files)?;
        keep(object, table.get_ref().name.span().start);
    }
    let mut count = tables.object.len();
    for table in &tables.mosaic {
        let cells = mosaic::cells(source, table, count)?;
        count += cells.len();
        for cell in cells {
            keep(cell, table.get_ref().name.span().start);
        }
    }
    Ok((objects, warnings))
}

/// Who runs into what, as warnings or as the first of them as an error.
fn contacts(
    source: &Source<'_>,
    tables: &SceneTable,
    scene: &Scene,
) -> Result<Vec<Warning>, SceneError> {
    let wanted = tables.collisions.as_ref();
    let is_error = match wanted.map_or("warning", |wanted| wanted.get_ref()) {
        "warning" => false,
        "error" => true,
        "ignore" => return Ok(Vec::new()),
        _ => {
            return Err(source.refused(
                "collisions",
                wanted.map_or(0..0, Spanned::span),
                "\"warning\", \"error\" or \"ignore\"",
                "warning is the default",
            ));
        }
    };
    let mut warnings = Vec::new();
    for contact in scene.contacts() {
        let table = tables.agent.get(contact.agent);
        let start = table.map_or(0, |table| table.get_ref().name.span().start);
        let (place, names) = (source.place(start), contact.names);
        let (time, place_mm) = (contact.time, millimetres(contact.place_m));
        if is_error {
            return Err(SceneError::Collision {
                place,
                names,
                time,
                place_mm,
            });
        }
        warnings.push(Warning::Collision {
            place,
            names,
            time,
            place_mm,
        });
    }
    Ok(warnings)
}

/// A name in `touches` that nobody has would be a collision that stays, or one that is never looked for.
fn check_touches(source: &Source<'_>, tables: &SceneTable) -> Result<(), SceneError> {
    let objects = tables.object.iter().map(|table| &table.get_ref().name);
    let agents = tables.agent.iter().map(|table| &table.get_ref().name);
    let known: HashSet<&String> = objects.chain(agents).map(Spanned::get_ref).collect();
    let lists = tables
        .agent
        .iter()
        .filter_map(|table| table.get_ref().touches.as_ref());
    for name in lists.flat_map(Spanned::get_ref) {
        if !known.contains(name.get_ref()) {
            return Err(source.refused(
                "touches",
                name.span(),
                "names of objects or agents of this scene",
                "list what the agent may touch, as in touches = [\"chair\"]",
            ));
        }
    }
    Ok(())
}

fn collect<T, U>(
    tables: &[Spanned<T>],
    build: impl Fn(&Spanned<T>) -> Result<U, SceneError>,
) -> Result<Vec<U>, SceneError> {
    tables.iter().map(build).collect()
}

fn law(source: &Source<'_>, law: Option<&Spanned<String>>) -> Result<Law, SceneError> {
    match law.map(|law| (law, law.get_ref().as_str())) {
        None => Ok(Law::default()),
        Some((_, "A")) => Ok(Law::A),
        Some((_, "B")) => Ok(Law::B),
        Some((law, _)) => Err(source.refused(
            "law",
            law.span(),
            "\"A\" or \"B\"",
            "B is the default; scenes/README.md has both formulas",
        )),
    }
}

/// The text of a file that the scene names, in or below its own folder; `what` is the key and what it stands for.
pub(crate) fn read_below(
    source: &Source<'_>,
    (key, what): (&'static str, &'static str),
    path: &Spanned<String>,
    files: &dyn Files,
) -> Result<String, SceneError> {
    let relative = path.get_ref();
    let stays_below = Path::new(relative)
        .components()
        .all(|part| matches!(part, Component::Normal(_)));
    if relative.is_empty() || relative.contains('\\') || !stays_below {
        return Err(source.refused(
            key,
            path.span(),
            "a path with / below the scene file's folder",
            "put the file beside the scene, as in trajectory = \"trajectories/walk.csv\"",
        ));
    }
    let text = files
        .read(relative)
        .map_err(|error| SceneError::FileUnreadable {
            place: source.place(path.span().start),
            what,
            path: relative.clone(),
            source: error,
        })?;
    Source {
        origin: relative,
        text: &text,
        model: source.model,
    }
    .check_length()?;
    Ok(text)
}

fn sensor(
    source: &Source<'_>,
    table: &Spanned<SensorTable>,
    room: &Room,
    files: &dyn Files,
) -> Result<Sensor, SceneError> {
    let keys = table.get_ref();
    let name = source.name(&keys.name)?;
    let preset = preset(source, keys.preset.as_ref())?;
    let missing = |key| SceneError::MissingKey {
        place: source.place(table.span().start),
        table: format!("sensor `{name}`"),
        key,
        hint: "give the key, or preset = \"grid-eye\", which has it",
    };
    let resolution = source
        .resolution(keys.resolution.as_ref())?
        .or(preset.map(|preset| preset.resolution));
    let fov_deg = source
        .fov_deg(keys.fov_deg.as_ref())?
        .or(preset.map(|preset| preset.fov_deg));
    let sampling_hz = source
        .optional(keys.sampling_hz.as_ref(), &SAMPLING)?
        .or(preset.map(|preset| preset.sampling_hz));
    let resolution = resolution.ok_or_else(|| missing("resolution"))?;
    let fov_deg = fov_deg.ok_or_else(|| missing("fov_deg"))?;
    let sampling_hz = sampling_hz.ok_or_else(|| missing("sampling_hz"))?;
    let given = Given {
        name: &name,
        resolution,
        fov_deg,
        is_grid_eye: preset.is_some_and(|preset| preset.netd_at_1_hz_c.is_some()),
    };
    let unit = keys::unit(source, table, &given, files)?;
    let noise_sigma = noise_sigma(source, keys, (preset, &unit), sampling_hz)?;
    Ok(Sensor {
        columns: resolution.x,
        rows: resolution.y,
        field_of_view_rad: DVec2::new(fov_deg.x.to_radians(), fov_deg.y.to_radians()),
        grid_points: grid_points(source, table, fov_deg)?,
        noise_sigma: noise_sigma.ok_or_else(|| missing("noise_sigma_c"))?,
        sampling_hz,
        operating_distance_m: source.number_or(
            keys.operating_distance_mm.as_ref(),
            &OPERATING_DISTANCE,
            OPERATING_DISTANCE_DEFAULT_MM,
        )? / MM_PER_M,
        detectable_range_c: source.range(keys.detectable_range_c.as_ref(), &RANGE)?,
        pose: pose(source, keys, &name, room)?,
        optics: unit.optics,
        pixel_width_rad: unit.pixel_width_rad,
        blur_rad: unit.blur_rad,
        profile: unit.profile,
        step_c: unit.step_c,
        name,
    })
}

/// The sensor's noise: what the file says, else what its profile has in the mean, else what its model and preset have.
fn noise_sigma(
    source: &Source<'_>,
    keys: &SensorTable,
    (preset, unit): (Option<&Preset>, &Unit),
    sampling_hz: f64,
) -> Result<Option<f64>, SceneError> {
    let given = source.optional(keys.noise_sigma_c.as_ref(), &NOISE)?;
    let of_profile = unit.profile.as_ref().map(Profile::sigma_c);
    let of_preset = preset.map(|preset| match (source.model, preset.netd_at_1_hz_c) {
        (Model::Physical, Some(at_1_hz_c)) => keys::netd_c(at_1_hz_c, sampling_hz),
        _ => preset.noise_sigma_c,
    });
    Ok(given.or(of_profile).or(of_preset))
}

fn pose(
    source: &Source<'_>,
    keys: &SensorTable,
    name: &str,
    room: &Room,
) -> Result<Pose, SceneError> {
    let position_m = source.position_m(&keys.position_mm)?;
    if !room.contains(position_m) {
        return Err(SceneError::SensorOutsideRoom {
            place: source.place(keys.position_mm.span().start),
            name: name.to_owned(),
            found_mm: millimetres(position_m),
            room_mm: room.described(),
        });
    }
    Ok(Pose::from_degrees(
        position_m,
        source.number(&keys.elevation_deg, &ELEVATION)?,
        source.number(&keys.azimuth_deg, &AZIMUTH)?,
        source.number_or(keys.roll_deg.as_ref(), &ROLL, 0.0)?
            + keys::turned_deg(source, keys.pixel_1.as_ref())?,
    ))
}

fn grid_points(
    source: &Source<'_>,
    table: &Spanned<SensorTable>,
    fov_deg: DVec2,
) -> Result<USizeVec2, SceneError> {
    let given = table.get_ref().pixels_per_degree.as_ref();
    let per_degree = source.number_or(given, &PIXELS_PER_DEGREE, PIXELS_PER_DEGREE_DEFAULT)?;
    let points = (fov_deg * per_degree).round();
    if points.max_element() > count::float(limits::GRID_POINTS_MAX) {
        return Err(source.refused(
            "pixels_per_degree",
            given.map_or(table.span(), Spanned::span),
            &format!(
                "a grid of at most {0} x {0} points, not {1} x {2}",
                limits::GRID_POINTS_MAX,
                points.x,
                points.y
            ),
            PIXELS_PER_DEGREE.hint,
        ));
    }
    Ok(USizeVec2::new(
        count::floor(points.x).max(1),
        count::floor(points.y).max(1),
    ))
}

/// What a preset stands for; a key beside it in the file goes before it.
struct Preset {
    name: &'static str,
    resolution: USizeVec2,
    fov_deg: DVec2,
    noise_sigma_c: f64,
    /// What the physical model has instead, if the specification gives it.
    netd_at_1_hz_c: Option<f64>,
    sampling_hz: f64,
}

const GRID_EYE: Preset = Preset {
    name: "grid-eye",
    resolution: USizeVec2::splat(8),
    fov_deg: DVec2::splat(60.0),
    noise_sigma_c: 0.2,
    netd_at_1_hz_c: Some(0.05),
    sampling_hz: 10.0,
};

/// The sensors of the paper ("Experiment setup"; "Experiment 5" for the Lepton, whose own rate is 8.7 Hz, and which
/// has 50° on either axis there), and the Grid-EYE with the wide lens.
const PRESETS: [Preset; 3] = [
    GRID_EYE,
    Preset {
        name: "grid-eye-wide",
        fov_deg: DVec2::splat(90.0),
        ..GRID_EYE
    },
    Preset {
        name: "lepton",
        resolution: USizeVec2::new(80, 60),
        fov_deg: DVec2::splat(50.0),
        noise_sigma_c: 1.6,
        netd_at_1_hz_c: None,
        sampling_hz: 8.7,
    },
];

fn preset(
    source: &Source<'_>,
    name: Option<&Spanned<String>>,
) -> Result<Option<&'static Preset>, SceneError> {
    let Some(name) = name else { return Ok(None) };
    let found = PRESETS.iter().find(|preset| preset.name == name.get_ref());
    found.map(Some).ok_or_else(|| {
        let known: Vec<_> = PRESETS
            .iter()
            .map(|preset| format!("\"{}\"", preset.name))
            .collect();
        source.refused(
            "preset",
            name.span(),
            &known.join(" or "),
            "or leave it out and give resolution, fov_deg, noise_sigma_c and sampling_hz",
        )
    })
}

/// From where to where a body reaches, if it sticks out of the room or through one of its walls.
fn beyond(solid: &Solid, room: &Room, walls: &Walls) -> Option<String> {
    let inside = room.holds_corners_of(solid) && !walls.meet(solid);
    (!inside).then(|| reach(solid.bounds_m()))
}

pub(crate) fn reach((low, high): (DVec3, DVec3)) -> String {
    format!("from {} to {}", millimetres(low), millimetres(high))
}

pub(crate) fn millimetres(metres: DVec3) -> String {
    // To a thousandth: what is left of a rotation's rounding would only hide the number.
    let [x, y, z] = (metres * MM_PER_M * 1000.0)
        .round()
        .to_array()
        .map(|micrometres| micrometres / 1000.0 + 0.0);
    format!("[{x}, {y}, {z}]")
}

/// PeerJ CS 11:e3124, "Perceived temperature calculation": "default: 5 m".
const OPERATING_DISTANCE_DEFAULT_MM: f64 = 5000.0;
/// The same, "Sensor model implementation": 5 is the default.
const PIXELS_PER_DEGREE_DEFAULT: f64 = 5.0;
