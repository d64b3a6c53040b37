//! Searches the few poses that together detect a person at the most places.
//!
//! Glances at some places rank all candidates; those that look best are moved and turned until nothing gets better, and
//! the survey looks from the best of these. So each pose is chosen in turn, and then again beside all others.

use super::candidates::{Candidate, Mounts};
use super::error::CoverageError;
use super::floor::Kind;
use super::survey::{Look, Survey, shared};
use super::wish::{Gain, Tally, Wish, check};
use glam::DVec2;
use grideye_scene::count;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The poses that a search chose.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// In the order chosen.
    pub steps: Vec<Step>,
    /// How many poses it rated.
    pub tried: usize,
}

/// One more pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// The pose.
    pub pose: Candidate,
    /// What it sees.
    pub look: Look,
    /// Mean share of [`Wish::sensors_min`] over all places, using this pose and all earlier ones.
    pub objective: f64,
}

/// How poses that look good are improved: meters and degrees, from coarse to fine.
const MOVES: [(f64, f64); 4] = [(0.3, 12.0), (0.15, 6.0), (0.08, 3.0), (0.04, 1.5)];
/// The same for the best, by exact looks.
const POLISH: [(f64, f64); 4] = [(0.3, 10.0), (0.15, 5.0), (0.08, 2.5), (0.04, 1.2)];
const WAYS: [DVec2; 4] = [DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::NEG_Y];
/// At most so many rounds of each kind of move.
const ROUNDS_MAX: usize = 6;
/// So many candidates are improved for each choice, fewer when a pose is chosen again, and the survey looks from so many of
/// the results.
const STARTS: usize = 12;
const STARTS_AGAIN: usize = 4;
const FINALISTS: usize = 6;
/// Starts closer together, and turned by less, would end at one pose.
const APART_M: f64 = 0.8;
const APART_COS: f64 = 0.85;
/// Glances are at so many places, evenly spread.
const PLACES_MAX: usize = 120;
/// How long an improvement and a look take beside a glance.
const START_STEPS: usize = 90;
const LOOK_STEPS: usize = 5;
const CHOICE_STEPS: usize = (FINALISTS + 2 * WAYS.len() * POLISH.len()) * LOOK_STEPS;
/// How often each pose is chosen again beside all others.
const SWEEPS_MAX: usize = 2;

/// Chooses up to `count` poses like the candidates in addition to the sensors of `kept`. `progress` is called with what
/// is done and the whole, in steps of about equal time.
///
/// # Errors
/// [`CoverageError::NoCandidates`], an invalid wish, and those of [`Survey::look`].
pub fn search(
    survey: &Survey,
    (candidates, mounts): (&[Candidate], &Mounts),
    kept: &[Look],
    (count, wish): (usize, &Wish),
    threads: usize,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Choice, CoverageError> {
    check(count, wish)?;
    survey.check_counts(candidates.len())?;
    let again = if count > 1 { SWEEPS_MAX * count } else { 0 };
    let starts = count * STARTS + again * STARTS_AGAIN;
    let whole = candidates.len() + starts * START_STEPS + (count + again) * CHOICE_STEPS;
    let done = AtomicUsize::new(0);
    let step = |steps: usize| {
        let done = done.fetch_add(steps, Ordering::Relaxed) + steps;
        progress(done.min(whole), whole);
    };
    let search = Search {
        survey,
        mounts,
        cells: spread(survey),
        wish,
        kept,
        threads,
        tried: AtomicUsize::new(0),
        step: &step,
    };
    let pool = shared(candidates.len(), threads, |candidate| {
        let trial = search.trial(candidates[candidate].clone());
        search.advance(1);
        trial
    })?;
    let steps = search.choose(&pool, count)?;
    Ok(Choice {
        steps,
        tried: search.tried.into_inner(),
    })
}

struct Search<'a> {
    survey: &'a Survey,
    mounts: &'a Mounts,
    /// The cells of glances.
    cells: Vec<usize>,
    wish: &'a Wish,
    kept: &'a [Look],
    threads: usize,
    tried: AtomicUsize,
    step: &'a (dyn Fn(usize) + Sync),
}

/// A pose with the contrasts of a glance.
#[derive(Debug, Clone)]
struct Trial {
    pose: Candidate,
    contrasts: Vec<f32>,
}

