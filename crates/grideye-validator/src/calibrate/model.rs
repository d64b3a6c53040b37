//! The simulator as a function of the unknowns.

use crate::calibrate::frames::Frames;
use crate::calibrate::noise::Noise;
use crate::calibrate::solver::{self, STEP, Solution, State, Until, Weights};
use crate::calibrate::types::Pace;
use crate::error::ValidatorError;
use grideye_frame::PIXELS;
use grideye_scene::uncertain::{Normal, RECORDING_START, Uncertain, with_values};
use grideye_scene::{Files, Film, Model as Physics, Scene};
use std::cell::RefCell;
use std::time::Duration;

/// The physical model integrates along lines a 24th of a pixel apart: over shorter ways than this share of the bounds its
/// derivatives are those of the lines.
const PHYSICAL_STEP: f64 = 0.01;

pub(crate) struct Model<'a> {
    text: String,
    origin: &'a str,
    files: &'a dyn Files,
    sensor: &'a str,
    unknowns: Vec<Uncertain>,
    /// Has the strides of all others: as written, then as found.
    first: Scene,
    pub(crate) searched: Vec<usize>,
    pub(crate) evaluations: u64,
    pace: Pace<'a>,
}

impl<'a> Model<'a> {
    pub(crate) fn new(
        text: &str,
        origin: &'a str,
        files: &'a dyn Files,
        sensor: &'a str,
        pace: Pace<'a>,
    ) -> Result<Self, ValidatorError> {
        // Collisions concern the scene's author, and checking would repeat thousands of times.
        let quiet = format!("collisions = \"ignore\"\n{text}");
        let (text, loaded) = match Scene::parse_without_variants(&quiet, origin, files) {
            Ok(loaded) => (quiet, loaded),
            Err(_) => (
                text.to_owned(),
                Scene::parse_without_variants(text, origin, files)?,
            ),
        };
        let noise = noise_key(sensor);
        let unknowns = unknowns(&loaded.scene);
        let searched = (0..unknowns.len()).filter(|&place| unknowns[place].key != noise);
        Ok(Self {
            searched: searched.collect(),
            text,
            origin,
            files,
            sensor,
            unknowns,
            first: loaded.scene,
            evaluations: 0,
            pace,
        })
    }

    pub(crate) fn start(&self) -> Vec<f64> {
        let share = |one: &Uncertain| (one.value - one.bounds[0]) / (one.bounds[1] - one.bounds[0]);
        let unknowns = self.searched.iter().map(|&place| &self.unknowns[place]);
        unknowns.map(share).collect()
    }

    /// The values of all unknowns at a point; those not searched keep theirs.
    pub(crate) fn values(&self, point: &[f64]) -> Vec<f64> {
        let mut values: Vec<f64> = self.unknowns.iter().map(|one| one.value).collect();
        for (&place, share) in self.searched.iter().zip(point) {
            let [low, high] = self.unknowns[place].bounds;
            values[place] = (low + share * (high - low)).clamp(low, high);
        }
        values
    }

    fn scene(&self, point: &[f64]) -> Result<Scene, ValidatorError> {
        let mut scene = self.parsed(point)?;
        // A height that shifts the strides of a long walk would have a minimum at each number of strides.
        scene.keep_strides_of(&self.first);
        Ok(scene)
    }

    fn parsed(&self, point: &[f64]) -> Result<Scene, ValidatorError> {
        let text = with_values(&self.text, &self.unknowns, &self.values(point));
        Ok(Scene::parse_without_variants(&text, self.origin, self.files)?.scene)
    }

    /// Lets people stride as their height at this point makes them, if that fits better.
    pub(crate) fn stride_as_found(
        &mut self,
        state: &mut State,
        (frames, noise): (&Frames, &Noise),
    ) -> Result<(), ValidatorError> {
        let mut keys = self.searched.iter().map(|&place| &self.unknowns[place].key);
        if !keys.any(|key| key.ends_with(".person.height_mm")) {
            return Ok(());
        }
        let found = self.parsed(&state.point)?;
        let before = std::mem::replace(&mut self.first, found);
        let raw = self.left_over(&state.point, frames)?;
        let square = |raw: &[f64]| {
            noise
                .whiten(raw)
                .iter()
                .map(|value| value * value)
                .sum::<f64>()
        };
        if square(&raw) < square(&state.raw) {
            state.raw = raw;
        } else {
            self.first = before;
        }
        Ok(())
    }

