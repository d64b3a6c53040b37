//! The floor in cells: what is on each, and where a person fits.

use super::error::CoverageError;
use super::figure::{Stand, Stands};
use super::limits;
use super::rays::Blockers;
use glam::{DVec2, DVec3, USizeVec2};
use grideye_scene::{FreeSpace, Room, Scene, count, polygon::bounds};

/// How finely to survey a floor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grain {
    /// Approximate length of a cell, meters; cells of equal size fill the room.
    pub cell_m: f64,
    /// Turns of the person at each place, evenly over half a turn: 2 are 0° and 90°.
    pub turns: usize,
    /// How many frames are averaged.
    pub frames: u32,
}

impl Grain {
    pub(crate) fn turns_deg(&self) -> Vec<f64> {
        let turns = count::float(self.turns);
        let turn = |turn: usize| 180.0 * count::float(turn) / turns;
        (0..self.turns).map(turn).collect()
    }
}

impl Default for Grain {
    /// Cells of 0.2 m, 2 turns, single frames.
    fn default() -> Self {
        Self {
            cell_m: 0.2,
            turns: 2,
            frames: 1,
        }
    }
}

/// A room's floor in cells: row by row from the front, each row from the left.
#[derive(Debug, Clone)]
pub struct Floor {
    /// Cells in a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// The sides of a cell, meters.
    pub cell_m: DVec2,
    /// The cells.
    pub cells: Vec<Cell>,
}

/// One cell.
#[derive(Debug, Clone)]
pub struct Cell {
    /// The center of its ground, meters.
    pub ground_m: DVec3,
    /// What is there.
    pub kind: Kind,
    pub(crate) stands: Vec<Stand>,
}

/// What a cell is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Beyond the walls.
    Outside,
    /// Something the person cannot be on stands there.
    Furniture,
    /// Ground too close to a wall or an object for the person.
    Tight,
    /// Ground where the person fits.
    Place,
}

impl Kind {
    /// Whether there is visible ground.
    #[must_use]
    pub const fn is_ground(self) -> bool {
        matches!(self, Self::Tight | Self::Place)
    }
}

impl Floor {
    pub(crate) fn new(
        scene: &Scene,
        blockers: &Blockers,
        figure: &Stands,
        grain: &Grain,
    ) -> Result<Self, CoverageError> {
        let (low, high) = bounds(scene.room().outline_m().into_iter());
        let size = high - low;
        let count = (size / grain.cell_m).round().max(DVec2::ONE);
        if count.x * count.y > count::float(limits::CELLS_MAX) {
            let found = count::floor(count.x * count.y);
            return Err(CoverageError::Refused(format!(
                "{found} cells of the floor, expected at most {}\nhint: choose larger cells",
                limits::CELLS_MAX
            )));
        }
        let counts = USizeVec2::new(count::floor(count.x), count::floor(count.y));
        let builder = Builder {
            room: scene.room(),
            level_m: scene.room().bounds_m().0.z,
            free: FreeSpace::of(scene),
            blockers,
            figure,
            grain,
        };
        let cell_m = size / count;
        let middle = |index: usize| {
            let place = DVec2::new(
                count::float(index % counts.x),
                count::float(index / counts.x),
            );
            low + (place + 0.5) * cell_m
        };
        Ok(Self {
            columns: counts.x,
            rows: counts.y,
            cell_m,
            cells: (0..counts.x * counts.y)
                .map(|index| builder.cell(middle(index)))
                .collect(),
        })
    }

    /// The number of cells where a person fits.
    #[must_use]
    pub fn places(&self) -> usize {
        let places = self.cells.iter().filter(|cell| cell.kind == Kind::Place);
        places.count()
    }
}

struct Builder<'a> {
    room: &'a Room,
    /// The height of the floor.
    level_m: f64,
    free: FreeSpace,
    blockers: &'a Blockers,
    figure: &'a Stands,
    grain: &'a Grain,
}

impl Builder<'_> {
    fn cell(&self, at_m: DVec2) -> Cell {
        let cell = |height_m: f64, kind: Kind, stands: Vec<Stand>| Cell {
            ground_m: at_m.extend(height_m),
            kind,
            stands,
        };
        // A mesh may be a room with several levels; anything not above the lowest counts as outside.
        if !self.room.contains(at_m.extend(self.level_m + 1e-3)) {
            return cell(self.level_m, Kind::Outside, Vec::new());
        }
        let Some(height_m) = self.ground_m(at_m) else {
            return cell(self.level_m, Kind::Furniture, Vec::new());
        };
        let turns = self.grain.turns_deg();
        let stands: Vec<Stand> = turns
            .into_iter()
            .enumerate()
            .map(|turn| self.figure.at(at_m.extend(height_m), self.level_m, turn))
            .filter(|stand| self.free.holds(&stand.blocks.parts))
            .collect();
        match stands.is_empty() {
            true => cell(height_m, Kind::Tight, stands),
            false => cell(height_m, Kind::Place, stands),
        }
    }

    fn ground_m(&self, at_m: DVec2) -> Option<f64> {
        let spans = self.blockers.column(at_m);
        let is_free = |height_m: &f64| {
            let low = height_m + FreeSpace::TOLERANCE_M;
            let high = height_m + self.figure.height_m - FreeSpace::TOLERANCE_M;
            spans.iter().all(|span| span.1 <= low || span.0 >= high)
        };
        let highest = self.level_m + self.figure.climbs_m + FreeSpace::TOLERANCE_M;
        let tops = spans.iter().map(|span| span.1);
        std::iter::once(self.level_m)
            .chain(tops.filter(|top| *top <= highest))
            .filter(is_free)
            .reduce(f64::max)
    }
}
