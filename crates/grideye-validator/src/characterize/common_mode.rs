//! The common mode of all pixels: the cold frame of a five-frame cycle, and the slow wander.

use crate::characterize::allan::AllanPoint;
use crate::constants::{CONTRAST_MIN, IN_STEP, SCATTER, SENSOR_HZ};
use crate::numbers::{count, interpolated, long_count, trimmed_mean};
use grideye_scene::profile::OCTAVES_MAX;
use serde::Serialize;
use std::f64::consts::{PI, TAU};

/// The common mode of all pixels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CommonMode {
    /// Standard deviation of means over ten frames, °C: the slow part, including changes of the room.
    pub sd_c: f64,
    /// The nearest wander of a profile; `None` if the recording is too short or nothing wanders.
    pub flicker: Option<Flicker>,
    /// The cold frame in five, if found.
    pub cycle: Option<Cycle>,
}

/// Step of the spectrum, cycles per recorded frame.
const FREQUENCY_STEP: f64 = 0.0005;
/// The spectrum covers cycles of 12.5 to 3 frames, by number of the frequency.
const LOWEST: usize = 160;
const HIGHEST: usize = 666;
/// The search covers cycles of 7 to 4 frames.
const SOUGHT: core::ops::RangeInclusive<usize> = 286..=500;
const SEGMENTS_MIN: u64 = 3;
/// Sensor frames per cycle: five on every unit that we measured.
const SENSOR_FRAMES: f64 = 5.0;

/// A cold frame that repeats.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Cycle {
    /// Recorded frames per cycle: five if each sensor frame was read once.
    pub frames: f64,
    /// How much colder this frame is than the others, °C.
    pub depth_c: f64,
    /// Height of the peak over the spectrum's median.
    pub contrast: f64,
    /// The sensor's frame rate, Hz; `None` if impossible for a 10 Hz sensor.
    pub sensor_hz: Option<f64>,
}

/// The mean spectrum of the common mode over all segments.
#[derive(Debug)]
pub(crate) struct CycleFinder {
    segments: u64,
    /// Squared amplitudes by number of the frequency, up to twice the highest one searched.
    power: Vec<f64>,
}

impl Default for CycleFinder {
    fn default() -> Self {
        Self {
            segments: 0,
            power: vec![0.0; 2 * HIGHEST + 1],
        }
    }
}

impl CycleFinder {
    pub(crate) fn push(&mut self, levels_c: &[f64]) {
        self.segments += 1;
        let mean = levels_c.iter().sum::<f64>() / count(levels_c.len());
        // A Hann window keeps slow drift out of the cycle's frequencies.
        let windowed: Vec<f64> = (0..levels_c.len())
            .zip(levels_c)
            .map(|(place, level)| {
                let angle = TAU * (count(place) + 0.5) / count(levels_c.len());
                (level - mean) * 0.5 * (1.0 - angle.cos())
            })
            .collect();
        let weight = 0.5 * count(levels_c.len());
        for (number, power) in (0..).zip(&mut self.power) {
            if number >= LOWEST {
                *power += squared_amplitude(&windowed, frequency(number)) / (weight * weight);
            }
        }
    }

    pub(crate) fn finish(mut self, rate_hz: f64) -> Option<Cycle> {
        if self.segments < SEGMENTS_MIN {
            return None;
        }
        let segments = long_count(self.segments);
        self.power.iter_mut().for_each(|power| *power /= segments);
        let strengths: Vec<f64> = (LOWEST..=HIGHEST)
            .map(|number| self.strength(number))
            .collect();
        let middle = trimmed_mean(&mut strengths.clone(), strengths.len());
        let (number, strength) = highest_peak(&strengths)?;
        let contrast = strength / middle;
        let enough = CONTRAST_MIN.max(1.0 + SCATTER / segments.sqrt());
        if contrast.is_nan() || contrast < enough {
            return None;
        }
        let frames = 1.0 / (frequency(LOWEST) + FREQUENCY_STEP * refined(&strengths, number));
        let sensor_hz = rate_hz * SENSOR_FRAMES / frames;
        Some(Cycle {
            frames,
            depth_c: self.depth(number + LOWEST, frames),
            contrast,
            sensor_hz: SENSOR_HZ.contains(&sensor_hz).then_some(sensor_hz),
        })
    }

    /// Power at the cycle's frequency and at twice that, differenced by the sines so that drift and people weigh
    /// little.
    fn strength(&self, number: usize) -> f64 {
        let differenced =
            |number: usize| self.power[number] * (2.0 * (PI * frequency(number)).sin()).powi(2);
        differenced(number) + differenced(2 * number)
    }

    /// Depth of a pulse of one sensor frame per cycle, from the amplitude of its first harmonic.
    fn depth(&self, number: usize, frames: f64) -> f64 {
        // The noise under the peak is that on both sides, one to two window widths away.
        let (near, far) = (80, 160);
        let mut beside: Vec<f64> = (near..far)
            .flat_map(|off| [number - off.min(number), number + off])
            .filter_map(|beside| self.power.get(beside).copied())
            .filter(|power| *power > 0.0)
            .collect();
        let cut = beside.len();
        let squared = (self.power[number] - trimmed_mean(&mut beside, cut)).max(0.0);
        let share = if (frames - SENSOR_FRAMES).abs() < IN_STEP {
            1.0 / SENSOR_FRAMES
        } else {
            // Read out of step, the pulse is a step function of time.
            (PI / SENSOR_FRAMES).sin() / PI
        };
        squared.sqrt() / share
    }
}

