//! The poses to try: on the ceiling, on walls and in corners.

use super::error::{CoverageError, check_count, check_length};
use super::limits;
use super::rays::edges;
use super::survey::Survey;
use glam::{DVec2, DVec3};
use grideye_scene::{Pose, Room, Scene, Sensor, count, physical::Optics, polygon::bounds};
use std::f64::consts::TAU;

/// Where a sensor is mounted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mount {
    /// On the ceiling.
    Ceiling,
    /// On a wall, away from its ends.
    Wall,
    /// In a corner, except where walls jut into the room.
    Corner,
}

/// The poses to try: all over the ceiling and the walls, in all combinations.
#[derive(Debug, Clone, PartialEq)]
pub struct Mounts {
    /// Kinds of mounting.
    pub mounts: Vec<Mount>,
    /// Approximate spacing, meters, adjusted to divide the room or the wall evenly.
    pub spacing_m: f64,
    /// On the ceiling: angles of the axis from straight down, degrees, 0 to 90. The [`search`](super::search()) improves
    /// a pose between the least and the greatest, as it does with the angles on walls.
    pub ceiling_tilts_deg: Vec<f64>,
    /// On the ceiling, tilted: the number of directions, evenly over a full turn starting at the right.
    pub ceiling_headings: usize,
    /// On walls and in corners: heights above the floor, meters.
    pub wall_heights_m: Vec<f64>,
    /// On walls and in corners: angles of the axis below horizontal, degrees, 0 to 90.
    pub wall_downs_deg: Vec<f64>,
    /// On walls: directions relative to straight into the room, degrees, -90 to 90. In corners the bisector is tried, and
    /// improved within these.
    pub wall_headings_deg: Vec<f64>,
}

impl Default for Mounts {
    /// Ceiling, walls and corners every 0.5 m.
    fn default() -> Self {
        Self {
            mounts: vec![Mount::Ceiling, Mount::Wall, Mount::Corner],
            spacing_m: 0.5,
            ceiling_tilts_deg: vec![0.0, 30.0, 60.0],
            ceiling_headings: 8,
            wall_heights_m: vec![2.2],
            wall_downs_deg: vec![15.0, 35.0, 60.0],
            wall_headings_deg: vec![-45.0, 0.0, 45.0],
        }
    }
}

/// A pose that may be picked.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Where it is mounted; `None` for a sensor of the scene.
    pub mount: Option<Mount>,
    /// The sensor there.
    pub sensor: Sensor,
    /// Its position, whole millimeters.
    pub position_mm: DVec3,
    /// As in a scene file, tenths of degrees.
    pub elevation_deg: f64,
    /// As in a scene file, tenths of degrees.
    pub azimuth_deg: f64,
    place: Option<Place>,
}

/// Distance of a sensor's window from its wall, meters, because the walls hide what is behind them.
const STANDOFF_M: f64 = 0.02;

/// The candidates of a room, each a sensor like `like`: ceiling first, then walls and corners; none inside furniture.
///
/// # Errors
/// [`CoverageError`] for invalid numbers, and for no or too many poses.
pub fn candidates(
    survey: &Survey,
    mounts: &Mounts,
    like: &Sensor,
) -> Result<Vec<Candidate>, CoverageError> {
    check(mounts)?;
    let mut candidates = Vec::new();
    for place in places(survey.scene().room(), mounts)? {
        if !survey.is_free(place.position_mm() / 1000.0) {
            continue;
        }
        for (elevation_deg, azimuth_deg) in directions(&place, mounts, like) {
            if candidates.len() == limits::CANDIDATES_MAX {
                return Err(CoverageError::too_many_candidates(
                    limits::CANDIDATES_MAX + 1,
                ));
            }
            candidates.push(place.candidate(like, elevation_deg, azimuth_deg));
        }
    }
    if candidates.is_empty() {
        return Err(CoverageError::NoCandidates);
    }
    Ok(candidates)
}