impl Trial {
    fn gain(&self, given: &Tally<'_>) -> Gain {
        given.gain(self.contrasts.iter().copied().map(f64::from))
    }
}

impl Search<'_> {
    fn advance(&self, steps: usize) {
        (self.step)(steps);
    }

    fn trial(&self, pose: Candidate) -> Result<Trial, CoverageError> {
        self.tried.fetch_add(1, Ordering::Relaxed);
        let contrasts = self.survey.glance(&pose.sensor, &self.cells)?;
        Ok(Trial { pose, contrasts })
    }

    fn choose(&self, pool: &[Trial], count: usize) -> Result<Vec<Step>, CoverageError> {
        let mut chosen: Vec<(Candidate, Look)> = Vec::new();
        for _ in 0..count {
            let (best, gain) = self.best_beside(&chosen, pool, STARTS)?;
            if gain.is_nothing() {
                break;
            }
            chosen.push(best);
        }
        for _ in 0..if chosen.len() > 1 { SWEEPS_MAX } else { 0 } {
            let mut is_better = false;
            for index in 0..chosen.len() {
                let before = chosen.remove(index);
                let gain_before = self.tally(&chosen, None).gain(self.exact(&before.1));
                let (best, gain) = self.best_beside(&chosen, pool, STARTS_AGAIN)?;
                let replaces = gain.cmp(&gain_before).is_gt();
                is_better |= replaces;
                chosen.insert(index, if replaces { best } else { before });
            }
            if !is_better {
                break;
            }
        }
        Ok(self.steps_of(chosen))
    }

    /// The chosen poses, those first that add most.
    fn steps_of(&self, mut chosen: Vec<(Candidate, Look)>) -> Vec<Step> {
        let mut tally = self.tally(&[], None);
        let whole = count::float(self.survey.floor().places() * self.wish.sensors_min);
        let mut steps = Vec::new();
        while !chosen.is_empty() {
            let gain = |index: &usize| tally.gain(self.exact(&chosen[*index].1));
            let best = (0..chosen.len())
                .rev()
                .max_by(|one, other| gain(one).cmp(&gain(other)));
            let (pose, look) = chosen.remove(best.unwrap_or(0));
            tally.add(self.exact(&look));
            steps.push(Step {
                objective: count::float(tally.points()) / whole,
                pose,
                look,
            });
        }
        steps
    }

    /// The best further pose, and what it adds.
    fn best_beside(
        &self,
        chosen: &[(Candidate, Look)],
        pool: &[Trial],
        most: usize,
    ) -> Result<((Candidate, Look), Gain), CoverageError> {
        let given = self.tally(chosen, Some(&self.cells));
        let starts = starts(pool, &given, most);
        let mut improved = shared(starts.len(), self.threads, |start| {
            let improved = self.improved(starts[start].clone(), &given);
            self.advance(START_STEPS);
            improved
        })?;
        self.advance((most - improved.len()) * START_STEPS);
        improved.sort_by(|one, other| other.gain(&given).cmp(&one.gain(&given)));
        let finalists = improved.into_iter().take(FINALISTS).map(|trial| trial.pose);
        let finalists: Vec<Candidate> = finalists.collect();
        let looks = self.look(&finalists)?;
        let given = self.tally(chosen, None);
        let best = self.best_of(finalists, looks, &given);
        self.polished(best.ok_or(CoverageError::NoCandidates)?, &given)
    }

    fn best_of(
        &self,
        poses: Vec<Candidate>,
        looks: Vec<Look>,
        given: &Tally<'_>,
    ) -> Option<((Candidate, Look), Gain)> {
        let rated = poses.into_iter().zip(looks).map(|pose| {
            let gain = given.gain(self.exact(&pose.1));
            (pose, gain)
        });
        rated.reduce(|one, other| match other.1.cmp(&one.1).is_gt() {
            true => other,
            false => one,
        })
    }

    /// The last moves by exact looks.
    fn polished(
        &self,
        mut best: ((Candidate, Look), Gain),
        given: &Tally<'_>,
    ) -> Result<((Candidate, Look), Gain), CoverageError> {
        for (by_m, by_deg) in POLISH {
            let moved = WAYS.map(|way| {
                let of =
                    |by_m: f64, by_deg: f64| best.0.0.moved(by_m * way, by_deg * way, self.mounts);
                [of(0.0, by_deg), of(by_m, 0.0)]
            });
            let poses = moved.into_iter().flatten().flatten();
            let poses = poses.filter(|pose| self.is_other(pose, &best.0.0));
            let poses: Vec<Candidate> = poses.collect();
            self.tried.fetch_add(poses.len(), Ordering::Relaxed);
            let looks = self.look(&poses)?;
            let other = self.best_of(poses, looks, given);
            if let Some(other) = other.filter(|other| other.1.cmp(&best.1).is_gt()) {
                best = other;
            }
        }
        Ok(best)
    }

    fn look(&self, poses: &[Candidate]) -> Result<Vec<Look>, CoverageError> {
        shared(poses.len(), self.threads, |pose| {
            let look = self.survey.look(&poses[pose].sensor);
            self.advance(LOOK_STEPS);
            look
        })
    }

    /// A pose moved and turned until nothing near it gains more.
    fn improved(&self, mut best: Trial, given: &Tally<'_>) -> Result<Trial, CoverageError> {
        let mut gain = best.gain(given);
        for (step_m, step_deg) in MOVES {
            for _ in 0..ROUNDS_MAX {
                let before = gain;
                for way in WAYS {
                    for (by_m, by_deg) in [(0.0, step_deg), (step_m, 0.0)] {
                        let moved = best.pose.moved(by_m * way, by_deg * way, self.mounts);
                        let Some(pose) = moved.filter(|pose| self.is_other(pose, &best.pose))
                        else {
                            continue;
                        };
                        let trial = self.trial(pose)?;
                        let gained = trial.gain(given);
                        if gained.cmp(&gain).is_gt() {
                            (best, gain) = (trial, gained);
                        }
                    }
                }
                if gain == before {
                    break;
                }
            }
        }
        Ok(best)
    }

    fn is_other(&self, pose: &Candidate, best: &Candidate) -> bool {
        pose != best && self.survey.is_free(pose.sensor.pose.position_m)
    }

    /// What the kept and the chosen poses achieve at these cells, or at all places.
    fn tally(&self, chosen: &[(Candidate, Look)], cells: Option<&[usize]>) -> Tally<'_> {
        let mut tally = Tally::new(
            self.wish,
            cells.map_or(self.survey.floor().places(), <[usize]>::len),
        );
        for look in self.kept.iter().chain(chosen.iter().map(|(_, look)| look)) {
            match cells {
                Some(cells) => tally.add(cells.iter().map(|cell| look.cells[*cell].contrast)),
                None => tally.add(self.exact(look)),
            }
        }
        tally
    }

    /// The contrasts at all places.
    fn exact<'a>(&'a self, look: &'a Look) -> impl Iterator<Item = f64> + 'a {
        let cells = self.survey.floor().cells.iter().zip(&look.cells);
        let places = cells.filter(|(cell, _)| cell.kind == Kind::Place);
        places.map(|(_, seen)| seen.contrast)
    }
}

