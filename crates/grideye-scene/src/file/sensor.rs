//! Builds a sensor from its keys and preset.

use crate::file::document::SensorTable;
use crate::file::reader::{Read, Reader};
use crate::file::rule::{
    AZIMUTH, BLUR, BLUR_PIXELS, ELEVATION, FIELD_OF_VIEW, NOISE, OPERATING_DISTANCE, PIXEL_WIDTH,
    PIXELS_PER_DEGREE, RANGE, ROLL, SAMPLING, STEP, TILT,
};
use crate::geometry::{Pose, count};
use crate::model::{Model, Optics, Room, SceneError, Sensor, limits};
use crate::profile::{Profile, ProfileError};
use crate::text::{MM_PER_M, millimeters};
use glam::{DVec2, USizeVec2};
use grideye_frame::{COLUMNS, ROWS};
use toml::Spanned;

pub(crate) fn sensor(
    reader: &Reader<'_>,
    table: &Spanned<SensorTable>,
    room: &Room,
) -> Read<Sensor> {
    let keys = table.get_ref();
    let name = reader.sensor_name(&keys.name)?;
    let title = format!("sensor `{name}`");
    let preset = preset(reader, &keys.preset)?;
    let missing = |key| {
        let hint = "give the key, or preset = \"grid-eye\", which has it";
        reader.missing(table.span().start, &title, key, hint)
    };
    let resolution = reader.resolution(&keys.resolution)?;
    let resolution = resolution.or(preset.map(|preset| preset.resolution));
    let fov_deg = reader.per_axis(&keys.fov_deg, &FIELD_OF_VIEW)?;
    let fov_deg = fov_deg.or(preset.map(|preset| preset.fov_deg));
    let sampling_hz = reader.optional(&keys.sampling_hz, &SAMPLING)?;
    let sampling_hz = sampling_hz.or(preset.map(|preset| preset.sampling_hz));
    let resolution = resolution.ok_or_else(|| missing("resolution"))?;
    let fov_deg = fov_deg.ok_or_else(|| missing("fov_deg"))?;
    let sampling_hz = sampling_hz.ok_or_else(|| missing("sampling_hz"))?;
    let radians = |degrees: DVec2| degrees.map(f64::to_radians);
    let pixel_width_deg = reader.per_axis(&keys.pixel_width_deg, &PIXEL_WIDTH)?;
    let blur_deg = blur_deg(reader, keys, &title, fov_deg / resolution.as_dvec2())?;
    let is_grid_eye = preset.is_some_and(|preset| preset.netd_at_1_hz_c.is_some());
    let is_small = resolution == USizeVec2::new(COLUMNS, ROWS);
    let is_amg88 = is_small && fov_deg == DVec2::splat(60.0);
    let optics = optics(reader, &keys.optics, (is_grid_eye, is_amg88))?;
    let profile = profile(reader, keys, &title, is_small)?;
    let step_c = reader.number_or(&keys.step_c, &STEP, 0.0)?;
    // The file's noise first, then the profile's mean, then that of the model and preset.
    let noise_sigma = reader.optional(&keys.noise_sigma_c, &NOISE)?;
    let noise_sigma = noise_sigma.or(profile.as_ref().map(Profile::sigma_c));
    let of_preset = preset.map(|preset| match (reader.model, preset.netd_at_1_hz_c) {
        (Model::Physical, Some(at_1_hz_c)) => netd_c(at_1_hz_c, sampling_hz),
        _ => preset.noise_sigma_c,
    });
    let operating = &keys.operating_distance_mm;
    Ok(Sensor {
        columns: resolution.x,
        rows: resolution.y,
        field_of_view_rad: radians(fov_deg),
        grid_points: grid_points(reader, table, fov_deg)?,
        noise_sigma: noise_sigma
            .or(of_preset)
            .ok_or_else(|| missing("noise_sigma_c"))?,
        sampling_hz,
        operating_distance_m: reader.number_or(operating, &OPERATING_DISTANCE, OPERATING_MM)?
            / MM_PER_M,
        detectable_range_c: reader.range(&keys.detectable_range_c, &RANGE)?,
        pose: pose(reader, keys, &name, room)?,
        optics,
        pixel_width_rad: pixel_width_deg.map(radians),
        blur_rad: radians(blur_deg),
        profile,
        step_c,
        name,
    })
}