fn frequency(number: usize) -> f64 {
    FREQUENCY_STEP * count(number)
}

/// Squared amplitude at one frequency (Goertzel).
fn squared_amplitude(values: &[f64], frequency: f64) -> f64 {
    let turn = 2.0 * (TAU * frequency).cos();
    let (mut last, mut before) = (0.0, 0.0);
    for value in values {
        (last, before) = (value + turn * last - before, last);
    }
    last * last + before * before - turn * last * before
}

/// The highest peak in the search range. A slope is no peak: a drift's spectrum is highest at its end.
fn highest_peak(values: &[f64]) -> Option<(usize, f64)> {
    SOUGHT
        .map(|number| number - LOWEST)
        .filter(|place| values[*place] > values[place - 1] && values[*place] >= values[place + 1])
        .map(|place| (place, values[place]))
        .max_by(|left, right| left.1.total_cmp(&right.1))
}

/// Top of the parabola through the peak and the points a quarter of the window's width away on either side.
fn refined(values: &[f64], place: usize) -> f64 {
    let off = 8_usize;
    let (Some(left), Some(right)) = (
        place.checked_sub(off).and_then(|left| values.get(left)),
        values.get(place + off),
    ) else {
        return count(place);
    };
    let bend = left - 2.0 * values[place] + right;
    if bend >= 0.0 {
        return count(place);
    }
    count(place) + 0.5 * count(off) * (left - right) / bend
}

/// Frames per segment, ten seconds at full rate: the window's width above is 4 / 100 of a cycle.
pub(crate) const SEGMENT_FRAMES: usize = 100;

/// Averages over fewer frames still show the five-frame cycle.
const AVERAGED_FRAMES_MIN: f64 = 7.5;
const POINTS_MIN: usize = 3;
/// The slowest wander tried, in lengths of the longest average.
const LONGEST: f64 = 2.0;

/// The wander of a sensor profile whose Allan deviations are nearest to the measured ones.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Flicker {
    /// Standard deviation, °C.
    pub sd_c: f64,
    /// Time scale of its slowest part, seconds, at most twice the longest average: anything slower is unknown.
    pub correlation_s: f64,
    /// Number of its parts, each twice as fast as the one before.
    pub octaves: u32,
}

/// Allan variance of a wander of variance 1 and correlation time 1, at averaging times 2^-5 to 2^6.
const ALLAN_VARIANCE: [f64; 12] = [
    0.001_248_5,
    0.004_947_2,
    0.019_315_3,
    0.071_858_3,
    0.229_966_0,
    0.491_248_9,
    0.497_442_1,
    0.318_552_7,
    0.176_734_3,
    0.092_731_6,
    0.047_456_9,
    0.024_001_2,
];
const FIRST_OCTAVE: f64 = -5.0;

/// The nearest wander; `frame_noise` is the variance that pixel noise adds to one frame's level.
pub(crate) fn flicker(allan: &[AllanPoint], frame_noise: f64) -> Option<Flicker> {
    let period_s = allan.first()?.tau_s;
    let measured: Vec<(f64, f64)> = allan
        .iter()
        .filter(|point| point.tau_s >= AVERAGED_FRAMES_MIN * period_s)
        .map(|point| {
            let white = frame_noise * period_s / point.tau_s;
            (point.tau_s, point.common_c * point.common_c - white)
        })
        .filter(|(_, variance)| *variance > 0.0)
        .collect();
    if measured.len() < POINTS_MIN {
        return None;
    }
    let longest_s = measured
        .iter()
        .map(|(tau_s, _)| LONGEST * tau_s)
        .fold(0.0, f64::max);
    let mut nearest: Option<(f64, Flicker)> = None;
    let mut correlation_s = longest_s;
    while correlation_s >= period_s {
        for octaves in 1..=OCTAVES_MAX {
            // A part faster than a frame would be noise.
            if correlation_s / 2.0_f64.powi(exponent(octaves)) < period_s {
                break;
            }
            let (misfit, sd_c) = fit(&measured, correlation_s, octaves);
            if nearest.as_ref().is_none_or(|(least, _)| misfit < *least) {
                let flicker = Flicker {
                    sd_c,
                    correlation_s,
                    octaves,
                };
                nearest = Some((misfit, flicker));
            }
        }
        correlation_s /= 2.0_f64.sqrt();
    }
    nearest.map(|(_, flicker)| flicker)
}