/// At most so many candidates that gain most, none of which is close to another.
fn starts<'a>(pool: &'a [Trial], given: &Tally<'_>, most: usize) -> Vec<&'a Trial> {
    let pool = pool.iter();
    let mut rated: Vec<(Gain, &Trial)> = pool.map(|trial| (trial.gain(given), trial)).collect();
    rated.sort_by(|one, other| other.0.cmp(&one.0));
    let mut starts: Vec<&Trial> = Vec::new();
    for (_, trial) in rated {
        let pose = &trial.pose.sensor.pose;
        let axis = pose.world_from_sensor().x_axis;
        let is_close = |start: &&Trial| {
            let other = &start.pose.sensor.pose;
            other.position_m.distance(pose.position_m) < APART_M
                && other.world_from_sensor().x_axis.dot(axis) > APART_COS
        };
        if starts.len() < most && !starts.iter().any(is_close) {
            starts.push(trial);
        }
    }
    starts
}

/// Places evenly all over the floor.
fn spread(survey: &Survey) -> Vec<usize> {
    let floor = survey.floor();
    let every = floor.places().div_ceil(PLACES_MAX);
    // Not in columns: the next row begins further on.
    let (columns, shift) = (floor.columns, (every / 2).max(1));
    let is_asked = |index: &usize| (index % columns + index / columns * shift) % every == 0;
    let places = (0..floor.cells.len()).filter(|index| floor.cells[*index].kind == Kind::Place);
    places.filter(is_asked).collect()
}
