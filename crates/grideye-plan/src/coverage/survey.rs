//! What each pose sees of every cell, and how well it sees a person there.

use super::error::{CoverageError, check_count, check_length};
use super::figure::{Figure, Stand, Stands};
use super::floor::{Cell, Floor, Grain, Kind};
use super::limits;
use super::rays::Blockers;
use crate::separation::d_prime;
use glam::DVec3;
use grideye_scene::{Agent, Image, Scene, Sensor, Simulator, count};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

/// A room to try poses in.
#[derive(Debug)]
pub struct Survey {
    /// Without agents and sensors.
    empty: Scene,
    blockers: Blockers,
    floor: Floor,
    figure: Stands,
    frames: u32,
}

/// What one pose sees of each cell, in the order of [`Floor::cells`].
#[derive(Debug, Clone, PartialEq)]
pub struct Look {
    /// The cells.
    pub cells: Vec<Seen>,
}

/// What one pose sees of one cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// The center of its ground.
    pub ground: InSight,
    /// `sqrt(Σ (with - without)²) / sigma` of the person there, in the worst turn that fits; 0 if the cell is not a
    /// place.
    pub contrast: f64,
}

/// Whether a point is seen, from the worst to the best.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum InSight {
    /// It is outside the field of view.
    OutOfView,
    /// It is in the field of view, but hidden.
    Hidden,
    /// It is seen.
    Seen,
}

impl Survey {
    /// A survey of the scene's room for a person.
    ///
    /// # Errors
    /// [`CoverageError`] for invalid or too many cells, and if the person fits nowhere.
    pub fn new(scene: &Scene, figure: &Figure, grain: &Grain) -> Result<Self, CoverageError> {
        check(grain)?;
        let empty = scene.without_agents().with_sensors(Vec::new());
        let blockers = Blockers::new(&empty);
        let stands = figure.in_room(&empty, &grain.turns_deg());
        let floor = Floor::new(&empty, &blockers, &stands, grain)?;
        if floor.places() == 0 {
            return Err(CoverageError::Refused(format!(
                "there is no place for {}: furniture or walls are everywhere\nhint: choose smaller cells or a smaller person",
                figure.name()
            )));
        }
        Ok(Self {
            empty,
            blockers,
            floor,
            figure: stands,
            frames: grain.frames,
        })
    }

    /// The floor.
    #[must_use]
    pub const fn floor(&self) -> &Floor {
        &self.floor
    }

    pub(crate) fn is_free(&self, point_m: DVec3) -> bool {
        self.empty.room().contains(point_m) && !self.blockers.contain(point_m)
    }

    pub(crate) const fn scene(&self) -> &Scene {
        &self.empty
    }

    /// What each sensor sees, independent of the number of threads; `after_each` is called after each look.
    ///
    /// # Errors
    /// [`CoverageError::NoCandidates`], too many poses, and those of [`Self::look`].
    pub fn look_all(
        &self,
        sensors: &[Sensor],
        threads: usize,
        after_each: &(dyn Fn() + Sync),
    ) -> Result<Vec<Look>, CoverageError> {
        self.check_counts(sensors.len())?;
        let look = |index: usize| {
            let look = self.look(&sensors[index]);
            after_each();
            look
        };
        shared(sensors.len(), threads, look)
    }

    /// What one sensor sees.
    ///
    /// # Errors
    /// The sensor has no noise, or the reason why the sensor cannot be simulated.
    pub fn look(&self, sensor: &Sensor) -> Result<Look, CoverageError> {
        let mut eye = self.eye(sensor)?;
        eye.round.clone_from(&self.figure.round);
        let seen = |cell: &Cell| Seen {
            ground: match cell.kind {
                Kind::Outside | Kind::Furniture => InSight::OutOfView,
                Kind::Tight | Kind::Place => self.in_sight(sensor, cell.ground_m),
            },
            contrast: eye.contrast(cell),
        };
        Ok(Look {
            cells: self.floor.cells.iter().map(seen).collect(),
        })
    }

    /// The contrasts at some cells with a person of blocks, in either model: fast, and close enough to rank poses.
    pub(crate) fn glance(
        &self,
        sensor: &Sensor,
        cells: &[usize],
    ) -> Result<Vec<f32>, CoverageError> {
        let mut eye = self.eye(sensor)?;
        let contrast = |cell: &usize| count::single(eye.contrast(&self.floor.cells[*cell]));
        Ok(cells.iter().map(contrast).collect())
    }

    fn eye(&self, sensor: &Sensor) -> Result<Eye, CoverageError> {
        if sensor.noise_sigma <= 0.0 {
            return Err(CoverageError::Refused(format!(
                "sensor `{}` has no noise to compare with\nhint: give it a noise_sigma_c above 0",
                sensor.name
            )));
        }
        let scene = self.empty.with_sensors(vec![sensor.clone()]);
        let simulator = Simulator::new(&scene, &sensor.name)?;
        Ok(Eye {
            nobody: simulator.image(Duration::ZERO),
            simulator,
            sigma_c: sensor.noise_sigma / f64::from(self.frames).sqrt(),
            round: Vec::new(),
        })
    }