/// The width of the point spread on each axis, given the size of a pixel in degrees.
fn blur_deg(reader: &Reader<'_>, keys: &SensorTable, title: &str, pixel_deg: DVec2) -> Read<DVec2> {
    if let (Some(_), Some(blur)) = (&keys.blur_deg, &keys.blur_px) {
        let hint = "give the width of the point spread in pixels or in degrees";
        return Err(reader.conflict(blur.span().start, title, ["blur_px", "blur_deg"], hint));
    }
    let in_pixels = reader.per_axis(&keys.blur_px, &BLUR_PIXELS)?;
    let in_degrees = reader.per_axis(&keys.blur_deg, &BLUR)?;
    Ok(in_degrees
        .or(in_pixels.map(|blur| blur * pixel_deg))
        .unwrap_or(DVec2::ZERO))
}

fn optics(
    reader: &Reader<'_>,
    given: &Option<Spanned<String>>,
    (is_grid_eye, is_amg88): (bool, bool),
) -> Read<Optics> {
    let choices = [("datasheet", Optics::Amg88), ("pinhole", Optics::Pinhole)];
    let hint =
        "datasheet uses the pixel directions of an AMG88, pinhole even steps on the image plane";
    let chosen = reader.choice("optics", given, &choices, hint)?;
    if let (Some(Optics::Amg88), Some(given), false) = (chosen, given, is_amg88) {
        let expected = "\"pinhole\" for a sensor without 8 x 8 pixels and 60°";
        let hint = "the datasheet's map is for the AMG88 with the 60° lens; omit optics, or omit resolution and fov_deg";
        let refused = reader.refused("optics", given.span(), expected, hint);
        return Err(refused.into());
    }
    let usual = if is_grid_eye && is_amg88 {
        Optics::Amg88
    } else {
        Optics::Pinhole
    };
    Ok(chosen.unwrap_or(usual))
}

fn profile(
    reader: &Reader<'_>,
    keys: &SensorTable,
    title: &str,
    is_small: bool,
) -> Read<Option<Profile>> {
    let Some(path) = &keys.profile else {
        return Ok(None);
    };
    if let Some(noise) = &keys.noise_sigma_c {
        let hint = "a profile includes all of the sensor's noise";
        let both = ["noise_sigma_c", "profile"];
        return Err(reader.conflict(noise.span().start, title, both, hint));
    }
    if !is_small {
        let expected = "no profile for a sensor without 8 x 8 pixels";
        let hint = "profiles are for the Grid-EYE; give noise_sigma_c instead";
        let refused = reader.refused("profile", path.span(), expected, hint);
        return Err(refused.into());
    }
    let text = reader.read_below(("profile", "profile"), path)?;
    let refused = |error: ProfileError| SceneError::Profile {
        place: reader.place(path.span().start),
        source: Box::new(error),
    };
    Profile::parse(&text, path.get_ref())
        .map(Some)
        .map_err(refused)
}

/// Noise of one pixel in one frame, °C: `0.05 √hz`, which matches the specification's 0.05 °C at 1 Hz and 0.16 °C at 10
/// Hz.
fn netd_c(at_1_hz_c: f64, sampling_hz: f64) -> f64 {
    at_1_hz_c * sampling_hz.sqrt()
}

