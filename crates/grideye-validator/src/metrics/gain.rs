//! The gain over the blank frame: sums of squares over the pixels that are warm in either image.

use crate::metrics::score::Measure;
use crate::numbers::count;

#[derive(Debug, Clone, Copy)]
pub(crate) struct WarmLimits {
    pub(crate) ambient_c: f64,
    /// Limit above ambient for the real side.
    pub(crate) real_above_c: f64,
    /// Limit above ambient for the noise-free claim: half, as it needs no protection from noise.
    pub(crate) claimed_above_c: f64,
}

/// What is compared with a real frame, and how much it lies above the scene's level.
#[derive(Clone, Copy)]
pub(crate) struct Prediction<'a> {
    pub(crate) celsius: &'a [f64],
    pub(crate) offset_c: f64,
}

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct GainSums {
    pub(crate) pixels: usize,
    pub(crate) both: usize,
    /// Sums of squared residuals with the offset removed, and left in.
    predicted: [f64; 2],
    blank: [f64; 2],
}

impl WarmLimits {
    pub(crate) fn new(ambient_c: f64, real_above_c: f64) -> Self {
        Self {
            ambient_c,
            real_above_c,
            claimed_above_c: real_above_c / 2.0,
        }
    }
}

#[derive(Debug, Clone, Default)]
pub(crate) struct WarmRegion {
    places: Vec<usize>,
    both: usize,
}

impl WarmRegion {
    /// Marks pixels warm in `steady` less `offset_c`, or in the claim: a unit that reads high must not see more people.
    pub(crate) fn mark(
        &mut self,
        steady: &[f64],
        offset_c: f64,
        claim: &[f64],
        warmth: WarmLimits,
    ) {
        self.places.clear();
        self.both = 0;
        for (place, (&steady, &claim)) in steady.iter().zip(claim).enumerate() {
            let really_warm = steady - offset_c - warmth.ambient_c > warmth.real_above_c;
            let claimed_warm = claim - warmth.ambient_c > warmth.claimed_above_c;
            self.both += usize::from(really_warm && claimed_warm);
            if really_warm || claimed_warm {
                self.places.push(place);
            }
        }
    }
}

impl GainSums {
    /// Adds the pixels that are warm in a real frame or in the claim, as [`WarmRegion::mark`] finds them.
    pub(crate) fn add(
        &mut self,
        (measured, steady): (&[f64], &[f64]),
        offset_c: f64,
        claim: &[f64],
        prediction: Prediction<'_>,
        warmth: WarmLimits,
    ) {
        let mut marked = WarmRegion::default();
        marked.mark(steady, offset_c, claim, warmth);
        self.add_marked(measured, offset_c, &marked, prediction, warmth);
    }

    /// Adds the marked pixels of a real frame that lies `offset_c` above the scene's level.
    pub(crate) fn add_marked(
        &mut self,
        measured: &[f64],
        offset_c: f64,
        marked: &WarmRegion,
        prediction: Prediction<'_>,
        warmth: WarmLimits,
    ) {
        let square = |value: f64| value * value;
        self.both += marked.both;
        self.pixels += marked.places.len();
        for &place in &marked.places {
            let (measured, predicted) = (measured[place], prediction.celsius[place]);
            let leveled = measured - offset_c;
            let left = leveled - (predicted - prediction.offset_c);
            let ambient_c = warmth.ambient_c;
            let blank = [leveled - ambient_c, measured - ambient_c];
            add(
                &mut self.predicted,
                [left, measured - predicted].map(square),
            );
            add(&mut self.blank, blank.map(square));
        }
    }

    pub(crate) fn merge(&mut self, other: Self) {
        self.pixels += other.pixels;
        self.both += other.both;
        add(&mut self.predicted, other.predicted);
        add(&mut self.blank, other.blank);
    }

    /// Removes one noise variance per pixel from the predicted part.
    pub(crate) fn without_noise(mut self, sigma_c: f64) -> Self {
        let noise = count(self.pixels) * sigma_c * sigma_c;
        self.predicted = self.predicted.map(|squares| (squares - noise).max(0.0));
        self
    }

    /// The gains over the blank frame; undefined if nothing is warm.
    pub(crate) fn gains(&self) -> [(Measure, Option<f64>); 2] {
        let gain = |of: usize| {
            let (predicted, blank) = (self.predicted[of], self.blank[of]);
            (blank > 0.0).then(|| 1.0 - (predicted / blank).sqrt())
        };
        [(Measure::Gain, gain(0)), (Measure::GainWithOffset, gain(1))]
    }
}

fn add(sums: &mut [f64; 2], values: [f64; 2]) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numbers::{assert_near, common_offset};

    fn union(real: &[f64], claim: &[f64]) -> (GainSums, f64) {
        let offset_c = common_offset(real, claim);
        let mut union = GainSums::default();
        let prediction = Prediction {
            celsius: claim,
            offset_c: 0.0,
        };
        let warmth = WarmLimits::new(20.0, 1.0);
        union.add((real, real), offset_c, claim, prediction, warmth);
        (union, offset_c)
    }

    /// By hand: pixel 0 is warm in both, 1 in the claim, 2 in reality, 3 in neither. Squares 1 + 0.5625 + 4 of 16 + 0 +
    /// 4.
    #[test]
    fn gain_is_taken_over_the_union_of_claimed_and_really_warm() {
        let mut real = [20.0; 16];
        let mut claim = [20.0; 16];
        (real[0], claim[0]) = (24.0, 23.0);
        claim[1] = 20.75;
        real[2] = 22.0;
        (real[3], claim[3]) = (20.75, 20.5);
        let (union, offset_c) = union(&real, &claim);
        assert!(offset_c.abs() < 1e-12);
        assert_eq!((union.pixels, union.both), (3, 1));
        let [(_, gain), (_, with_offset)] = union.gains();
        assert_near(gain.unwrap(), 1.0 - (5.5625_f64 / 20.0).sqrt(), 1e-12);
        assert_eq!(gain, with_offset);
    }

    #[test]
    fn an_offset_is_taken_out_of_the_gain_and_left_in_beside_it() {
        let mut claim = [20.0; 16];
        claim[5] = 23.0;
        let real = claim.map(|value| value + 2.0);
        let (union, offset_c) = union(&real, &claim);
        assert_eq!((union.pixels, offset_c), (1, 2.0));
        let [(_, gain), (_, with_offset)] = union.gains();
        assert_eq!(gain, Some(1.0));
        assert!((with_offset.unwrap() - (1.0 - 2.0 / 5.0)).abs() < 1e-12);
    }

    /// The claim is 1.5 off in the one warm pixel, 4 above ambient; 1.25 of the squared 2.25 is noise.
    #[test]
    fn noise_is_taken_out_of_the_predicted_part_alone() {
        let mut real = [20.0; 16];
        let mut claim = [20.0; 16];
        (real[5], claim[5]) = (24.0, 22.5);
        let (union, _) = union(&real, &claim);
        for (sigma_c, expected) in [(1.25_f64.sqrt(), 0.75), (9.0, 1.0)] {
            for (measure, gain) in union.without_noise(sigma_c).gains() {
                assert!((gain.unwrap() - expected).abs() < 1e-12, "{measure}");
            }
        }
    }

    #[test]
    fn nothing_warm_has_no_gain() {
        let (union, _) = union(&[20.0; 16], &[20.0; 16]);
        assert_eq!(union.gains().map(|(_, gain)| gain), [None, None]);
    }
}
