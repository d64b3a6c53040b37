//! Picks the few poses that together see the most, one after the other.

use super::error::{CoverageError, check_count};
use super::floor::{Floor, Kind};
use super::limits;
use super::survey::Look;
use grideye_scene::count;

/// What the sensors must achieve together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wish {
    /// A person counts as detected from this contrast on; 3 is the usual limit of detection.
    pub sigma_min: f64,
    /// How many sensors must detect a person at each place.
    pub sensors_min: usize,
    /// Which sensors count as one detector.
    pub rule: Rule,
}

/// Which sensors count as one detector.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// Each sensor by itself.
    Alone,
    /// All sensors together: the squares of their contrasts add, because their noise is independent.
    Together,
}

impl Default for Wish {
    /// One sensor by itself, from 3 sigma on.
    fn default() -> Self {
        Self {
            sigma_min: 3.0,
            sensors_min: 1,
            rule: Rule::Alone,
        }
    }
}

/// A greedy choice.
#[derive(Debug, Clone, PartialEq)]
pub struct Pick {
    /// The poses in the order chosen.
    pub steps: Vec<Step>,
    /// Whether each step reaches at least 1 - 1/e of the best choice (Nemhauser et al. 1978); false with
    /// [`Rule::Together`].
    pub is_submodular: bool,
}

/// One more pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// The index of its look.
    pub chosen: usize,
    /// Mean share of [`Wish::sensors_min`] over all places, using this pose and all earlier ones.
    pub objective: f64,
    /// An upper bound for any choice of as many poses, if the objective is submodular.
    pub objective_max: Option<f64>,
}

/// Chooses up to `count` looks in addition to `kept`, greedily by objective, then by contrast up to twice the
/// threshold.
///
/// # Errors
/// [`CoverageError::Value`].
pub fn pick(
    floor: &Floor,
    looks: &[Look],
    kept: &[usize],
    count: usize,
    wish: &Wish,
) -> Result<Pick, CoverageError> {
    check(count, wish)?;
    let chooser = Chooser::new(floor, looks, wish);
    let mut state = chooser.start(kept);
    let mut taken = kept.to_vec();
    let is_submodular = wish.rule == Rule::Alone;
    let mut bounds = vec![f64::INFINITY; count];
    let mut steps: Vec<Step> = Vec::new();
    loop {
        let mut gains = chooser.gains(&state, &taken);
        let reached = chooser.objective(&state);
        tighten(&mut bounds, reached, &gains);
        if let (Some(last), true) = (steps.last_mut(), is_submodular) {
            // A mean share cannot exceed 1.
            let bound = bounds.get(taken.len() - kept.len() - 1);
            last.objective_max = bound.map(|bound| bound.min(1.0));
        }
        if steps.len() == count {
            break;
        }
        gains.sort_by(Gain::best_first);
        let Some(best) = gains
            .first()
            .filter(|gain| gain.objective > 0.0 || gain.contrast > 0.0)
        else {
            break;
        };
        chooser.add(&mut state, best.look);
        taken.push(best.look);
        steps.push(Step {
            chosen: best.look,
            objective: chooser.objective(&state),
            objective_max: None,
        });
    }
    Ok(Pick {
        steps,
        is_submodular,
    })
}

/// For a submodular objective, no choice of j poses exceeds any set's objective plus the j largest remaining gains.
fn tighten(bounds: &mut [f64], reached: f64, gains: &[Gain]) {
    let mut largest: Vec<f64> = gains.iter().map(|gain| gain.objective).collect();
    largest.sort_by(|one, other| other.total_cmp(one));
    let mut bound = reached;
    let mut gains = largest.into_iter();
    for least in bounds {
        bound += gains.next().unwrap_or(0.0);
        *least = least.min(bound);
    }
}

struct Chooser<'a> {
    looks: &'a [Look],
    /// The cells that are places.
    places: Vec<usize>,
    wish: &'a Wish,
}

#[derive(Debug, Clone, Copy, Default)]
struct Have {
    detecting: usize,
    /// Sum of the squares of the contrasts, and the largest contrast.
    squares: f64,
    largest: f64,
}

