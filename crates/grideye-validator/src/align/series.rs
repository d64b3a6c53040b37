//! The two sides of an alignment: the scene's frames at any time, and the recording's frames with their times.

use crate::frames::types::Pixels;
use crate::numbers::{count, evenly, index, mean_frame};
use grideye_frame::PIXELS;
use grideye_scene::Film;
use std::time::Duration;

/// Interval of the scene's frames, seconds: a person at 1 m/s moves an eighth of a pixel in it.
const STEP_S: f64 = 0.05;
/// Most frames of the scene; a longer part has a longer interval.
const SCENE_FRAMES_MAX: usize = 12_000;

/// The scene's noise-free frames at even times, less ambient.
#[derive(Debug, Clone)]
pub(crate) struct Series {
    first_s: f64,
    step_s: f64,
    frames: Vec<Pixels>,
}

/// The recording's frames at unaligned scene times, each pixel less its mean over all of them.
#[derive(Debug, Clone)]
pub(crate) struct Sample {
    pub(crate) times_s: Vec<f64>,
    pub(crate) frames: Vec<Pixels>,
    pub(crate) energy: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fit {
    /// Correlation of what moves over all pixels and frames, -1 to 1.
    pub(crate) likeness: f64,
    /// Factor on the scene's moving part that fits best.
    pub(crate) amplitude: f64,
    /// Sum of squared residuals, °C².
    pub(crate) left_c2: f64,
}

impl Fit {
    const fn nothing(energy: f64) -> Self {
        Self {
            likeness: 0.0,
            amplitude: 0.0,
            left_c2: energy,
        }
    }
}

impl Series {
    pub(crate) fn new(film: &Film, from_s: f64, until_s: f64) -> Self {
        let ambient_c = film.simulator().ambient_c();
        let frame = |time_s: f64| -> Pixels {
            let time = Duration::try_from_secs_f64(time_s).unwrap_or_default();
            let image = film.image(time).celsius;
            std::array::from_fn(|pixel| image.get(pixel).map_or(0.0, |celsius| celsius - ambient_c))
        };
        // On the same steps from the scene's start for whoever asks, so that no moment is rendered twice.
        let [first, last] = [from_s.max(0.0) / STEP_S, until_s / STEP_S];
        let [first_s, last_s] = [first.floor(), last.ceil()].map(|step| step * STEP_S);
        Self::evenly(first_s, last_s, frame)
    }

    pub(super) fn evenly(first_s: f64, last_s: f64, frame: impl Fn(f64) -> Pixels) -> Self {
        let span_s = (last_s - first_s).max(0.0);
        // Less what rounding adds to a whole number.
        let steps = (span_s / STEP_S - 1e-6).ceil();
        let steps = steps.clamp(1.0, count(SCENE_FRAMES_MAX - 1));
        let step_s = (span_s / steps).max(f64::MIN_POSITIVE);
        let frame = |index: usize| frame(count(index) * step_s + first_s);
        Self {
            first_s,
            step_s,
            frames: (0..=index(steps)).map(frame).collect(),
        }
    }

    pub(crate) fn map(&self, change: impl Fn(&Pixels) -> Pixels) -> Self {
        Self {
            frames: self.frames.iter().map(change).collect(),
            ..*self
        }
    }

    pub(crate) fn reversed(&self) -> Self {
        Self {
            frames: self.frames.iter().rev().copied().collect(),
            ..*self
        }
    }

    /// The frame at a scene time; beyond the ends the last one: people wait at the start and stay at the end, so no delay
    /// gains by moving frames there.
    pub(crate) fn at(&self, time_s: f64) -> Pixels {
        let place = (time_s - self.first_s) / self.step_s;
        let last = self.frames.len() - 1;
        let before = index(place.max(0.0)).min(last.saturating_sub(1));
        let share = (place - count(before)).clamp(0.0, 1.0);
        let (left, right) = (&self.frames[before], &self.frames[(before + 1).min(last)]);
        std::array::from_fn(|pixel| left[pixel] + share * (right[pixel] - left[pixel]))
    }
}

/// The moment nearest to a time at which a series has a frame.
pub(crate) fn nearest_step_s(time_s: f64) -> f64 {
    (time_s / STEP_S).round() * STEP_S
}

impl Sample {
    pub(crate) fn new(times_s: Vec<f64>, mut frames: Vec<Pixels>) -> Self {
        let mean = mean_frame(&frames);
        let mut energy = 0.0;
        for frame in &mut frames {
            for (celsius, mean) in frame.iter_mut().zip(&mean) {
                *celsius -= mean;
                energy += *celsius * *celsius;
            }
        }
        Self {
            times_s,
            frames,
            energy,
        }
    }

    pub(crate) fn map(&self, change: impl Fn(&Pixels) -> Pixels) -> Self {
        Self {
            times_s: self.times_s.clone(),
            frames: self.frames.iter().map(change).collect(),
            energy: self.energy,
        }
    }

    /// What the scene would have recorded at the same times.
    pub(crate) fn of_scene(&self, series: &Series) -> Self {
        let frames = self.times_s.iter().map(|&time_s| series.at(time_s));
        Self::new(self.times_s.clone(), frames.collect())
    }

    pub(crate) fn thinned(&self, number: usize) -> Self {
        let chosen = evenly(self.frames.len(), number);
        Self::new(
            chosen.iter().map(|&index| self.times_s[index]).collect(),
            chosen.iter().map(|&index| self.frames[index]).collect(),
        )
    }

