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
    ends: Ends,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ends {
    /// People wait at the start and stay at the end, so no delay gains by moving frames beyond the ends.
    Stand,
    /// Frames from elsewhere claim nothing outside their times.
    Nothing,
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
        Self::evenly(first_s, last_s, Ends::Stand, frame)
    }

    /// Resamples frames at ascending times to even intervals, linearly.
    pub(crate) fn of_frames(times_s: &[f64], frames: &[Pixels]) -> Self {
        let first_s = times_s.first().copied().unwrap_or_default();
        let last_s = times_s.last().copied().unwrap_or_default();
        let at = |time_s: f64| -> Pixels {
            let next = times_s.partition_point(|other_s| *other_s <= time_s);
            let next = next.clamp(1, times_s.len() - 1);
            let (left_s, right_s) = (times_s[next - 1], times_s[next]);
            let share = ((time_s - left_s) / (right_s - left_s).max(f64::MIN_POSITIVE)).min(1.0);
            blended(&frames[next - 1], &frames[next], share)
        };
        Self::evenly(first_s, last_s, Ends::Nothing, at)
    }

    fn evenly(first_s: f64, last_s: f64, ends: Ends, frame: impl Fn(f64) -> Pixels) -> Self {
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
            ends,
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

    /// The frame at a scene time; beyond the ends the last frame, or `None` for [`Ends::Nothing`].
    pub(crate) fn at(&self, time_s: f64) -> Option<Pixels> {
        let place = (time_s - self.first_s) / self.step_s;
        let last = self.frames.len() - 1;
        // Rounding must not cost the last frame of a walk that ends on it.
        let is_within = (-1e-6..=count(last) + 1e-6).contains(&place);
        if self.ends == Ends::Nothing && !is_within {
            return None;
        }
        let before = index(place.max(0.0)).min(last.saturating_sub(1));
        let share = (place - count(before)).clamp(0.0, 1.0);
        let (left, right) = (&self.frames[before], &self.frames[(before + 1).min(last)]);
        Some(blended(left, right, share))
    }
}

/// The moment nearest to a time at which a series has a frame.
pub(crate) fn nearest_step_s(time_s: f64) -> f64 {
    (time_s / STEP_S).round() * STEP_S
}

fn blended(left: &Pixels, right: &Pixels, share: f64) -> Pixels {
    std::array::from_fn(|pixel| left[pixel] + share * (right[pixel] - left[pixel]))
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
        let (times_s, frames) = self
            .times_s
            .iter()
            .filter_map(|&time_s| Some((time_s, series.at(time_s)?)))
            .unzip();
        Self::new(times_s, frames)
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

    /// How well the scene's moving part explains this sample; frames without a claim still count in the denominator.
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
            if let Some(claim) = series.at(scene_s(time_s)) {
                sums.add(real, &claim);
            }
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

    fn series(seconds: u32) -> (Vec<f64>, Vec<Pixels>) {
        (0..=seconds * 10)
            .map(|index| (f64::from(index) / 10.0, spot(f64::from(index) / 10.0)))
            .unzip()
    }

    #[test]
    fn a_series_returns_its_frames_and_none_beyond_its_ends() {
        let (times_s, frames) = series(10);
        let series = Series::of_frames(&times_s, &frames);
        for (time_s, frame) in times_s.iter().zip(&frames) {
            let seen = series.at(*time_s).unwrap();
            assert!(seen.iter().zip(frame).all(|(a, b)| (a - b).abs() < 1e-9));
        }
        let between = series.at(4.05).unwrap();
        assert!((between[24] - f64::midpoint(frames[40][24], frames[41][24])).abs() < 1e-9);
        assert!(series.at(-0.01).is_none() && series.at(10.01).is_none());
        let back = series.reversed().at(2.0).unwrap();
        assert!((back[24] - frames[80][24]).abs() < 1e-9);
    }

    /// Before and after a walk its people stand, even when it runs backwards.
    #[test]
    fn people_stand_still_before_and_after_the_walk() {
        let (times_s, frames) = series(10);
        let series = Series {
            ends: Ends::Stand,
            ..Series::of_frames(&times_s, &frames)
        };
        assert_eq!(series.at(-3.0), series.at(0.0));
        assert_eq!(series.at(99.0), series.at(10.0));
        assert_ne!(series.at(0.0), series.at(10.0));
        assert_eq!(series.reversed().at(-3.0), series.at(10.0));
        assert_eq!(series.map(|frame| *frame).at(99.0), series.at(10.0));
    }

    #[test]
    fn a_series_of_any_length_has_a_bounded_number_of_frames() {
        let series = Series::of_frames(&[0.0, 1e6], &[[0.0; PIXELS], [1.0; PIXELS]]);
        assert_eq!(series.frames.len(), SCENE_FRAMES_MAX);
        assert!((series.at(2.5e5).unwrap()[7] - 0.25).abs() < 1e-9);
        assert!(series.at(1e6).is_some() && series.at(1e6 + 1.0).is_none());
    }

    /// Amplitude and pixel offsets do not change the likeness: it is a correlation.
    #[test]
    fn the_fit_is_the_correlation_of_what_moves() {
        let (times_s, frames) = series(20);
        let series = Series::of_frames(&times_s, &frames);
        let doubled = frames
            .iter()
            .map(|frame| std::array::from_fn(|pixel| 20.0 + count(pixel) + 2.0 * frame[pixel]))
            .collect();
        let sample = Sample::new(times_s, doubled);
        let fit = sample.fit(&series, |time_s| time_s);
        assert!((fit.likeness - 1.0).abs() < 1e-9 && (fit.amplitude - 2.0).abs() < 1e-9);
        assert!(fit.left_c2 < 1e-6 * sample.energy);
        assert!(sample.fit(&series, |time_s| time_s + 0.5).likeness < 0.95);
        let still = Series::of_frames(&[0.0, 20.0], &[[3.0; PIXELS], [3.0; PIXELS]]);
        let nothing = sample.fit(&still, |time_s| time_s);
        assert_eq!(nothing, Fit::nothing(sample.energy));
    }

    /// Frames without a claim cost their squares.
    #[test]
    fn frames_pushed_out_of_the_scene_cost_their_squares() {
        let (times_s, frames) = series(20);
        let series = Series::of_frames(&times_s, &frames);
        let sample = Sample::new(times_s, frames);
        // Exact except for the quarter of the frames moved out of the series.
        let fit = sample.fit(&series, |time_s| if time_s < 15.0 { time_s } else { -1.0 });
        assert!((0.5..0.95).contains(&fit.likeness), "{fit:?}");
    }
}