impl Candidate {
    /// A sensor of the scene as a candidate.
    #[must_use]
    pub fn of_sensor(sensor: &Sensor) -> Self {
        let tenths = |angle_rad: f64| (angle_rad.to_degrees() * 10.0).round() / 10.0;
        Self {
            mount: None,
            place: None,
            sensor: sensor.clone(),
            position_mm: (sensor.pose.position_m * 1000.0).round(),
            elevation_deg: tenths(sensor.pose.elevation_rad),
            azimuth_deg: tenths(sensor.pose.azimuth_rad),
        }
    }

    /// The same sensor moved over the ceiling, or by the first number along its wall, meters, and turned in elevation and
    /// azimuth, degrees, as far as `mounts` allow; `None` for a sensor of the scene.
    pub(crate) fn moved(&self, by_m: DVec2, by_deg: DVec2, mounts: &Mounts) -> Option<Self> {
        let place = self.place.as_ref()?.moved(by_m);
        let within = |value: f64, values: &[f64]| {
            let (low, high) = count::range(values.iter().copied());
            value.clamp(low, high.max(low))
        };
        let elevation_deg = self.elevation_deg + by_deg.x;
        let azimuth_deg = self.azimuth_deg + by_deg.y;
        if place.mount == Mount::Ceiling {
            let tilt_deg = within(90.0 - elevation_deg, &mounts.ceiling_tilts_deg);
            return Some(place.candidate(&self.sensor, 90.0 - tilt_deg, azimuth_deg));
        }
        let heading_deg = azimuth(azimuth_deg - place.inward_deg);
        let heading_deg = within(heading_deg, &mounts.wall_headings_deg);
        let down_deg = within(elevation_deg, &mounts.wall_downs_deg);
        Some(place.candidate(&self.sensor, down_deg, place.inward_deg + heading_deg))
    }

    /// Its `[[sensor]]` table in a scene file, under another name; a profile is reduced to its noise.
    #[must_use]
    pub fn toml(&self, name: &str) -> String {
        let sensor = &self.sensor;
        let degrees = |rad: f64| rounded(rad.to_degrees());
        let pair = |rad: DVec2| format!("[{}, {}]", degrees(rad.x), degrees(rad.y));
        let unless_0 = |value: f64| (value != 0.0).then(|| value.to_string());
        let per_degree = count::float(sensor.grid_points.x) / degrees(sensor.field_of_view_rad.x);
        let range = sensor.detectable_range_c;
        let [x, y, z] = self.position_mm.to_array();
        let keys = [
            ("name", Some(toml::Value::from(name).to_string())),
            ("position_mm", Some(format!("[{x}, {y}, {z}]"))),
            ("elevation_deg", Some(self.elevation_deg.to_string())),
            ("azimuth_deg", Some(self.azimuth_deg.to_string())),
            ("roll_deg", unless_0(degrees(sensor.pose.roll_rad))),
            (
                "resolution",
                Some(format!("[{}, {}]", sensor.columns, sensor.rows)),
            ),
            ("fov_deg", Some(pair(sensor.field_of_view_rad))),
            ("pixels_per_degree", Some(rounded(per_degree).to_string())),
            ("noise_sigma_c", Some(sensor.noise_sigma.to_string())),
            ("sampling_hz", Some(sensor.sampling_hz.to_string())),
            (
                "operating_distance_mm",
                unless_0(rounded(sensor.operating_distance_m * 1000.0)),
            ),
            (
                "detectable_range_c",
                range.map(|(low, high)| format!("[{low}, {high}]")),
            ),
            (
                "optics",
                (sensor.optics == Optics::Amg88).then(|| "\"datasheet\"".to_owned()),
            ),
            ("pixel_width_deg", sensor.pixel_width_rad.map(pair)),
            (
                "blur_deg",
                (sensor.blur_rad != DVec2::ZERO).then(|| pair(sensor.blur_rad)),
            ),
            ("step_c", unless_0(sensor.step_c)),
        ];
        let given = keys
            .into_iter()
            .filter_map(|(key, value)| Some((key, value?)));
        let lines = given.map(|(key, value)| format!("{key} = {value}\n"));
        let profile = match sensor.profile {
            Some(_) => "# its profile is a file: replace noise_sigma_c with profile = …\n",
            None => "",
        };
        format!("[[sensor]]\n{}{profile}", lines.collect::<String>())
    }
}