#[derive(Debug, Clone, Copy)]
struct Gain {
    look: usize,
    objective: f64,
    contrast: f64,
}

impl Gain {
    fn best_first(one: &Self, other: &Self) -> std::cmp::Ordering {
        let by_objective = other.objective.total_cmp(&one.objective);
        let by_contrast = other.contrast.total_cmp(&one.contrast);
        by_objective
            .then(by_contrast)
            .then(one.look.cmp(&other.look))
    }
}

impl<'a> Chooser<'a> {
    fn new(floor: &Floor, looks: &'a [Look], wish: &'a Wish) -> Self {
        let cells = floor.cells.iter().enumerate();
        Self {
            looks,
            places: cells
                .filter(|(_, cell)| cell.kind == Kind::Place)
                .map(|(index, _)| index)
                .collect(),
            wish,
        }
    }

    fn start(&self, kept: &[usize]) -> Vec<Have> {
        let mut state = vec![Have::default(); self.places.len()];
        for look in kept {
            self.add(&mut state, *look);
        }
        state
    }

    fn add(&self, state: &mut [Have], look: usize) {
        for (have, contrast) in state.iter_mut().zip(self.contrasts(look)) {
            *have = have.with(contrast, self.wish);
        }
    }

    fn contrasts(&self, look: usize) -> impl Iterator<Item = f64> {
        let cells = self.looks.get(look).map_or(&[][..], |look| &look.cells);
        let contrast = |place: &usize| cells.get(*place).map_or(0.0, |seen| seen.contrast);
        self.places.iter().map(contrast)
    }

    fn objective(&self, state: &[Have]) -> f64 {
        let whole = count::float(state.len().max(1) * self.wish.sensors_min);
        let points = state.iter().map(|have| have.points(self.wish));
        count::float(points.sum::<usize>()) / whole
    }

    fn gains(&self, state: &[Have], taken: &[usize]) -> Vec<Gain> {
        let whole = count::float(state.len().max(1) * self.wish.sensors_min);
        let cap = 2.0 * self.wish.sigma_min;
        let left = (0..self.looks.len()).filter(|look| !taken.contains(look));
        left.map(|look| {
            let (mut points, mut contrast) = (0, 0.0);
            for (have, more) in state.iter().zip(self.contrasts(look)) {
                let then = have.with(more, self.wish);
                points += then.points(self.wish) - have.points(self.wish);
                contrast += then.largest.min(cap) - have.largest.min(cap);
            }
            Gain {
                look,
                objective: count::float(points) / whole,
                contrast,
            }
        })
        .collect()
    }
}

impl Have {
    fn with(self, contrast: f64, wish: &Wish) -> Self {
        Self {
            detecting: self.detecting + usize::from(contrast >= wish.sigma_min),
            squares: self.squares + contrast * contrast,
            largest: self.largest.max(contrast),
        }
    }

    fn points(self, wish: &Wish) -> usize {
        match wish.rule {
            Rule::Alone => self.detecting.min(wish.sensors_min),
            Rule::Together => usize::from(self.squares.sqrt() >= wish.sigma_min),
        }
    }
}

fn check(count: usize, wish: &Wish) -> Result<(), CoverageError> {
    let at_each_place = "the number of sensors at each place";
    let counts = [
        ("the number of poses to pick", count),
        (at_each_place, wish.sensors_min),
    ];
    for (what, found) in counts {
        let hint = "2 is a good start for one room";
        check_count(what, found, limits::PICKED_MAX, hint)?;
    }
    if !(wish.sigma_min.is_finite() && wish.sigma_min > 0.0) {
        let (what, found) = (
            "the contrast to detect",
            format!("{} sigma", wish.sigma_min),
        );
        let hint = "3 sigma is the usual limit of detection";
        return Err(CoverageError::value(what, &found, "a number above 0", hint));
    }
    if wish.rule == Rule::Together && wish.sensors_min != 1 {
        let expected = "1, if the sensors detect together";
        let hint = "count sensors that detect alone, or let all detect together";
        return Err(CoverageError::value(
            at_each_place,
            &wish.sensors_min,
            expected,
            hint,
        ));
    }
    Ok(())
}
