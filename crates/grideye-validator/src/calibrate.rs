//! A scene's unknowns, found from a recording: poses, temperatures, emissivities, angles of view, the time at which the
//! recording begins; with an honest uncertainty for each.
//!
//! ```text
//!  scene with [[fit]] tables ──▶ simulator ──┐
//!  recording ─────────────────▶ frames ──────┴─▶ what is left over ──▶ Levenberg and Marquardt, from several starts
//!                                                  │      ▲                         │
//!                                                  ▼      └─ weights ◀─┐            ▼
//!                                  white noise, pattern, common mode ──┘     values, uncertainties, what cannot be told apart
//! ```
//!
//! # What the uncertainty holds
//! What is left over is taken apart into white noise, what each pixel keeps for the whole recording (its fixed pattern,
//! and what is wrong with the scene where nothing moves), and what all pixels do together (correlated in time). Each
//! part is weighted by its own variance, measured on the recording itself; a profile of the sensor tells the common
//! mode better than ten seconds can. The 95 % interval is that of Student's t with as many degrees of freedom as the
//! parts have, by their shares in the unknown's variance (Satterthwaite 1946, Biometrics Bulletin 2:110). Where the
//! white part is not white, because bodies move otherwise than the scene says, the uncertainty is widened by as much as
//! neighbouring frames repeat one another, and a warning says so.
//!
//! What no recording shows is not in it: the accuracy of the sensor as a whole (±2.5 °C, AMG88 spec §4-4), which goes
//! into every temperature, and drift that is slower than the recording.
//!
//! # What is not found
//! Numbers that the recording does not tell apart, such as emissivity and temperature of a body that is seen from one
//! distance, are named in a warning, with their correlation. An unknown at one of its bounds has no uncertainty.

mod error;
mod frames;
mod linear;
mod model;
mod noise;
mod progress;
mod show;
mod solver;
mod uncertainty;

pub use error::CalibrateError;
pub use progress::Progress;

use frames::Frames;
use grideye_frame::PIXELS;
use grideye_recording::Record;
use grideye_scene::profile::Profile;
use grideye_scene::{Files, Scene};
use model::{Model, Weighted};
use noise::{Freedom, Noise, Parts};
use progress::Pace;
use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};
use solver::Solution;
use std::time::Duration;
use uncertainty::Uncertainty;

/// Frames that are looked at unless another number is asked for.
pub const FRAMES_DEFAULT: usize = 200;
/// The fewest frames from which anything is said.
pub const FRAMES_MIN: usize = 10;
/// The most frames that are looked at: the common part is weighted by a matrix of as many rows.
pub const FRAMES_MAX: usize = 1_000;
/// The most places to start from.
pub const STARTS_MAX: usize = 100;
/// Frames that the search from several starts looks at.
const COARSE_FRAMES: usize = 24;
/// Steps of each search.
const COARSE_STEPS: usize = 12;
const FINE_STEPS: usize = 40;
/// How often the noise is measured anew on what the best fit leaves over.
const ROUNDS: usize = 3;
/// Starts whose cost is within this share of the best have found the same.
const SAME_COST: f64 = 0.01;

/// How to calibrate. Every default can be left as it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Seed of the starts.
    pub seed: u64,
    /// Places to start from, 1 to [`STARTS_MAX`]; the first is the scene as it stands.
    pub starts: usize,
    /// Frames to look at, [`FRAMES_MIN`] to [`FRAMES_MAX`], chosen evenly; by default [`FRAMES_DEFAULT`].
    pub frames: Option<usize>,
    /// What is known of the sensor: its pattern is taken off, its common mode is believed.
    pub profile: Option<Profile>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            seed: 1,
            starts: 8,
            frames: None,
            profile: None,
        }
    }
}

