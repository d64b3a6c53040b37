//! The person as a few warm points: what a place sees of them gives the contrast in any direction within
//! microseconds, close enough to rank poses.

use super::candidates::Candidate;
use super::error::CoverageError;
use super::floor::{Cell, Kind};
use super::survey::{Survey, is_out_of_view};
use glam::{DMat3, DVec2, DVec3};
use grideye_scene::{
    Body, Model, Scene, Sensor, count,
    perceived::{Surface, perceived_celsius},
};

/// A survey with a person of points, seen by sensors like one.
pub(crate) struct Rough<'a> {
    survey: &'a Survey,
    operating_distance_m: f64,
    /// What makes its contrasts those of the survey near the limit of detection.
    scale: f64,
    /// Evenly spread places, with the points of the person in each turn that fits.
    places: Vec<(usize, Vec<Turn>)>,
}

struct Turn {
    around_m: (DVec3, f64),
    points: Vec<Point>,
}

/// A part of the person's surface.
struct Point {
    at_m: DVec3,
    /// Outward; its length is the area, m².
    normal_m2: DVec3,
    is_seen_from_behind: bool,
    surface: Surface,
}

/// What a place sees of the person: for each turn at each of [`Rough::places`], the visible points.
pub(crate) struct Outlook(Vec<Vec<Vec<Ray>>>);

/// A unit vector toward a point, and the point's warmth above ambient times its solid angle.
struct Ray {
    toward: DVec3,
    celsius_sr: f64,
}

impl<'a> Rough<'a> {
    const PLACES_MAX: usize = 400;
    /// The longest side of a part of a surface: about a pixel at 3 m.
    const PART_M: f64 = 0.45;
    pub(crate) const SCALED_BY: usize = 8;

    /// For sensors like these.
    ///
    /// # Errors
    /// [`CoverageError::NoCandidates`], and those of [`Survey::look`].
    pub(crate) fn new(
        survey: &'a Survey,
        like: &[Candidate],
        sigma_min: f64,
        threads: (usize, &(dyn Fn() + Sync)),
    ) -> Result<Self, CoverageError> {
        let first = like.first().ok_or(CoverageError::NoCandidates)?;
        let floor = survey.floor();
        let every = count::float(floor.places()) / count::float(Self::PLACES_MAX);
        let every = count::floor(every.sqrt().ceil().max(1.0));
        let is_asked = |index: usize| {
            (index % floor.columns) % every == 0 && (index / floor.columns) % every == 0
        };
        let cells = floor.cells.iter().enumerate();
        let places = cells.filter(|(_, cell)| cell.kind == Kind::Place);
        // In a room of passages narrower than that, take all.
        let sparse = places.clone().filter(|(index, _)| is_asked(*index)).count();
        let takes_all = sparse * every * every * 2 < floor.places();
        let turns = |(index, cell): (usize, &Cell)| {
            let turns = cell.stands.iter().map(|stand| Turn {
                around_m: stand.around_m,
                points: stand.blocks.parts.iter().flat_map(points).collect(),
            });
            (index, turns.collect())
        };
        let mut rough = Self {
            survey,
            operating_distance_m: first.sensor.operating_distance_m,
            scale: 1.0,
            places: places
                .filter(|(index, _)| takes_all || is_asked(*index))
                .map(turns)
                .collect(),
        };
        rough.scale = rough.scale_to_looks(like, sigma_min, threads)?;
        Ok(rough)
    }

    /// The median ratio of exact contrasts to its own where both are near the limit of detection, seen from some of the poses.
    fn scale_to_looks(
        &self,
        like: &[Candidate],
        sigma_min: f64,
        (threads, after_each): (usize, &(dyn Fn() + Sync)),
    ) -> Result<f64, CoverageError> {
        let some = like.iter().step_by(like.len().div_ceil(Self::SCALED_BY));
        let some: Vec<Sensor> = some.map(|pose| pose.sensor.clone()).collect();
        let looks = self.survey.look_all(&some, threads, after_each)?;
        let mut ratios = Vec::new();
        for (sensor, look) in some.iter().zip(&looks) {
            let own = self.contrasts(&self.outlook(sensor.pose.position_m), sensor);
            let exact = self.cells().map(|cell| look.cells[cell].contrast);
            let both = own.iter().copied().map(f64::from).zip(exact);
            let both = both.filter(|(own, exact)| {
                own.min(*exact) > 0.4 * sigma_min && own.max(*exact) < 2.5 * sigma_min
            });
            ratios.extend(both.map(|(own, exact)| exact / own));
        }
        ratios.sort_by(f64::total_cmp);
        Ok(ratios.get(ratios.len() / 2).copied().unwrap_or(1.0))
    }

    /// The cells that its contrasts are of.
    pub(crate) fn cells(&self) -> impl Iterator<Item = usize> {
        self.places.iter().map(|(cell, _)| *cell)
    }

    pub(crate) fn outlook(&self, from_m: DVec3) -> Outlook {
        let scene = self.survey.scene();
        let seen = |turn: &Turn| {
            let points = turn.points.iter();
            let toward = points.filter_map(|point| self.ray(scene, from_m, point));
            toward.collect()
        };
        let of_turns = |(_, turns): &(usize, Vec<Turn>)| turns.iter().map(seen).collect();
        Outlook(self.places.iter().map(of_turns).collect())
    }