/// A sensor with the defaults of a scene preset.
///
/// # Errors
/// [`CoverageError::Scene`] for an unknown name.
pub fn preset(name: &str) -> Result<Sensor, CoverageError> {
    // Parse a scene, because only the scene format defines the presets.
    let text = format!(
        "[room]\nsize_mm = [1000, 1000, 1000]\nambient_c = 20\n[[sensor]]\nname = \"any\"\npreset = {}\n\
         position_mm = [500, 500, 1000]\nelevation_deg = 90\nazimuth_deg = -90\n",
        toml::Value::from(name)
    );
    let nothing = |_: &str| Err(std::io::Error::from(std::io::ErrorKind::NotFound));
    let loaded = Scene::parse(&text, "a scene with this preset", &nothing)?;
    Ok(loaded.scene.sensor("any")?.clone())
}

/// Rounding errors of angles and lengths would only obscure the number.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

#[derive(Debug, Clone, PartialEq)]
struct Place {
    mount: Mount,
    at_m: DVec3,
    /// Direction into the room, degrees; meaningless for the ceiling.
    inward_deg: f64,
    /// The part of the wall it may be on, or the ceiling's bounds.
    between_m: (DVec2, DVec2),
}

impl Place {
    /// Rounded down, so that the sensor is never above a ceiling at a fraction of a millimeter.
    fn position_mm(&self) -> DVec3 {
        let above_mm = (self.at_m.z * 1000.0 + 1e-6).floor();
        (self.at_m * 1000.0).round().with_z(above_mm)
    }

    fn candidate(&self, like: &Sensor, elevation_deg: f64, azimuth_deg: f64) -> Candidate {
        let position_mm = self.position_mm();
        let elevation_deg = (elevation_deg * 10.0).round() / 10.0;
        let azimuth_deg = azimuth(azimuth_deg);
        let mut sensor = like.clone();
        "candidate".clone_into(&mut sensor.name);
        sensor.pose = Pose::from_degrees(position_mm / 1000.0, elevation_deg, azimuth_deg, 0.0);
        Candidate {
            mount: Some(self.mount),
            sensor,
            position_mm,
            elevation_deg,
            azimuth_deg,
            place: Some(self.clone()),
        }
    }

    fn moved(&self, by_m: DVec2) -> Self {
        let (low, high) = self.between_m;
        let at_m = self.at_m.truncate();
        if self.mount == Mount::Ceiling {
            let at_m = (at_m + by_m).clamp(low, high);
            return Self {
                at_m: at_m.extend(self.at_m.z),
                ..self.clone()
            };
        }
        let along = (high - low).normalize_or_zero();
        let way_m = (along.dot(at_m - low) + by_m.x).clamp(0.0, low.distance(high));
        let at_m = (low + way_m * along).extend(self.at_m.z);
        Self {
            at_m,
            ..self.clone()
        }
    }
}

fn places(room: &Room, mounts: &Mounts) -> Result<Vec<Place>, CoverageError> {
    let mut places = Vec::new();
    let mut push = |mount: Mount, at_m: DVec3, inward: DVec2, between_m: (DVec2, DVec2)| {
        let inward_deg = libm::atan2(inward.y, inward.x).to_degrees();
        places.push(Place {
            mount,
            at_m,
            inward_deg,
            between_m,
        });
        if places.len() > limits::CANDIDATES_MAX {
            return Err(CoverageError::too_many_candidates(places.len()));
        }
        Ok(())
    };
    let outline = room.outline_m();
    let level_m = room.bounds_m().0.z;
    if mounts.mounts.contains(&Mount::Ceiling) {
        let (low, high) = bounds(outline.iter().copied());
        let across = steps(low.x, high.x, mounts.spacing_m);
        for y in steps(low.y, high.y, mounts.spacing_m) {
            for x in across.clone() {
                let at_m = DVec3::new(x, y, room.bounds_m().1.z);
                push(Mount::Ceiling, at_m, DVec2::ZERO, (low, high))?;
            }
        }
    }
    for height_m in &mounts.wall_heights_m {
        let corners = edges(&outline).zip(edges(&outline).skip(1).chain(edges(&outline).take(1)));
        for ((start, end), (_, after)) in corners {
            let along = (end - start).normalize_or_zero();
            if mounts.mounts.contains(&Mount::Wall) {
                let off = STANDOFF_M * along.perp();
                for way_m in steps(0.0, start.distance(end), mounts.spacing_m) {
                    let at = (start + way_m * along + off).extend(level_m + height_m);
                    push(Mount::Wall, at, along.perp(), (start + off, end + off))?;
                }
            }
            let onwards = (after - end).normalize_or_zero();
            if mounts.mounts.contains(&Mount::Corner) && along.perp_dot(onwards) > 1e-3 {
                let inward = along.perp() + onwards.perp();
                // Equally far from both walls.
                let at = end + STANDOFF_M * inward / (1.0 + along.dot(onwards));
                push(
                    Mount::Corner,
                    at.extend(level_m + height_m),
                    inward,
                    (at, at),
                )?;
            }
        }
    }
    Ok(places)
}