/// Mean squared difference of the logarithms, and the standard deviation that minimizes it.
fn fit(measured: &[(f64, f64)], correlation_s: f64, octaves: u32) -> (f64, f64) {
    let ratios: Vec<f64> = measured
        .iter()
        .map(|(tau_s, variance)| (variance / allan_variance(tau_s / correlation_s, octaves)).ln())
        .collect();
    let count = count(ratios.len());
    let mean = ratios.iter().sum::<f64>() / count;
    let misfit = ratios
        .iter()
        .map(|ratio| (ratio - mean).powi(2))
        .sum::<f64>()
        / count;
    (misfit, (mean / 2.0).exp())
}

/// Allan variance of a wander of `octaves` parts with total variance 1, over averages of `times` its slowest time.
fn allan_variance(times: f64, octaves: u32) -> f64 {
    let sum: f64 = (1..=octaves)
        .map(|octave| of_one(times * 2.0_f64.powi(exponent(octave))))
        .sum();
    sum / f64::from(octaves)
}

/// Interpolates the logarithm in the table; below it falls with the square of the time, above it with the inverse.
fn of_one(times: f64) -> f64 {
    let knots: [(f64, f64); 12] =
        std::array::from_fn(|place| (FIRST_OCTAVE + count(place), ALLAN_VARIANCE[place].ln()));
    let octave = times.log2();
    let beyond = octave - octave.clamp(FIRST_OCTAVE, knots[knots.len() - 1].0);
    let slope = if beyond < 0.0 { 4.0_f64 } else { 0.5 };
    interpolated(&knots, octave).exp() * slope.powf(beyond)
}

/// Octaves count from 1, and the first has speed 2^0.
fn exponent(octave: u32) -> i32 {
    i32::try_from(octave).unwrap_or(1) - 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numbers::{assert_near, normal_draws};

    /// The common mode of a sensor with a cycle of `frames` recorded frames and noise of 0.05 °C.
    fn found_cycle(frames: f64, depth_c: f64, segments: u32) -> Option<Cycle> {
        let mut noise = normal_draws(3);
        let mut finder = CycleFinder::default();
        let mut place = 0.0_f64;
        for _ in 0..segments {
            let levels: Vec<f64> = (0..SEGMENT_FRAMES)
                .map(|_| {
                    place += 1.0;
                    // A hundredth past the frame, so that rounding cannot make two of five cold.
                    let cold = ((place + 0.01) / frames).fract() < 0.2;
                    0.05 * noise() + 0.002 * place - if cold { depth_c } else { 0.0 }
                })
                .collect();
            finder.push(&levels);
        }
        finder.finish(10.0)
    }

    #[test]
    fn a_cold_frame_in_five_is_found_with_its_depth_in_step_and_out_of_step() {
        for (frames, depth_c) in [(5.0, 0.15), (5.1, 0.15), (4.9, 0.08), (5.22, 0.2)] {
            let cycle = found_cycle(frames, depth_c, 80).unwrap();
            assert!((cycle.frames - frames).abs() < 0.02, "{cycle:?}");
            assert!((cycle.depth_c / depth_c - 1.0).abs() < 0.08, "{cycle:?}");
            assert_near(cycle.sensor_hz.unwrap(), 50.0 / frames, 0.04);
        }
    }

    #[test]
    fn noise_alone_has_no_cycle() {
        assert_eq!(found_cycle(5.0, 0.0, 3), None);
        assert_eq!(found_cycle(5.0, 0.0, 50), None);
        assert_eq!(found_cycle(5.0, 0.2, 2), None);
    }

    /// Allan deviations of a profile's own wander, from its frames and not from the table.
    #[test]
    fn the_wander_of_a_profile_is_found_again() {
        use crate::characterize::allan::Allan;
        use grideye_frame::{Celsius, Frame};
        use grideye_scene::profile::Profile;
        use std::time::Duration;
        for (correlation_s, octaves) in [(4.0, 1), (16.0, 5)] {
            let text = format!(
                "[common_mode]\nsd_c = 0.3\ncorrelation_s = {correlation_s}\noctaves = {octaves}\n"
            );
            let profile = Profile::parse(&text, "wander.toml").unwrap();
            let mut allan = Allan::default();
            for tick in 0..40_000_u32 {
                let t = Duration::from_millis(100) * tick;
                let frame =
                    profile.apply(1, u64::from(tick), t, Frame::uniform(Celsius::new(20.0)));
                let level = f64::from(frame.pixels[0].get()) - 20.0;
                allan.push(level);
            }
            let found = flicker(&allan.finish(0.1), 0.0).unwrap();
            assert_near(found.sd_c / 0.3, 1.0, 0.15);
            assert_near((found.correlation_s / correlation_s).log2(), 0.0, 0.8);
            assert!(found.octaves.abs_diff(octaves) <= 1, "{octaves}: {found:?}");
        }
    }

    #[test]
    fn nothing_is_fitted_to_nothing() {
        let points = [0.1, 0.8, 1.6, 3.2].map(|tau_s| AllanPoint {
            tau_s,
            common_c: 0.01,
        });
        assert_eq!(flicker(&[], 0.0), None);
        assert_eq!(flicker(&points[..3], 0.0), None, "two points");
        assert_eq!(flicker(&points, 1.0), None, "less than the pixels' noise");
    }
}
