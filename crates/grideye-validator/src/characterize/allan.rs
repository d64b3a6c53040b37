//! Allan deviations of the common mode, to which a profile's wander is fitted.

use crate::numbers::long_count;
use serde::Serialize;

/// Averages of 1, 2, 4 and so on up to 512 frames.
const OCTAVES: usize = 10;
const PAIRS_MIN: u64 = 8;

/// How much averages over consecutive stretches of one length differ.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AllanPoint {
    /// Length of the averages, seconds.
    pub tau_s: f64,
    /// Allan deviation of the common mode, °C.
    pub common_c: f64,
}

#[derive(Debug, Default)]
pub(crate) struct Allan([Octave; OCTAVES]);

#[derive(Debug, Default)]
struct Octave {
    /// Sum of squares of the differences of neighboring averages, and their number.
    squares: f64,
    pairs: u64,
    /// The first of two averages that make one of the next octave, and the average before this one.
    half: Option<f64>,
    before: Option<f64>,
}

impl Allan {
    /// Takes the level of the next frame.
    pub(crate) fn push(&mut self, level: f64) {
        let mut average = level;
        for octave in &mut self.0 {
            if let Some(before) = octave.before.replace(average) {
                octave.squares += (average - before).powi(2);
                octave.pairs += 1;
            }
            let Some(half) = octave.half.take() else {
                octave.half = Some(average);
                return;
            };
            average = f64::midpoint(half, average);
        }
    }

    pub(crate) fn break_off(&mut self) {
        for octave in &mut self.0 {
            octave.half = None;
            octave.before = None;
        }
    }

    #[cfg(test)]
    pub(crate) fn pairs(&self, octave: usize) -> u64 {
        self.0[octave].pairs
    }

    pub(crate) fn finish(self, period_s: f64) -> Vec<AllanPoint> {
        let frames = std::iter::successors(Some(1.0), |frames| Some(2.0 * frames));
        let octaves = self.0.into_iter().zip(frames);
        octaves
            .take_while(|(octave, _)| octave.pairs >= PAIRS_MIN)
            .map(|(octave, frames)| AllanPoint {
                tau_s: frames * period_s,
                common_c: (octave.squares / long_count(octave.pairs) / 2.0).sqrt(),
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numbers::normal_draws;

    #[test]
    fn white_noise_falls_with_the_root_and_a_ramp_rises() {
        let mut noise = normal_draws(5);
        let (mut white, mut ramp) = (Allan::default(), Allan::default());
        for place in 0..65_536_u32 {
            white.push(20.0 + 0.3 * noise());
            // A ramp of 0.001 per frame has an Allan deviation of 0.001 m / sqrt(2).
            ramp.push(0.001 * f64::from(place));
        }
        let (white, ramp) = (white.finish(0.1), ramp.finish(0.1));
        assert_eq!((white.len(), ramp.len()), (10, 10));
        for (number, (white, ramp)) in (0..).zip(white.iter().zip(ramp)) {
            let frames = 2.0_f64.powi(number);
            assert!((white.tau_s - 0.1 * frames).abs() < 1e-9);
            // 127 pairs determine it to some 8 %, with two of a kind per pair.
            let expected = 0.3 / frames.sqrt();
            assert!((white.common_c / expected - 1.0).abs() < 0.2, "{white:?}");
            let expected = 0.001 * frames / 2.0_f64.sqrt();
            assert!((ramp.common_c / expected - 1.0).abs() < 1e-6, "{ramp:?}");
        }
    }
}