    fn ray(&self, scene: &Scene, from_m: DVec3, point: &Point) -> Option<Ray> {
        let way_m = point.at_m - from_m;
        let distance_m = way_m.length().max(0.05);
        let toward = way_m / distance_m;
        let facing_m2 = match point.is_seen_from_behind {
            true => point.normal_m2.dot(toward).abs(),
            false => -point.normal_m2.dot(toward),
        };
        if facing_m2 <= 0.0 || !self.survey.is_in_sight(from_m, point.at_m) {
            return None;
        }
        let ambient_c = scene.room().ambient_c;
        let above_c = match scene.model() {
            Model::Paper => {
                let near_m = self.operating_distance_m;
                perceived_celsius(scene.law(), point.surface, ambient_c, distance_m, near_m)
                    - ambient_c
            }
            Model::Physical => point.surface.emissivity * (point.surface.celsius - ambient_c),
        };
        Some(Ray {
            toward,
            celsius_sr: above_c * facing_m2 / (distance_m * distance_m),
        })
    }

    /// The contrast at each of [`Self::cells`] of the sensor, which is where the outlook is.
    pub(crate) fn contrasts(&self, outlook: &Outlook, sensor: &Sensor) -> Vec<f32> {
        let is_sharp = self.survey.scene().model() == Model::Paper;
        let half = 0.5 * DVec2::new(count::float(sensor.columns), count::float(sensor.rows));
        let mut view = View {
            sensor,
            is_sharp,
            slopes: sensor.view_slopes(),
            half,
            sensor_from_world: sensor.pose.world_from_sensor().transpose(),
            pixels: vec![0.0; sensor.columns * sensor.rows],
        };
        let sigma_c = self.survey.sigma_c(sensor) / self.scale;
        let mut contrast =
            |(turn, rays): (&Turn, &Vec<Ray>)| match is_out_of_view(sensor, turn.around_m) {
                true => 0.0,
                false => view.change_c(rays) / sigma_c,
            };
        let places = self.places.iter().zip(&outlook.0);
        places
            .map(|((_, turns), rays)| {
                let of_turns = turns.iter().zip(rays).map(&mut contrast);
                count::single(of_turns.fold(f64::INFINITY, f64::min))
            })
            .collect()
    }
}

struct View<'a> {
    sensor: &'a Sensor,
    /// Whether the view ends where the paper's does; the physical one fades over a pixel.
    is_sharp: bool,
    slopes: DVec2,
    half: DVec2,
    sensor_from_world: DMat3,
    pixels: Vec<f64>,
}

impl View<'_> {
    /// The root of the sum of the squares of what the rays add to the pixels.
    fn change_c(&mut self, rays: &[Ray]) -> f64 {
        self.pixels.fill(0.0);
        let pitch = self.slopes / self.half;
        let last = 2.0 * self.half - 1.0;
        let reach = match self.is_sharp {
            true => self.slopes,
            false => self.slopes + 0.5 * pitch,
        };
        for ray in rays {
            let toward = self.sensor_from_world * ray.toward;
            let slope = DVec2::new(toward.y, toward.z) / toward.x;
            if toward.x <= 0.0 || slope.abs().cmpgt(reach).any() {
                continue;
            }
            let pixels = ray.celsius_sr / (toward.x.powi(3) * pitch.x * pitch.y);
            // As the simulator's pixels respond: linear from one's center to the next.
            let at = self.half - slope / pitch - 0.5;
            let first = at.floor();
            let share = at - first;
            let columns = [(first.x, 1.0 - share.x), (first.x + 1.0, share.x)];
            for (row, down) in [(first.y, 1.0 - share.y), (first.y + 1.0, share.y)] {
                for (column, across) in columns {
                    let is_beside = row < 0.0 || column < 0.0 || row > last.y || column > last.x;
                    if is_beside && !self.is_sharp {
                        continue;
                    }
                    let row = count::floor(row.clamp(0.0, last.y));
                    let column = count::floor(column.clamp(0.0, last.x));
                    self.pixels[row * self.sensor.columns + column] += pixels * down * across;
                }
            }
        }
        self.pixels
            .iter()
            .map(|change| change * change)
            .sum::<f64>()
            .sqrt()
    }
}

/// A body's surface in parts no longer than [`Rough::PART_M`].
fn points(body: &Body) -> Vec<Point> {
    let vertices_m = body.mesh.vertices_m();
    let mut points = Vec::new();
    for face in body.mesh.faces() {
        let corners: Vec<DVec3> = face.iter().map(|corner| vertices_m[*corner]).collect();
        let Some((first, rest)) = corners.split_first() else {
            continue;
        };
        let mut parts: Vec<[DVec3; 3]> = rest
            .windows(2)
            .map(|pair| [*first, pair[0], pair[1]])
            .collect();
        while let Some([one, two, three]) = parts.pop() {
            // The longest side last.
            let (one, two, three) = [(one, two, three), (two, three, one), (three, one, two)]
                .into_iter()
                .max_by(|a, b| a.0.distance(a.2).total_cmp(&b.0.distance(b.2)))
                .unwrap_or((one, two, three));
            if one.distance(three) > Rough::PART_M {
                let middle = 0.5 * (one + three);
                parts.extend([[one, two, middle], [middle, two, three]]);
                continue;
            }
            points.push(Point {
                at_m: (one + two + three) / 3.0,
                normal_m2: 0.5 * (two - one).cross(three - one),
                is_seen_from_behind: !body.mesh.is_closed(),
                surface: body.surface,
            });
        }
    }
    points
}