    fn in_sight(&self, sensor: &Sensor, ground_m: DVec3) -> InSight {
        // Slightly above the ground, so that the ground does not hide the point.
        let point_m = ground_m + 1e-3 * DVec3::Z;
        let in_sensor = sensor.pose.point_in_sensor(point_m);
        let slopes = sensor.view_slopes();
        let is_in_view = in_sensor.x > 0.0
            && in_sensor.y.abs() <= slopes.x * in_sensor.x
            && in_sensor.z.abs() <= slopes.y * in_sensor.x;
        if !is_in_view {
            InSight::OutOfView
        } else if self.blockers.are_in_sight(sensor.pose.position_m, point_m) {
            InSight::Seen
        } else {
            InSight::Hidden
        }
    }

    pub(super) fn check_counts(&self, sensors: usize) -> Result<(), CoverageError> {
        if sensors == 0 {
            return Err(CoverageError::NoCandidates);
        }
        if sensors > limits::CANDIDATES_MAX {
            return Err(CoverageError::too_many_candidates(sensors));
        }
        let inside = self
            .floor
            .cells
            .iter()
            .filter(|cell| cell.kind != Kind::Outside);
        let cells = inside.count();
        let pairs = sensors.saturating_mul(cells);
        if pairs > limits::PAIRS_MAX {
            return Err(CoverageError::Refused(format!(
                "{sensors} poses times {cells} cells are {pairs} pairs, expected at most {}\nhint: choose a wider spacing of the poses, or larger cells",
                limits::PAIRS_MAX
            )));
        }
        Ok(())
    }
}

/// The results for 0 to `count`, in order, whatever the number of threads.
pub(crate) fn shared<T: Send>(
    count: usize,
    threads: usize,
    of: impl Fn(usize) -> Result<T, CoverageError> + Sync,
) -> Result<Vec<T>, CoverageError> {
    let what = "the number of threads";
    check_count(what, threads, limits::THREADS_MAX, LEAVE_OUT)?;
    let next = AtomicUsize::new(0);
    let work = || {
        let indices = std::iter::repeat_with(|| next.fetch_add(1, Ordering::Relaxed));
        let indices = indices.take_while(|index| *index < count);
        indices.map(|index| (index, of(index))).collect::<Vec<_>>()
    };
    let mut found = std::thread::scope(|scope| {
        let others: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
        let mut found = work();
        for other in others {
            match other.join() {
                Ok(theirs) => found.extend(theirs),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
        found
    });
    found.sort_by_key(|(index, _)| *index);
    found.into_iter().map(|(_, one)| one).collect()
}

/// A sensor in the empty room.
struct Eye {
    simulator: Simulator,
    nobody: Image,
    /// The noise that contrasts are in units of.
    sigma_c: f64,
    /// The person of round segments in each turn, moved rather than copied; if none, blocks are seen.
    round: Vec<Vec<Agent>>,
}

impl Eye {
    /// `sqrt(Σ (with - without)²) / sigma` of the person in the worst turn that fits.
    fn contrast(&mut self, cell: &Cell) -> f64 {
        let of_turns = cell.stands.iter().map(|stand| {
            if self.round.is_empty() && is_out_of_view(self.simulator.sensor(), stand.around_m) {
                return 0.0;
            }
            let somebody = self.somebody(stand);
            d_prime(&somebody, &self.nobody, self.sigma_c)
        });
        of_turns.reduce(f64::min).unwrap_or(0.0)
    }

    /// The image with the person there.
    fn somebody(&mut self, stand: &Stand) -> Image {
        let round = self.round.get_mut(stand.turn).map(std::mem::take);
        let is_round = round.is_some();
        let mut agents = round.unwrap_or_else(|| vec![stand.blocks.clone()]);
        if is_round {
            agents
                .iter_mut()
                .for_each(|agent| agent.start_m = stand.base_m);
        }
        self.simulator.replace_agents(agents);
        let image = self.simulator.image(Duration::ZERO);
        if is_round {
            self.round[stand.turn] = self.simulator.replace_agents(Vec::new());
        }
        image
    }
}

/// Whether a ball is beyond a border of the field of view, outside which the paper's model sees nothing.
fn is_out_of_view(sensor: &Sensor, (middle_m, radius_m): (DVec3, f64)) -> bool {
    let in_sensor = sensor.pose.point_in_sensor(middle_m);
    let slopes = sensor.view_slopes();
    let beyond = |across_m: f64, slope: f64| {
        across_m.abs() - slope * in_sensor.x > radius_m * (1.0 + slope * slope).sqrt()
    };
    beyond(in_sensor.y, slopes.x) || beyond(in_sensor.z, slopes.y)
}

fn check(grain: &Grain) -> Result<(), CoverageError> {
    let hint = "200 mm suits most rooms";
    check_length("the length of a cell", grain.cell_m, hint)?;
    let what = "the number of turns";
    check_count(what, grain.turns, limits::TURNS_MAX, LEAVE_OUT)?;
    if grain.frames == 0 {
        let (what, hint) = ("the number of frames", "1 is a single frame");
        return Err(CoverageError::value(what, &0, "1 or more", hint));
    }
    Ok(())
}

const LEAVE_OUT: &str = "omit it for the default";
