//! What several poses together see of every cell.

use super::floor::{Floor, Kind};
use super::survey::{InSight, Look};
use super::wish::{Rule, Wish};

/// What several poses together see at each cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// Cell by cell, in the order of [`Floor::cells`].
    pub spots: Vec<Spot>,
    /// Totals over all cells.
    pub totals: Totals,
}

/// What several poses together see at one cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// What the cell is.
    pub kind: Kind,
    /// Sensors that see its ground.
    pub seen_by: usize,
    /// How the sensor with the best sight of its ground sees it; `None` if there is no ground to see.
    pub ground: Option<InSight>,
    /// Sensors that each detect a person there alone.
    pub detected_by: usize,
    /// The largest contrast of one sensor for a person there.
    pub best: f64,
    /// The index of that sensor's look; `None` if no sensor has any contrast.
    pub best_look: Option<usize>,
    /// The contrast of all sensors together: the root of the sum of their squares.
    pub together: f64,
}

/// Counts of cells.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Totals {
    /// Cells with ground.
    pub ground: usize,
    /// Cells with ground that at least one sensor sees.
    pub seen: usize,
    /// Blind spots behind furniture or a wall.
    pub hidden: usize,
    /// Blind spots outside every field of view.
    pub out_of_view: usize,
    /// Cells where a person fits.
    pub places: usize,
    /// Places where the wish is met: enough sensors detect a person, or all do together.
    pub detected: usize,
    /// The smallest contrast at a place, by the wish's rule.
    pub contrast_min: f64,
    /// The median: half of the places have this contrast or less.
    pub contrast_median: f64,
}

impl Map {
    /// Combines these looks.
    #[must_use]
    pub fn new(floor: &Floor, looks: &[&Look], wish: &Wish) -> Self {
        let cells = floor.cells.iter().enumerate();
        let spots: Vec<Spot> = cells
            .map(|(index, cell)| spot(cell.kind, looks, index, wish))
            .collect();
        Self {
            totals: totals(&spots, wish),
            spots,
        }
    }
}

impl Spot {
    /// The contrast by this rule.
    #[must_use]
    pub const fn contrast(&self, rule: Rule) -> f64 {
        match rule {
            Rule::Alone => self.best,
            Rule::Together => self.together,
        }
    }

    /// Whether the wish is met there.
    #[must_use]
    pub fn is_detected(&self, wish: &Wish) -> bool {
        self.kind == Kind::Place
            && match wish.rule {
                Rule::Alone => self.detected_by >= wish.sensors_min,
                Rule::Together => self.together >= wish.sigma_min,
            }
    }
}

fn spot(kind: Kind, looks: &[&Look], index: usize, wish: &Wish) -> Spot {
    let mut spot = Spot {
        kind,
        seen_by: 0,
        ground: kind.is_ground().then_some(InSight::OutOfView),
        detected_by: 0,
        best: 0.0,
        best_look: None,
        together: 0.0,
    };
    let mut squares = 0.0;
    for (number, look) in looks.iter().enumerate() {
        let Some(seen) = look.cells.get(index) else {
            continue;
        };
        spot.seen_by += usize::from(seen.ground == InSight::Seen);
        spot.ground = spot.ground.map(|best| best.max(seen.ground));
        spot.detected_by += usize::from(kind == Kind::Place && seen.contrast >= wish.sigma_min);
        if seen.contrast > spot.best {
            (spot.best, spot.best_look) = (seen.contrast, Some(number));
        }
        squares += seen.contrast * seen.contrast;
    }
    spot.together = squares.sqrt();
    spot
}

fn totals(spots: &[Spot], wish: &Wish) -> Totals {
    let count = |counts: &dyn Fn(&Spot) -> bool| spots.iter().filter(|spot| counts(spot)).count();
    let places = spots.iter().filter(|spot| spot.kind == Kind::Place);
    let mut contrasts: Vec<f64> = places.map(|spot| spot.contrast(wish.rule)).collect();
    contrasts.sort_by(f64::total_cmp);
    let middle = contrasts.len().saturating_sub(1) / 2;
    Totals {
        ground: count(&|spot| spot.kind.is_ground()),
        seen: count(&|spot| spot.seen_by > 0),
        hidden: count(&|spot| spot.ground == Some(InSight::Hidden)),
        out_of_view: count(&|spot| spot.ground == Some(InSight::OutOfView)),
        places: contrasts.len(),
        detected: count(&|spot| spot.is_detected(wish)),
        contrast_min: contrasts.first().copied().unwrap_or(0.0),
        contrast_median: contrasts.get(middle).copied().unwrap_or(0.0),
    }
}