/// One unknown, found.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Found {
    /// What it is, as the scene spells it.
    pub key: String,
    /// Where the search began.
    pub start: f64,
    /// The value.
    pub value: f64,
    /// Its standard uncertainty; `None` if the recording does not tell it, or it lies at a bound.
    pub uncertainty: Option<f64>,
    /// Half the width of its 95 % interval; `None` likewise.
    pub half_width_95: Option<f64>,
    /// Degrees of freedom of that interval.
    pub freedom: f64,
    /// Between which it was looked for.
    pub bounds: [f64; 2],
    /// Whether it lies at one of them.
    pub at_bound: bool,
}

/// What a recording says of a scene.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Calibration {
    /// The unknowns, in the order of the file.
    pub found: Vec<Found>,
    /// Correlation of the estimates, in the order of `found`; 0 for those without uncertainty.
    pub correlation: Vec<Vec<f64>>,
    /// What the reader must know.
    pub warnings: Vec<String>,
    /// Frames that were looked at.
    pub frames: usize,
    /// Frames of the recording that were read.
    pub frames_read: usize,
    /// Of these, torn ones and duplicates, which were left out.
    pub frames_left_out: usize,
    /// Root of the mean square of what the scene left over, °C: as it stood, and with what was found.
    pub rmse_c: [f64; 2],
    /// White noise of a pixel as read, °C; with the 0.072 °C of the sensor's rounding.
    pub noise_sigma_c: f64,
    /// What each pixel keeps, °C: what it showed too much, on the mean. With a profile, beyond the profile's.
    pub pattern_c: [f64; PIXELS],
    /// Standard deviation of that over the pixels, without the noise in it, °C.
    pub pattern_sd_c: f64,
    /// Standard deviation of what all pixels do together, °C.
    pub common_sd_c: f64,
    /// Starts, and how many of them came to the best end.
    pub starts: [usize; 2],
    /// Simulations of all frames that were looked at.
    pub evaluations: u64,
    /// The scene file with what was found, remarks at each `[[fit]]`; every other byte is as it was.
    pub scene: String,
}

/// Finds the unknowns that a scene marks.
///
/// Time counts from the recording's first frame, which is second `recording.start_s` of the scene: 0 unless that is one
/// of the unknowns. Frames after the end of the scene's ways are left out, and so are torn frames and duplicates.
///
/// # Errors
/// [`CalibrateError`]: a scene that is refused or marks nothing, bounds that the scene may not have, a sensor of
/// another resolution, a clock that runs backwards, too few frames.
pub fn calibrate(
    records: &[Record],
    (text, origin): (&str, &str),
    files: &dyn Files,
    sensor: &str,
    options: &Options,
) -> Result<Calibration, CalibrateError> {
    calibrate_telling(records, (text, origin), files, sensor, options, &mut |_| ())
}

/// The same, and tells after every step of the search how far it has come.
///
/// # Errors
/// As [`calibrate`].
pub fn calibrate_telling(
    records: &[Record],
    (text, origin): (&str, &str),
    files: &dyn Files,
    sensor: &str,
    options: &Options,
    tell: &mut dyn FnMut(Progress),
) -> Result<Calibration, CalibrateError> {
    let loaded = Scene::parse(text, origin, files)?;
    if loaded.fits.is_empty() {
        return Err(CalibrateError::NoUnknowns {
            origin: origin.to_owned(),
        });
    }
    check_resolution(&loaded.scene, sensor)?;
    model::check_bounds((text, origin), &loaded.fits, files)?;
    let latest_s = loaded
        .fits
        .iter()
        .find(|fit| fit.key == grideye_scene::fit::RECORDING_START)
        .map_or(0.0, |fit| fit.bounds[1]);
    let end = (!loaded.scene.is_static()).then(|| {
        let end_s = (loaded.scene.duration().as_secs_f64() - latest_s).max(0.0);
        Duration::try_from_secs_f64(end_s).unwrap_or(Duration::MAX)
    });
    let frames = Frames::of(records, end, options)?;
    let pace = Pace::new(steps_in_frames(&frames, options), tell);
    let mut model = Model::new(text, origin, files, sensor, pace)?;
    let before = model.left_over(&model.start(), &frames)?;
    let (coarse, starts) = from_several_starts(&mut model, &frames, options)?;
    let fine = Fine::search(&mut model, &frames, coarse, options)?;
    Ok(show::calibration(
        (text, &loaded.fits, sensor),
        &model,
        &frames,
        &fine,
        &before,
        starts,
    ))
}

