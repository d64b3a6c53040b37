//! From a sensor's keys, and the preset that they name, to a sensor in the room.

use crate::file::document::SensorTable;
use crate::file::files::Files;
use crate::file::physical;
use crate::file::physical::{Given, PhysicalKeys};
use crate::file::rule::{
    AZIMUTH, ELEVATION, NOISE, OPERATING_DISTANCE, PIXELS_PER_DEGREE, RANGE, ROLL, SAMPLING,
};
use crate::file::source::Source;
use crate::geometry::count;
use crate::geometry::pose::Pose;
use crate::model::error::SceneError;
use crate::model::limits;
use crate::model::room::Room;
use crate::model::scene::Model;
use crate::model::sensor::Sensor;
use crate::profile::Profile;
use crate::text::lengths::{MM_PER_M, millimetres};
use glam::DVec2;
use glam::USizeVec2;
use toml::Spanned;
pub(crate) fn sensor(
    source: &Source<'_>,
    table: &Spanned<SensorTable>,
    room: &Room,
    files: &dyn Files,
) -> Result<Sensor, SceneError> {
    let keys = table.get_ref();
    let name = source.sensor_name(&keys.name)?;
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
    let physical = physical::keys(source, table, &given, files)?;
    let noise_sigma = noise_sigma(source, keys, (preset, &physical), sampling_hz)?;
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
        optics: physical.optics,
        pixel_width_rad: physical.pixel_width_rad,
        blur_rad: physical.blur_rad,
        profile: physical.profile,
        step_c: physical.step_c,
        name,
    })
}

/// The sensor's noise: what the file says, else what its profile has in the mean, else what its model and preset have.
fn noise_sigma(
    source: &Source<'_>,
    keys: &SensorTable,
    (preset, physical): (Option<&Preset>, &PhysicalKeys),
    sampling_hz: f64,
) -> Result<Option<f64>, SceneError> {
    let given = source.optional(keys.noise_sigma_c.as_ref(), &NOISE)?;
    let of_profile = physical.profile.as_ref().map(Profile::sigma_c);
    let of_preset = preset.map(|preset| match (source.model, preset.netd_at_1_hz_c) {
        (Model::Physical, Some(at_1_hz_c)) => physical::netd_c(at_1_hz_c, sampling_hz),
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
            + physical::turned_deg(source, keys.pixel_1.as_ref())?,
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

/// PeerJ CS 11:e3124, "Perceived temperature calculation": "default: 5 m".
const OPERATING_DISTANCE_DEFAULT_MM: f64 = 5000.0;

/// The same, "Sensor model implementation": 5 is the default.
const PIXELS_PER_DEGREE_DEFAULT: f64 = 5.0;
