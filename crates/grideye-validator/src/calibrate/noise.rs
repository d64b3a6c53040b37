//! Splits the residuals into white noise, a fixed pattern of each pixel, and a common mode of all pixels.
//!
//! ```text
//! residual (time, pixel) = pattern(pixel) + together(time) + white(time, pixel)
//!
//! part      is                                 numbers      variance
//! Pattern   means over time, less their mean   63           white + frames · pattern
//! White     the rest of each pixel             63 (T - 1)   white
//! Together  means over the pixels of a frame   T            white + 64 · together, correlated in time
//! ```
//! The three are orthogonal, and each is weighted by its own variance.

use crate::linear::{Matrix, cholesky, dot, forward, zeros};
use crate::numbers::count;
use grideye_frame::PIXELS;
use grideye_scene::profile::{CYCLE_TICKS, CommonMode};

#[derive(Debug, Clone)]
pub(crate) struct Noise {
    frames: usize,
    /// Variance of the white part, °C².
    pub(crate) white: f64,
    /// Variance of the pattern, °C².
    pub(crate) pattern: f64,
    /// Autocovariance of the common mode by frames apart, °C².
    pub(crate) together: Vec<f64>,
    lower: Matrix,
}

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Freedom {
    pub(crate) pattern: f64,
    pub(crate) white: f64,
    pub(crate) together: f64,
}

/// Variances to start with, from the datasheet and typical sensors.
const WHITE_START: f64 = 0.3 * 0.3;
const PATTERN_START: f64 = 0.2 * 0.2;
const TOGETHER_START: f64 = 0.1 * 0.1;
/// Smallest variance, °C²: with less, rounding would count as information.
const WHITE_MIN: f64 = 1e-8;

impl Noise {
    pub(crate) fn first(frames: usize) -> Self {
        let together = vec![TOGETHER_START; frames];
        Self::new(frames, WHITE_START, PATTERN_START, together)
    }

    /// `used`: degrees of freedom that the unknowns use up; `known`: the common mode's autocovariance if a profile
    /// gives it.
    pub(crate) fn of(parts: &Parts, used: &Freedom, known: Option<Vec<f64>>) -> Self {
        let frames = parts.together.len();
        let freedom = Freedom::of(frames, used);
        let white = (dot(&parts.white, &parts.white) / freedom.white).max(WHITE_MIN);
        let kept = dot(&parts.pattern, &parts.pattern) / freedom.pattern;
        let pattern = ((kept - white) / count(frames)).max(0.0);
        let together = known.unwrap_or_else(|| autocovariance(&parts.together, white));
        Self::new(frames, white, pattern, together)
    }

    /// The same noise for another number of frames over the same time.
    pub(crate) fn of_more(&self, frames: usize) -> Self {
        let last = self.together.len() - 1;
        let at = |lag: usize| self.together[(lag * (last + 1) / frames).min(last)];
        Self::new(
            frames,
            self.white,
            self.pattern,
            (0..frames).map(at).collect(),
        )
    }

    fn new(frames: usize, white: f64, pattern: f64, together: Vec<f64>) -> Self {
        let mut covariance = zeros(frames);
        for (row, values) in covariance.iter_mut().enumerate() {
            for (column, value) in values.iter_mut().enumerate() {
                *value = count(PIXELS) * together[row.abs_diff(column)] + pattern;
            }
            values[row] += white;
        }
        // Positive definite by construction; if rounding breaks that, the diagonal still is.
        let lower = cholesky(&covariance).unwrap_or_else(|| diagonal(&covariance));
        Self {
            frames,
            white,
            pattern,
            together,
            lower,
        }
    }

    /// Residuals, or their derivatives, split into parts and divided by each part's standard deviation.
    pub(crate) fn whiten(&self, values: &[f64]) -> Vec<f64> {
        let mut parts = Parts::of(values, self.frames);
        let white = 1.0 / self.white.sqrt();
        let pattern = 1.0 / (self.white + count(self.frames) * self.pattern).sqrt();
        parts.white.iter_mut().for_each(|value| *value *= white);
        parts.pattern.iter_mut().for_each(|value| *value *= pattern);
        forward(&self.lower, &mut parts.together);
        parts.joined()
    }

    /// Number of independent levels in the common mode.
    pub(crate) fn independent_levels(&self) -> f64 {
        let frames = count(self.frames);
        let each = self.together[0] + self.white / count(PIXELS);
        let mean = mean_variance(&self.together) + self.white / count(PIXELS) / frames;
        (each / mean).clamp(1.0, frames)
    }
}

