//! The wander of the common mode: the nearest sum of octaves to its Allan deviations.

use crate::characterize::allan::AllanPoint;
use crate::numbers::count;
use grideye_scene::profile::OCTAVES_MAX;

/// Averages over fewer frames still hold the five-frame cycle.
const FRAMES_MIN: f64 = 7.5;
/// Points below which nothing is fitted: there are three unknowns.
const POINTS_MIN: usize = 3;
/// The slowest wander tried is so many times as long as the longest average.
const LONGEST: f64 = 2.0;

/// The wander of a sensor profile whose Allan deviations are nearest to those found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flicker {
    /// Its standard deviation, °C.
    pub sd_c: f64,
    /// The time of its slowest part, seconds. Not beyond twice the longest averages: what is slower cannot be told.
    pub correlation_s: f64,
    /// The number of its parts, each twice as quick as the one before.
    pub octaves: u32,
}

/// Allan variance of one wander of variance 1 and correlation time 1 over 2^-5 to 2^6: the double integral of its
/// autocorrelation, which follows from the blend of two independent draws that it is.
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

/// The nearest wander; `frame_noise` is the variance of one frame's level that the noise of the pixels makes.
pub(crate) fn flicker(allan: &[AllanPoint], frame_noise: f64) -> Option<Flicker> {
    let period_s = allan.first()?.tau_s;
    let measured: Vec<(f64, f64)> = allan
        .iter()
        .filter(|point| point.tau_s >= FRAMES_MIN * period_s)
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
            // Parts quicker than a frame would be noise.
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

/// The mean square of the logarithms' differences, and the standard deviation at which it is least.
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

/// Of a wander of so many octaves with variance 1 in all, over averages of so many of its slowest part's times.
fn allan_variance(times: f64, octaves: u32) -> f64 {
    let sum: f64 = (1..=octaves)
        .map(|octave| of_one(times * 2.0_f64.powi(exponent(octave))))
        .sum();
    sum / f64::from(octaves)
}

/// The logarithm is blended between the table's points; beyond them it falls with the square, and with the root.
fn of_one(times: f64) -> f64 {
    let place = times.log2() - FIRST_OCTAVE;
    let last = count(ALLAN_VARIANCE.len() - 1);
    if place <= 0.0 {
        return ALLAN_VARIANCE[0] * 4.0_f64.powf(place);
    }
    if place >= last {
        return ALLAN_VARIANCE[ALLAN_VARIANCE.len() - 1] * 2.0_f64.powf(last - place);
    }
    let mut left = 0;
    while count(left + 1) < place {
        left += 1;
    }
    let share = place - count(left);
    let (below, above) = (ALLAN_VARIANCE[left].ln(), ALLAN_VARIANCE[left + 1].ln());
    (below + share * (above - below)).exp()
}

/// Octaves count from 1, their speeds from 2^0.
fn exponent(octave: u32) -> i32 {
    i32::try_from(octave).unwrap_or(1) - 1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Allan deviations of a profile's own wander, found from its frames and not from the table.
    #[test]
    fn the_wander_of_a_profile_is_found_again() {
        use crate::characterize::allan::Allan;
        use grideye_frame::{Celsius, Frame, PIXELS};
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
                allan.push(&[level; PIXELS], level);
            }
            let found = flicker(&allan.finish(0.1), 0.0).unwrap();
            assert!(
                (found.sd_c / 0.3 - 1.0).abs() < 0.15,
                "{octaves}: {found:?}"
            );
            assert!(
                (found.correlation_s / correlation_s).log2().abs() < 0.8,
                "{octaves}: {found:?}"
            );
            assert!(found.octaves.abs_diff(octaves) <= 1, "{octaves}: {found:?}");
        }
    }

    #[test]
    fn nothing_is_fitted_to_nothing() {
        assert_eq!(flicker(&[], 0.0), None);
        let point = |tau_s: f64| AllanPoint {
            tau_s,
            pixel_c: 0.1,
            common_c: 0.01,
        };
        assert_eq!(
            flicker(&[point(0.1), point(0.8), point(1.6)], 0.0),
            None,
            "two points"
        );
        let all_white = [point(0.1), point(0.8), point(1.6), point(3.2)];
        assert_eq!(
            flicker(&all_white, 1.0),
            None,
            "less than the noise of the pixels"
        );
    }
}