/// What all searches take if none ends early.
fn steps_in_frames(frames: &Frames, options: &Options) -> usize {
    let few = frames.len().min(COARSE_FRAMES);
    starts(options) * COARSE_STEPS * few + (ROUNDS + 1) * FINE_STEPS * frames.len()
}

fn starts(options: &Options) -> usize {
    options.starts.clamp(1, STARTS_MAX)
}

fn check_resolution(scene: &Scene, sensor: &str) -> Result<(), CalibrateError> {
    let sensor = scene.sensor(sensor)?;
    if sensor.columns * sensor.rows == PIXELS && sensor.columns == sensor.rows {
        return Ok(());
    }
    Err(CalibrateError::Resolution {
        sensor: sensor.name.clone(),
        columns: sensor.columns,
        rows: sensor.rows,
    })
}

/// The best end of the searches from several starts, on few frames; with the number of starts and of those that came there.
fn from_several_starts(
    model: &mut Model<'_>,
    frames: &Frames,
    options: &Options,
) -> Result<(Vec<f64>, [usize; 2]), CalibrateError> {
    let few = frames.fewer(COARSE_FRAMES);
    let noise = Noise::first(few.len());
    let mut generator = ChaCha12Rng::seed_from_u64(options.seed);
    let starts = starts(options);
    let mut ends: Vec<Solution> = Vec::with_capacity(starts);
    for number in 0..starts {
        let mut start = model.start();
        if number > 0 {
            start
                .iter_mut()
                .for_each(|share| *share = draw(&mut generator));
        }
        let mut weighted = Weighted {
            model,
            frames: &few,
            noise: &noise,
        };
        ends.push(weighted.solve(&start, COARSE_STEPS)?);
    }
    let costs: Vec<f64> = ends.iter().map(|end| end.cost).collect();
    let best = ends
        .into_iter()
        .min_by(|one, other| one.cost.total_cmp(&other.cost));
    let point = best.map_or_else(|| model.start(), |best| best.point);
    let least = costs.iter().copied().fold(f64::INFINITY, f64::min);
    let same = costs
        .iter()
        .filter(|cost| **cost <= least * (1.0 + SAME_COST))
        .count();
    Ok((point, [starts, same]))
}

/// Uniform from 0 to 1.
fn draw(generator: &mut ChaCha12Rng) -> f64 {
    f64::from(generator.next_u32()) / 4_294_967_296.0
}

/// The search on all frames, with weights from what it leaves over.
struct Fine {
    solution: Solution,
    noise: Noise,
    left_over: Vec<f64>,
    uncertainty: Uncertainty,
}

impl Fine {
    fn search(
        model: &mut Model<'_>,
        frames: &Frames,
        coarse: Vec<f64>,
        options: &Options,
    ) -> Result<Self, CalibrateError> {
        let known = options.profile.as_ref().map(|profile| {
            noise::of_profile(&profile.common_mode, frames.len(), frames.interval_s())
        });
        let mut noise = Noise::first(frames.len());
        let mut point = coarse;
        let mut used = Freedom::NONE;
        let mut round = 0;
        loop {
            let mut weighted = Weighted {
                model,
                frames,
                noise: &noise,
            };
            let solution = weighted.solve(&point, FINE_STEPS)?;
            point.clone_from(&solution.point);
            let left_over = model.left_over(&point, frames)?;
            let uncertainty = Uncertainty::of(&solution, &noise, &used, known.is_some());
            if round == ROUNDS {
                return Ok(Self {
                    solution,
                    noise,
                    left_over,
                    uncertainty,
                });
            }
            used = uncertainty.used;
            noise = Noise::of(&Parts::of(&left_over, frames.len()), &used, known.clone());
            round += 1;
        }
    }
}