fn diagonal(matrix: &Matrix) -> Matrix {
    let mut diagonal = zeros(matrix.len());
    for (place, row) in diagonal.iter_mut().enumerate() {
        row[place] = matrix[place][place].max(WHITE_MIN).sqrt();
    }
    diagonal
}

impl Freedom {
    pub(crate) fn of(frames: usize, used: &Self) -> Self {
        let pixels = count(PIXELS - 1);
        Self {
            pattern: (pixels - used.pattern).max(1.0),
            white: (pixels * (count(frames) - 1.0) - used.white).max(1.0),
            together: (count(frames) - used.together).max(1.0),
        }
    }
}

#[derive(Debug, Clone)]
pub(crate) struct Parts {
    pub(crate) pattern: Vec<f64>,
    pub(crate) white: Vec<f64>,
    pub(crate) together: Vec<f64>,
}

impl Parts {
    pub(crate) fn of(values: &[f64], frames: usize) -> Self {
        let root = count(PIXELS).sqrt();
        let mut white = values.to_vec();
        let mut together = Vec::with_capacity(frames);
        let mut means = vec![0.0; PIXELS];
        for frame in white.chunks_exact_mut(PIXELS) {
            let mean = frame.iter().sum::<f64>() / count(PIXELS);
            together.push(mean * root);
            for (pixel, sum) in frame.iter_mut().zip(&mut means) {
                *pixel -= mean;
                *sum += *pixel / count(frames);
            }
        }
        let kept = means.iter().cycle();
        white
            .iter_mut()
            .zip(kept)
            .for_each(|(pixel, mean)| *pixel -= mean);
        let scale = count(frames).sqrt();
        let pattern = means.into_iter().map(|mean| mean * scale).collect();
        Self {
            pattern,
            white,
            together,
        }
    }

    fn joined(self) -> Vec<f64> {
        [self.pattern, self.white, self.together].concat()
    }

    pub(crate) fn split(joined: &[f64]) -> [&[f64]; 3] {
        let (pattern, rest) = joined.split_at(PIXELS);
        let frames = rest.len() / (PIXELS + 1);
        let (white, together) = rest.split_at(frames * PIXELS);
        [pattern, white, together]
    }
}

/// Autocovariance of the frames' levels, less white noise; tapered (Bartlett) and raised by the variance of the mean.
fn autocovariance(together: &[f64], white: f64) -> Vec<f64> {
    let frames = together.len();
    let scale = count(PIXELS).sqrt();
    let mean = together.iter().sum::<f64>() / count(frames);
    let levels = together.iter().map(|level| (level - mean) / scale);
    let levels: Vec<f64> = levels.collect();
    let reach = (frames / REACH).max(1);
    let mut found: Vec<f64> = (0..frames)
        .map(|lag| {
            if lag > reach {
                return 0.0;
            }
            let taper = 1.0 - count(lag) / count(reach + 1);
            taper * dot(&levels[lag..], &levels[..frames - lag]) / count(frames)
        })
        .collect();
    found[0] =
        (found[0] - white / count(PIXELS)).max(found.get(1).copied().unwrap_or(0.0).max(0.0));
    let raised = mean_variance(&found).max(0.0);
    found.iter_mut().for_each(|value| *value += raised);
    found
}

/// Correlations are followed over a third of the recording.
const REACH: usize = 3;

/// Variance of the mean of as many levels as there are lags.
fn mean_variance(autocovariance: &[f64]) -> f64 {
    let frames = count(autocovariance.len());
    let weighted = autocovariance.iter().enumerate().map(|(lag, value)| {
        let twice = if lag == 0 { 1.0 } else { 2.0 };
        twice * (frames - count(lag)) * value
    });
    weighted.sum::<f64>() / (frames * frames)
}

/// Autocovariance of a profile's common mode, for frames `interval_s` apart.
pub(crate) fn of_profile(common: &CommonMode, frames: usize, interval_s: f64) -> Vec<f64> {
    let cold = 1.0 / count(usize::try_from(CYCLE_TICKS).unwrap_or(1));
    let depth = common.cycle_depth_c.powi(2);
    (0..frames)
        .map(|lag| {
            let lag_s = count(lag) * interval_s;
            let ticks = (lag_s / TICK_S).round();
            let same = (ticks * cold).fract() == 0.0;
            let cycle = depth * (if same { cold } else { 0.0 } - cold * cold);
            if common.sd_c == 0.0 {
                return cycle;
            }
            let octaves = (0..common.octaves).map(|octave| {
                let speed = 2.0_f64.powi(i32::try_from(octave).unwrap_or(0));
                wander(speed * lag_s / common.correlation_s)
            });
            cycle + common.sd_c.powi(2) * octaves.sum::<f64>() / f64::from(common.octaves)
        })
        .collect()
}

