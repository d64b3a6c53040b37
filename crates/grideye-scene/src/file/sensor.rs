//! Builds a sensor from its keys and preset.

use crate::file::reader::{Read, Reader, meters, name};
use crate::geometry::{Pose, count};
use crate::model::{Model, Optics, Room, SceneError, Sensor, limits};
use crate::profile::Profile;
use crate::text::{MM_PER_M, millimeters};
use glam::{DVec2, USizeVec2};
use grideye_frame::{COLUMNS, ROWS};
use grideye_text::Table;

pub(crate) fn sensor(reader: &Reader<'_>, table: &Table<'_>, room: &Room) -> Read<Sensor> {
    let preset = table.text("preset");
    let preset = PRESETS.iter().find(|known| preset == Some(known.name));
    let missing = |key| {
        let hint = "give the key, or preset = \"grid-eye\", which has it";
        table.missing(key, hint)
    };
    let axes = |key| table.list(key).map(DVec2::from_array);
    let resolution = table
        .list("resolution")
        .map(|[columns, rows]: [f64; 2]| USizeVec2::new(count::floor(columns), count::floor(rows)));
    let resolution = resolution.or(preset.map(|preset| preset.resolution));
    let resolution = resolution.ok_or_else(|| missing("resolution"))?;
    let fov_deg = axes("fov_deg").or(preset.map(|preset| preset.fov_deg));
    let fov_deg = fov_deg.ok_or_else(|| missing("fov_deg"))?;
    let sampling_hz = table.number("sampling_hz");
    let sampling_hz = sampling_hz.or(preset.map(|preset| preset.sampling_hz));
    let sampling_hz = sampling_hz.ok_or_else(|| missing("sampling_hz"))?;
    let radians = |degrees: DVec2| degrees.map(f64::to_radians);
    let blur_px = axes("blur_px").map(|blur| blur * (fov_deg / resolution.as_dvec2()));
    let blur_deg = axes("blur_deg").or(blur_px).unwrap_or(DVec2::ZERO);
    let is_grid_eye = preset.is_some_and(|preset| preset.netd_at_1_hz_c.is_some());
    let is_small = resolution == USizeVec2::new(COLUMNS, ROWS);
    let is_amg88 = is_small && fov_deg == DVec2::splat(60.0);
    let profile = profile(reader, table, is_small)?;
    // The file's noise first, then the profile's mean, then that of the model and preset.
    let noise_sigma = table.number("noise_sigma_c");
    let noise_sigma = noise_sigma.or(profile.as_ref().map(Profile::sigma_c));
    let of_preset = preset.map(|preset| match (reader.model, preset.netd_at_1_hz_c) {
        (Model::Physical, Some(at_1_hz_c)) => netd_c(at_1_hz_c, sampling_hz),
        _ => preset.noise_sigma_c,
    });
    let operating_mm = table.number("operating_distance_mm");
    Ok(Sensor {
        columns: resolution.x,
        rows: resolution.y,
        field_of_view_rad: radians(fov_deg),
        grid_points: grid_points(table, fov_deg)?,
        noise_sigma: noise_sigma
            .or(of_preset)
            .ok_or_else(|| missing("noise_sigma_c"))?,
        sampling_hz,
        operating_distance_m: operating_mm.unwrap_or(OPERATING_MM) / MM_PER_M,
        detectable_range_c: table
            .list("detectable_range_c")
            .map(|[low, high]| (low, high)),
        pose: pose(table, room)?,
        optics: optics(table, (is_grid_eye, is_amg88))?,
        pixel_width_rad: axes("pixel_width_deg").map(radians),
        blur_rad: radians(blur_deg),
        spill: table.number("spill").unwrap_or(0.0),
        spill_px: table.number("spill_px").unwrap_or(SPILL_PX),
        profile,
        step_c: table.number("step_c").unwrap_or(0.0),
        name: name(table),
    })
}