fn steps(low: f64, high: f64, spacing: f64) -> impl Iterator<Item = f64> + Clone {
    let count = ((high - low) / spacing).round().max(1.0);
    let step = (high - low) / count;
    let count = count::floor(count).min(limits::CANDIDATES_MAX + 1);
    (0..count).map(move |index| low + (count::float(index) + 0.5) * step)
}

fn directions(place: &Place, mounts: &Mounts, like: &Sensor) -> Vec<(f64, f64)> {
    if place.mount != Mount::Ceiling {
        let straight = [0.0];
        let headings = match place.mount {
            Mount::Wall => mounts.wall_headings_deg.as_slice(),
            _ => &straight,
        };
        let of_down = |down: &f64| {
            let headings = headings.iter().copied();
            let down = *down;
            headings.map(move |heading| (down, azimuth(place.inward_deg + heading)))
        };
        return mounts.wall_downs_deg.iter().flat_map(of_down).collect();
    }
    let field = like.field_of_view_rad;
    let is_square = field.x == field.y && like.columns == like.rows;
    let turn_deg = TAU.to_degrees() / count::float(mounts.ceiling_headings);
    let mut directions = Vec::new();
    for tilt in &mounts.ceiling_tilts_deg {
        if *tilt == 0.0 {
            // Straight down, the heading decides the top of the image; the paper has the front there.
            directions.push((90.0, -90.0));
            if !is_square {
                directions.push((90.0, 0.0));
            }
            continue;
        }
        let headings = (0..mounts.ceiling_headings).map(count::float);
        directions.extend(headings.map(|heading| (90.0 - tilt, azimuth(heading * turn_deg))));
    }
    directions
}

fn azimuth(degrees: f64) -> f64 {
    let tenths = (degrees * 10.0).round().rem_euclid(3600.0);
    let turns = if tenths > 1800.0 { 3600.0 } else { 0.0 };
    (tenths - turns) / 10.0
}

fn check(mounts: &Mounts) -> Result<(), CoverageError> {
    let angles = [
        ("a tilt", &mounts.ceiling_tilts_deg, 0.0),
        ("an angle below horizontal", &mounts.wall_downs_deg, 0.0),
        ("a heading on a wall", &mounts.wall_headings_deg, -90.0),
    ];
    for (what, values, low) in angles {
        let wrong = values.iter().find(|value| !(low..=90.0).contains(*value));
        if let Some(wrong) = wrong {
            let hint = "tilts count from straight down, angles on walls from horizontal and from straight into the room";
            let (found, expected) = (format!("{wrong}°"), format!("{low}° to 90°"));
            return Err(CoverageError::value(what, &found, &expected, hint));
        }
    }
    let heights = mounts.wall_heights_m.iter();
    let heights = heights.map(|height| ("a height on a wall", *height));
    let lengths = [("the spacing of the poses", mounts.spacing_m)];
    for (what, length_m) in lengths.into_iter().chain(heights) {
        check_length(what, length_m, "lengths are in millimeters")?;
    }
    let (what, hint) = ("the number of headings", "8 is every 45 degrees");
    check_count(what, mounts.ceiling_headings, 360, hint)
}
