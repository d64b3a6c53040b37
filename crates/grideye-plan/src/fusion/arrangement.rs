//! Checks how the sensors of an array are arranged, and builds the virtual sensor they replace.

use super::axis::Axis;
use super::error::{ArrayError, CELLS_PER_AXIS_MAX};
use glam::{DVec2, DVec3, USizeVec2};
use grideye_scene::{Sensor, count, physical::Optics};

/// Accepted deviation of a spacing from Eq. 7: 1 %, a third of a millimeter in 30.
const TOLERANCE: f64 = 0.01;
const SLACK_M: f64 = 1e-4;

pub(super) fn check_alike(first: &Sensor, sensors: &[&Sensor]) -> Result<(), ArrayError> {
    for sensor in sensors {
        let forward_m = first.pose.point_in_sensor(sensor.pose.position_m).x;
        let turned =
            (sensor.pose.world_from_sensor() - first.pose.world_from_sensor()).to_cols_array();
        let differences = [
            (
                "resolution",
                (sensor.columns, sensor.rows) != (first.columns, first.rows),
            ),
            (
                "fov_deg",
                sensor.field_of_view_rad != first.field_of_view_rad,
            ),
            (
                "operating_distance_mm",
                (sensor.operating_distance_m - first.operating_distance_m).abs() > SLACK_M,
            ),
            ("its angles", turned.iter().any(|part| part.abs() > 1e-9)),
            (
                "its place along the axis of view",
                forward_m.abs() > SLACK_M,
            ),
        ];
        if let Some((what, _)) = differences.into_iter().find(|(_, differs)| *differs) {
            return Err(ArrayError(format!(
                "sensor `{}` differs from `{}` in {what}\nhint: an array needs equal sensors that look the same way; name them with --sensors",
                sensor.name, first.name
            )));
        }
    }
    Ok(())
}

pub(super) fn axis(
    direction: &'static str,
    offsets: &[f64],
    pixels: usize,
    extent_m: f64,
    distance_m: f64,
) -> Result<Axis, ArrayError> {
    let different = different(offsets);
    let sensors = different.len();
    let (low, high) = (different[0], different[sensors - 1]);
    let pixel_m = extent_m / count::float(pixels);
    let (mut spacing_m, mut factor) = (0.0, 1);
    if sensors > 1 {
        spacing_m = (high - low) / count::float(sensors - 1);
        factor = count::floor((pixel_m / spacing_m).round()).max(1);
    }
    let axis = Axis {
        pixels,
        factor,
        sensors,
        spacing_m,
        spacing_by_eq_7_m: pixel_m / count::float(factor),
    };
    let is_even = different.iter().enumerate().all(|(index, offset)| {
        (offset - low - count::float(index) * spacing_m).abs() <= TOLERANCE * spacing_m
    });
    let is_eq_7 =
        sensors == 1 || (spacing_m - axis.spacing_by_eq_7_m).abs() <= TOLERANCE * spacing_m;
    if !(is_even && is_eq_7) {
        let rounded = |meters: f64| (meters * 1e5).round() / 100.0;
        let first_m = different.get(1).map_or(0.0, |second| second - low);
        return Err(ArrayError(format!(
            "sensors are {} mm apart {direction}, expected {} mm at an operating distance of {} mm for a factor of {factor} (Eq. 7)\nhint: move the sensors, or set operating_distance_mm to their intended distance",
            rounded(if is_even { spacing_m } else { first_m }),
            rounded(axis.spacing_by_eq_7_m),
            rounded(distance_m)
        )));
    }
    let cells = pixels.saturating_mul(factor).saturating_add(sensors - 1);
    if cells > CELLS_PER_AXIS_MAX {
        return Err(ArrayError(format!(
            "{cells} cells on one axis, expected at most {CELLS_PER_AXIS_MAX}\nhint: place fewer sensors, or farther apart"
        )));
    }
    Ok(axis)
}

fn different(offsets: &[f64]) -> Vec<f64> {
    let mut sorted = offsets.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.dedup_by(|one, other| (*one - *other).abs() <= SLACK_M);
    sorted
}

pub(super) fn place(offset: f64, offsets: &[f64], axis: &Axis) -> usize {
    let low = offsets.iter().copied().fold(f64::INFINITY, f64::min);
    if axis.sensors > 1 {
        count::floor(((offset - low) / axis.spacing_m).round())
    } else {
        0
    }
}

pub(super) fn check_full(
    places: &[(usize, usize)],
    across: &Axis,
    down: &Axis,
) -> Result<(), ArrayError> {
    let mut sorted = places.to_vec();
    sorted.sort_unstable();
    sorted.dedup();
    if sorted.len() == places.len() && places.len() == across.sensors * down.sensors {
        return Ok(());
    }
    Err(ArrayError(format!(
        "{} sensors are not in a grid of {} x {} places\nhint: Eq. 7 needs sensors in rows and columns, all equally far apart",
        places.len(),
        across.sensors,
        down.sensors
    )))
}

pub(super) fn middle(offsets: &[f64]) -> f64 {
    let (low, high) = count::range(offsets.iter().copied());
    0.5 * (low + high)
}

pub(super) fn virtual_sensor(first: &Sensor, middle: DVec2, across: &Axis, down: &Axis) -> Sensor {
    let share =
        |axis: &Axis| count::float(axis.union_cells()) / count::float(axis.pixels * axis.factor);
    let shares = DVec2::new(share(across), share(down));
    let wider = first.view_slopes() * shares;
    let points = |points: usize, share: f64| count::floor((count::float(points) * share).ceil());
    let mut pose = first.pose;
    pose.position_m += first.pose.world_from_sensor() * DVec3::new(0.0, -middle.x, -middle.y);
    let mut sensor = first.clone();
    sensor.name = "virtual".to_owned();
    sensor.columns = across.union_cells();
    sensor.rows = down.union_cells();
    sensor.field_of_view_rad = 2.0 * DVec2::new(libm::atan(wider.x), libm::atan(wider.y));
    sensor.grid_points = USizeVec2::new(
        points(first.grid_points.x, shares.x),
        points(first.grid_points.y, shares.y),
    );
    sensor.pose = pose;
    // The truth is sharp: only the step of its own pixels blurs it.
    sensor.optics = Optics::Pinhole;
    sensor.pixel_width_rad = None;
    sensor.blur_rad = DVec2::ZERO;
    sensor.profile = None;
    sensor
}