const TICK_S: f64 = 0.1;

/// Autocorrelation of a profile's wander, which blends independent draws at whole numbers, averaged over its phases.
fn wander(lag: f64) -> f64 {
    const PHASES: u32 = 64;
    let weights = |at: f64| {
        let share = at.fract();
        let length = ((1.0 - share).powi(2) + share.powi(2)).sqrt();
        (at.floor(), (1.0 - share) / length, share / length)
    };
    let product = |phase: u32| {
        let at = (f64::from(phase) + 0.5) / f64::from(PHASES);
        let (_, left, right) = weights(at);
        let (knot, later_left, later_right) = weights(at + lag);
        if knot == 0.0 {
            left * later_left + right * later_right
        } else if knot == 1.0 {
            right * later_left
        } else {
            0.0
        }
    };
    (0..PHASES).map(product).sum::<f64>() / f64::from(PHASES)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(frames: usize) -> Vec<f64> {
        (0..frames * PIXELS)
            .map(|place| count(place * 7919 % 101) / 50.0 - 1.0)
            .collect()
    }

    #[test]
    fn the_parts_are_orthogonal_and_complete() {
        let values = values(20);
        let parts = Parts::of(&values, 20);
        let squares = |part: &[f64]| dot(part, part);
        let sum = squares(&parts.pattern) + squares(&parts.white) + squares(&parts.together);
        assert!((sum - squares(&values)).abs() < 1e-9 * sum);
        assert!(parts.pattern.iter().sum::<f64>().abs() < 1e-9);
    }

    /// The whitened square must equal that of the full covariance of 6 x 64 numbers, inverted by brute force.
    #[test]
    fn whitening_is_the_inverse_of_the_whole_covariance() {
        let frames = 6;
        let together = [0.02, 0.01, 0.005, 0.0, 0.0, 0.0];
        let noise = Noise::new(frames, 0.09, 0.04, together.to_vec());
        let size = frames * PIXELS;
        let mut covariance = zeros(size);
        for (row, entries) in covariance.iter_mut().enumerate() {
            for (column, entry) in entries.iter_mut().enumerate() {
                let apart = (row / PIXELS).abs_diff(column / PIXELS);
                let is = |same: bool| f64::from(u8::from(same));
                let pattern = 0.04 * is(row % PIXELS == column % PIXELS);
                *entry = together[apart] + pattern + 0.09 * is(row == column);
            }
        }
        let lower = cholesky(&covariance).unwrap();
        let values = values(frames);
        let mut brute = values.clone();
        forward(&lower, &mut brute);
        let whitened = noise.whiten(&values);
        let (ours, theirs) = (dot(&whitened, &whitened), dot(&brute, &brute));
        assert!((ours / theirs - 1.0).abs() < 1e-9, "{ours} {theirs}");
    }

    /// As `Profile::apply` says: 0.29 at 1, and 0 from 2 on.
    #[test]
    fn the_wander_forgets_itself_as_the_profile_says() {
        assert!((wander(0.0) - 1.0).abs() < 1e-12);
        assert!((wander(1.0) - 0.29).abs() < 0.005, "{}", wander(1.0));
        assert_eq!(wander(2.0), 0.0);
        let cycle = CommonMode {
            cycle_depth_c: 1.0,
            ..CommonMode::default()
        };
        let found = of_profile(&cycle, 11, 0.1);
        assert!((found[0] - 0.16).abs() < 1e-12 && (found[1] + 0.04).abs() < 1e-12);
        assert_eq!(found[0], found[5]);
        // Over whole cycles it sums to nothing.
        assert!(found[..5].iter().sum::<f64>().abs() < 1e-12);
    }

    #[test]
    fn a_lasting_level_counts_once() {
        let lasting = Noise::new(50, 0.09, 0.0, vec![1.0; 50]);
        assert!(lasting.independent_levels() < 1.1);
        let white = Noise::new(50, 0.09, 0.0, vec![0.0; 50]);
        assert!((white.independent_levels() - 50.0).abs() < 1e-9);
    }
}