    pub(crate) fn span_s(&self) -> f64 {
        match (self.times_s.first(), self.times_s.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }

    /// How well the scene's moving part explains this sample.
    pub(crate) fn fit(&self, series: &Series, scene_s: impl Fn(f64) -> f64) -> Fit {
        self.sums(series, scene_s).fit(self.energy)
    }

    pub(crate) fn mean_claim(&self, series: &Series, scene_s: impl Fn(f64) -> f64) -> Pixels {
        let sums = self.sums(series, scene_s);
        sums.claim.map(|sum| sum / count(sums.frames.max(1)))
    }

    fn sums(&self, series: &Series, scene_s: impl Fn(f64) -> f64) -> FitSums {
        let mut sums = FitSums::default();
        for (&time_s, real) in self.times_s.iter().zip(&self.frames) {
            sums.add(real, &series.at(scene_s(time_s)));
        }
        sums
    }
}

pub(crate) struct FitSums {
    frames: usize,
    product: Pixels,
    real: Pixels,
    claim: Pixels,
    square: Pixels,
}

impl Default for FitSums {
    fn default() -> Self {
        let [product, real, claim, square] = [[0.0; PIXELS]; 4];
        Self {
            frames: 0,
            product,
            real,
            claim,
            square,
        }
    }
}

impl FitSums {
    pub(crate) fn add(&mut self, real: &Pixels, claim: &Pixels) {
        self.frames += 1;
        for pixel in 0..PIXELS {
            let (real, claim) = (real[pixel], claim[pixel]);
            self.product[pixel] += real * claim;
            self.real[pixel] += real;
            self.claim[pixel] += claim;
            self.square[pixel] += claim * claim;
        }
    }

    pub(crate) fn fit(&self, energy: f64) -> Fit {
        let number = count(self.frames.max(1));
        let (mut product, mut square) = (0.0, 0.0);
        for pixel in 0..PIXELS {
            let claim = self.claim[pixel];
            product += self.product[pixel] - self.real[pixel] * claim / number;
            square += self.square[pixel] - claim * claim / number;
        }
        // The remainder of squares that cancel is rounding, not motion.
        if square <= 1e-9 * number || energy <= 0.0 {
            return Fit::nothing(energy);
        }
        let amplitude = product / square;
        Fit {
            likeness: (product / (square * energy).sqrt()).clamp(-1.0, 1.0),
            amplitude,
            left_c2: (energy - product * amplitude).max(0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spot(time_s: f64) -> Pixels {
        let row = 3.5 - 3.5 * (time_s * 0.3).cos();
        std::array::from_fn(|pixel| {
            let off = count(pixel / 8) - row;
            f64::from(u8::from(pixel % 8 == 0)) * 2.0 * (-off * off).exp()
        })
    }

    fn times_and_frames() -> (Vec<f64>, Vec<Pixels>) {
        let times_s = (0..=200).map(|index| f64::from(index) / 10.0);
        times_s.map(|time_s| (time_s, spot(time_s))).unzip()
    }

    #[test]
    fn a_series_returns_its_frames_and_blends_between_them() {
        let series = Series::evenly(0.0, 10.0, spot);
        let is_near = |found: Pixels, expected: Pixels| {
            let mut both = found.iter().zip(&expected);
            both.all(|(one, other)| (one - other).abs() < 1e-9)
        };
        assert!(is_near(series.at(4.05), spot(4.05)));
        let halfway = f64::midpoint(spot(4.0)[24], spot(4.05)[24]);
        assert!((series.at(4.025)[24] - halfway).abs() < 1e-9);
        assert!(is_near(series.reversed().at(2.0), spot(8.0)));
    }

    /// Before and after a walk its people stand, even when it runs backwards.
    #[test]
    fn people_stand_still_before_and_after_the_walk() {
        let series = Series::evenly(0.0, 10.0, spot);
        assert_eq!(series.at(-3.0), series.at(0.0));
        assert_eq!(series.at(99.0), series.at(10.0));
        assert_ne!(series.at(0.0), series.at(10.0));
        assert_eq!(series.reversed().at(-3.0), series.at(10.0));
        assert_eq!(series.map(|frame| *frame).at(99.0), series.at(10.0));
    }

    #[test]
    fn a_series_of_any_length_has_a_bounded_number_of_frames() {
        let series = Series::evenly(0.0, 1e6, |time_s| [time_s / 1e6; PIXELS]);
        assert_eq!(series.frames.len(), SCENE_FRAMES_MAX);
        assert!((series.at(2.5e5)[7] - 0.25).abs() < 1e-9);
    }

    /// Amplitude and pixel offsets do not change the likeness: it is a correlation.
    #[test]
    fn the_fit_is_the_correlation_of_what_moves() {
        let (times_s, frames) = times_and_frames();
        let series = Series::evenly(0.0, 20.0, spot);
        let doubled = frames
            .iter()
            .map(|frame| std::array::from_fn(|pixel| 20.0 + count(pixel) + 2.0 * frame[pixel]))
            .collect();
        let sample = Sample::new(times_s, doubled);
        let fit = sample.fit(&series, |time_s| time_s);
        assert!((fit.likeness - 1.0).abs() < 1e-9 && (fit.amplitude - 2.0).abs() < 1e-9);
        assert!(fit.left_c2 < 1e-6 * sample.energy);
        assert!(sample.fit(&series, |time_s| time_s + 0.5).likeness < 0.95);
        let still = Series::evenly(0.0, 20.0, |_| [3.0; PIXELS]);
        let nothing = sample.fit(&still, |time_s| time_s);
        assert_eq!(nothing, Fit::nothing(sample.energy));
    }
}