fn optics(table: &Table<'_>, (is_grid_eye, is_amg88): (bool, bool)) -> Read<Optics> {
    let given = table.get("optics");
    let is_pinhole = given
        .and_then(|given| given.text())
        .map(|optics| optics == "pinhole");
    if let (Some(given), Some(false), false) = (given, is_pinhole, is_amg88) {
        let expected = "\"pinhole\" for a sensor without 8 x 8 pixels and 60°";
        let hint = "the datasheet's map is for the AMG88 with the 60° lens; omit optics, or omit resolution and fov_deg";
        return Err(given.refused_with(expected, hint).into());
    }
    Ok(match is_pinhole.unwrap_or(!is_grid_eye || !is_amg88) {
        true => Optics::Pinhole,
        false => Optics::Amg88,
    })
}

fn profile(reader: &Reader<'_>, table: &Table<'_>, is_small: bool) -> Read<Option<Profile>> {
    let Some(path) = table.get("profile") else {
        return Ok(None);
    };
    if !is_small {
        let expected = "no profile for a sensor without 8 x 8 pixels";
        let hint = "profiles are for the Grid-EYE; give noise_sigma_c instead";
        return Err(path.refused_with(expected, hint).into());
    }
    let text = reader.read_below("profile", path)?;
    let profile = Profile::parse(&text, path.text().unwrap_or_default());
    profile.map(Some).map_err(|source| SceneError::Profile {
        place: path.place(),
        source,
    })
}

/// Noise of one pixel in one frame, °C: `0.05 √hz`, which matches the specification's 0.05 °C at 1 Hz and 0.16 °C at 10
/// Hz.
fn netd_c(at_1_hz_c: f64, sampling_hz: f64) -> f64 {
    at_1_hz_c * sampling_hz.sqrt()
}

fn pose(table: &Table<'_>, room: &Room) -> Read<Pose> {
    let position_m = meters(table, "position_mm").unwrap_or_default();
    if let Some(given) = table
        .get("position_mm")
        .filter(|_| !room.contains(position_m))
    {
        let (sensor, found_mm, room_mm) =
            (table.title(), millimeters(position_m), room.described());
        let problem = format!("{sensor} at {found_mm} mm is outside the room of {room_mm} mm");
        let hint =
            "the room's origin is its bottom-left corner; move the sensor or enlarge the room";
        return Err(given.place().refused(problem, hint).into());
    }
    let degrees = |key| table.number(key).unwrap_or_default();
    // The specification's drawing does not say whether it shows the chip or what the chip sees.
    let turned_deg = match table.text("pixel_1") {
        Some("bottom-right") => 180.0,
        _ => 0.0,
    };
    let roll_deg = degrees("roll_deg") + turned_deg;
    let (elevation_deg, azimuth_deg) = (degrees("elevation_deg"), degrees("azimuth_deg"));
    let pose = Pose::from_degrees(position_m, elevation_deg, azimuth_deg, roll_deg);
    Ok(match table.list("tilt_deg") {
        Some([right_deg, down_deg]) => pose.tilted(right_deg, down_deg),
        None => pose,
    })
}

fn grid_points(table: &Table<'_>, fov_deg: DVec2) -> Read<USizeVec2> {
    let given = table.get("pixels_per_degree");
    let per_degree = table
        .number("pixels_per_degree")
        .unwrap_or(POINTS_PER_DEGREE);
    let (points, limit) = ((fov_deg * per_degree).round(), limits::GRID_POINTS_MAX);
    if let Some(given) = given.filter(|_| points.max_element() > count::float(limit)) {
        let DVec2 { x, y } = points;
        let expected = format!("a grid of at most {limit} x {limit} points, not {x} x {y}");
        return Err(given.refused(&expected).into());
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

/// Fits two walkers under a sensor, see scenes/PHYSICS.md.
const SPILL_PX: f64 = 1.2;

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