fn pose(reader: &Reader<'_>, keys: &SensorTable, name: &str, room: &Room) -> Read<Pose> {
    let position_m = reader.position_m(&keys.position_mm)?;
    if !room.contains(position_m) {
        let (found_mm, room_mm) = (millimeters(position_m), room.described());
        let problem =
            format!("sensor `{name}` at {found_mm} mm is outside the room of {room_mm} mm");
        let hint =
            "the room's origin is its bottom-left corner; move the sensor or enlarge the room";
        let place = reader.place(keys.position_mm.span().start);
        return Err(place.refused(problem, hint).into());
    }
    let elevation_deg = reader.number(&keys.elevation_deg, &ELEVATION)?;
    let azimuth_deg = reader.number(&keys.azimuth_deg, &AZIMUTH)?;
    let roll_deg = reader.number_or(&keys.roll_deg, &ROLL, 0.0)?;
    // The specification's drawing does not say whether it shows the chip or what the chip sees.
    let corners = [("top-left", 0.0), ("bottom-right", 180.0)];
    let hint = "where pixel 1 is in the image; a lens rotates an image but never mirrors it";
    let turned_deg = reader.choice("pixel_1", &keys.pixel_1, &corners, hint)?;
    let roll_deg = roll_deg + turned_deg.unwrap_or(0.0);
    let pose = Pose::from_degrees(position_m, elevation_deg, azimuth_deg, roll_deg);
    let Some(tilt_deg) = &keys.tilt_deg else {
        return Ok(pose);
    };
    let [right_deg, down_deg] = reader.numbers(tilt_deg, &TILT)?;
    Ok(pose.tilted(right_deg, down_deg))
}

fn grid_points(
    reader: &Reader<'_>,
    table: &Spanned<SensorTable>,
    fov_deg: DVec2,
) -> Read<USizeVec2> {
    let given = &table.get_ref().pixels_per_degree;
    let per_degree = reader.number_or(given, &PIXELS_PER_DEGREE, POINTS_PER_DEGREE)?;
    let (points, limit) = ((fov_deg * per_degree).round(), limits::GRID_POINTS_MAX);
    if points.max_element() > count::float(limit) {
        let DVec2 { x, y } = points;
        let expected = format!("a grid of at most {limit} x {limit} points, not {x} x {y}");
        let span = given.as_ref().map_or(table.span(), Spanned::span);
        let rule = PIXELS_PER_DEGREE;
        return Err(reader.refused(rule.key, span, &expected, rule.hint).into());
    }
    let axis = points.to_array().map(|points| count::floor(points).max(1));
    Ok(axis.into())
}

struct Preset {
    name: &'static str,
    resolution: USizeVec2,
    fov_deg: DVec2,
    noise_sigma_c: f64,
    /// The physical model's noise instead, if the specification gives it.
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

/// The paper's sensors ("Experiment setup"; "Experiment 5" for the Lepton), and the Grid-EYE with the wide lens.
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

fn preset(reader: &Reader<'_>, name: &Option<Spanned<String>>) -> Read<Option<&'static Preset>> {
    let Some(name) = name else { return Ok(None) };
    if let Some(found) = PRESETS.iter().find(|preset| preset.name == name.get_ref()) {
        return Ok(Some(found));
    }
    let known = PRESETS.map(|preset| format!("\"{}\"", preset.name));
    let hint = "or omit it and give resolution, fov_deg, noise_sigma_c and sampling_hz";
    Err(reader
        .refused("preset", name.span(), &known.join(" or "), hint)
        .into())
}

/// PeerJ CS 11:e3124, "Perceived temperature calculation": "default: 5 m".
const OPERATING_MM: f64 = 5000.0;

/// PeerJ CS 11:e3124, "Sensor model implementation": 5 is the default.
const POINTS_PER_DEGREE: f64 = 5.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_matches_the_specification_at_both_rates() {
        assert_eq!(netd_c(0.05, 1.0), 0.05);
        assert_eq!((netd_c(0.05, 10.0) * 100.0).round(), 16.0);
        assert_eq!(netd_c(0.05, 4.0), 0.1);
    }
}