    fn images(&mut self, point: &[f64], times: &[Duration]) -> Result<Vec<f64>, ValidatorError> {
        self.evaluations += 1;
        let scene = self.scene(point)?;
        // No two frames are of one time, and the next scene is another.
        let film = Film::new(&scene, self.sensor, 0)?;
        let start_s = self.start_s(point);
        let mut images = Vec::with_capacity(times.len() * PIXELS);
        for time in times {
            let at_s = (time.as_secs_f64() + start_s).max(0.0);
            let at = Duration::try_from_secs_f64(at_s).unwrap_or(Duration::MAX);
            images.extend(film.image(at).celsius);
        }
        Ok(images)
    }

    fn start_s(&self, point: &[f64]) -> f64 {
        let mut unknowns = self.unknowns.iter();
        let place = unknowns.position(|one| one.key == RECORDING_START);
        place.map_or(0.0, |place| self.values(point)[place])
    }

    pub(crate) fn left_over(
        &mut self,
        point: &[f64],
        frames: &Frames,
    ) -> Result<Vec<f64>, ValidatorError> {
        let images = self.images(point, &frames.times)?;
        let pairs = frames.celsius.iter().zip(images);
        Ok(pairs.map(|(real, simulated)| real - simulated).collect())
    }

    /// The laws of the unknowns searched, in coordinates from 0 to 1.
    pub(crate) fn priors(&self) -> Vec<Option<Normal>> {
        let prior = |one: &Uncertain| {
            let [low, high] = one.bounds;
            one.law.map(|law| Normal {
                mean: (law.mean - low) / (high - low),
                sd: law.sd / (high - low),
            })
        };
        let unknowns = self.searched.iter().map(|&place| &self.unknowns[place]);
        unknowns.map(prior).collect()
    }

    pub(crate) fn begin(
        &mut self,
        start: &[f64],
        frames: &Frames,
    ) -> Result<State, ValidatorError> {
        let step = match self.first.model() {
            Physics::Physical => PHYSICAL_STEP,
            _ => STEP,
        };
        State::new(&mut |point| self.left_over(point, frames), (start, step))
    }

    /// Searches on from a state, and returns the cost.
    pub(crate) fn search(
        &mut self,
        (frames, noise): (&Frames, &Noise),
        state: &mut State,
        (steps_max, until): (usize, Until),
    ) -> Result<f64, ValidatorError> {
        self.pace.begin(steps_max, frames.len());
        let priors = self.priors();
        let weights = Weights {
            whiten: &|raw| noise.whiten(raw),
            priors: &priors,
        };
        let model = RefCell::new(self);
        let mut raw_at = |point: &[f64]| model.borrow_mut().left_over(point, frames);
        let stepped = || model.borrow_mut().pace.step();
        let cost = solver::search(&mut raw_at, stepped, &weights, state, (steps_max, until))?;
        model.borrow_mut().pace.end();
        Ok(cost)
    }

    pub(crate) fn skip(&mut self, steps: usize, frames: &Frames) {
        self.pace.begin(steps, frames.len());
        self.pace.end();
    }

    /// Takes the derivatives at a state's point more exactly.
    pub(crate) fn refine(
        &mut self,
        state: &mut State,
        frames: &Frames,
        halves: &[f64],
    ) -> Result<(), ValidatorError> {
        state.refine(halves, &mut |point| self.left_over(point, frames))
    }

    pub(crate) fn solution(&self, state: &State, noise: &Noise) -> Solution {
        let weights = Weights {
            whiten: &|raw| noise.whiten(raw),
            priors: &self.priors(),
        };
        weights.solution(state)
    }
}

/// Checks that the scene parses with each bound, the other unknowns as written.
pub(crate) fn check_bounds(
    (text, origin): (&str, &str),
    unknowns: &[Uncertain],
    files: &dyn Files,
) -> Result<(), ValidatorError> {
    for (place, one) in unknowns.iter().enumerate() {
        for (value, which) in one.bounds.into_iter().zip(["lower", "upper"]) {
            let mut values: Vec<f64> = unknowns.iter().map(|one| one.value).collect();
            values[place] = value;
            let text = with_values(text, unknowns, &values);
            Scene::parse_without_variants(&text, origin, files).map_err(|source| {
                let key = &one.key;
                ValidatorError::Refused(format!(
                    "the {which} bound {value} of `{key}` is not valid in the scene: {source}"
                ))
            })?;
        }
    }
    Ok(())
}

/// What a calibration finds, in the order of the file.
pub(crate) fn unknowns(scene: &Scene) -> Vec<Uncertain> {
    let fitted = scene.uncertain().iter().filter(|one| one.is_fitted);
    fitted.cloned().collect()
}

/// Key of the sensor's noise, which is measured on the residuals instead of searched.
pub(crate) fn noise_key(sensor: &str) -> String {
    format!("sensor.{sensor}.noise_sigma_c")
}
