//! Whether a recording's image is more like the claim upright or in another orientation.
//!
//! Frames are centred, then split into their mean over time and what departs from it. A unit's pattern is in the mean
//! alone, whose squares therefore weigh less the more frames there are: squares of the noise over squares of noise and
//! pattern. This is the metric in which recordings of one claim are spread evenly, so that the angle between recording and
//! claim is what tells orientations apart best.

use crate::align::Orientation;
use crate::align::aligner::SAME_MIN;
use crate::numbers::{count, mean, mean_frame, sum_of};
use grideye_frame::PIXELS;

/// A claim in all its orientations.
pub(crate) struct Turns {
    claims: Vec<(Orientation, Split)>,
    squares: f64,
    alike: Vec<Orientation>,
    still_weight: f64,
}

/// Centred frames as their mean and what departs from it.
struct Split {
    still: Vec<f64>,
    moving: Vec<Vec<f64>>,
}

/// A claim of less contrast, °C over all pixels, lies in no way.
const CONTRAST_MIN_C: f64 = 1e-3;

impl Turns {
    /// `None` for images that are not 8 x 8, or claim nothing.
    pub(crate) fn new(claims: &[&[f64]], still_weight: f64) -> Option<Self> {
        let claims: Option<Vec<[f64; PIXELS]>> =
            claims.iter().map(|&frame| frame.try_into().ok()).collect();
        let claims = claims?;
        let split = |orientation: Orientation| {
            let turned = claims.iter().map(|frame| orientation.apply(frame).to_vec());
            (orientation, Split::new(turned))
        };
        let claims: Vec<(Orientation, Split)> = Orientation::ALL.map(split).into();
        let upright = &claims.first()?.1;
        let squares = upright.product(upright, still_weight);
        if squares < CONTRAST_MIN_C * CONTRAST_MIN_C {
            return None;
        }
        let alike: Vec<Orientation> = claims
            .iter()
            .skip(1)
            .filter(|(_, split)| split.product(upright, still_weight) > SAME_MIN * squares)
            .map(|(orientation, _)| *orientation)
            .collect();
        Some(Self {
            claims,
            squares,
            alike,
            still_weight,
        })
    }

    /// Orientations that leave the claim much as it was.
    pub(crate) fn alike(&self) -> &[Orientation] {
        &self.alike
    }

    /// The upright likeness less that of each other orientation, -2 to 2.
    pub(crate) fn of(&self, real: &[Vec<f64>]) -> Vec<(Orientation, f64)> {
        let real = Split::new(real.iter().cloned());
        let squares = real.product(&real, self.still_weight);
        if squares <= 0.0 {
            return Vec::new();
        }
        let scale = (squares * self.squares).sqrt();
        let likeness = |split: &Split| split.product(&real, self.still_weight) / scale;
        let Some(((_, upright), others)) = self.claims.split_first() else {
            return Vec::new();
        };
        let upright = likeness(upright);
        others
            .iter()
            .map(|(orientation, split)| (*orientation, upright - likeness(split)))
            .collect()
    }
}

impl Split {
    fn new(frames: impl Iterator<Item = Vec<f64>>) -> Self {
        let mut moving: Vec<Vec<f64>> = frames.collect();
        for frame in &mut moving {
            let level = mean(frame).unwrap_or(0.0);
            frame.iter_mut().for_each(|value| *value -= level);
        }
        let still = mean_frame(&moving);
        for frame in &mut moving {
            for (value, still) in frame.iter_mut().zip(&still) {
                *value -= still;
            }
        }
        Self { still, moving }
    }

    fn product(&self, other: &Self, still_weight: f64) -> f64 {
        let product = |x: &[f64], y: &[f64]| sum_of(x, y, |x, y| x * y);
        let moving: f64 = self
            .moving
            .iter()
            .zip(&other.moving)
            .map(|(x, y)| product(x, y))
            .sum();
        moving + count(self.moving.len()) * still_weight * product(&self.still, &other.still)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blob(pixel: usize) -> Vec<f64> {
        let mut frame = vec![20.0; PIXELS];
        frame[pixel] = 23.0;
        frame
    }

    fn likeness(found: &[(Orientation, f64)], sought: Orientation) -> f64 {
        found
            .iter()
            .find(|(orientation, _)| *orientation == sought)
            .unwrap()
            .1
    }

    /// Pixel 1 of the first row: mirrored left to right it is pixel 6, which the recording shows.
    #[test]
    fn a_mirrored_recording_is_more_like_the_mirrored_claim() {
        let claim = blob(1);
        let turns = Turns::new(&[&claim, &claim], 1.0).unwrap();
        assert!(turns.alike().is_empty());
        let found = turns.of(&[blob(6), blob(6)]);
        // Two frames of one pixel each, 64 of them: the likeness of different places is -1/63.
        let expected = -1.0 / 63.0 - 1.0;
        assert!((likeness(&found, Orientation::MirroredLeftRight) - expected).abs() < 1e-12);
        assert!(likeness(&found, Orientation::Half).abs() < 1e-12);
        assert!(
            turns
                .of(&[vec![20.0; PIXELS], vec![20.0; PIXELS]])
                .is_empty()
        );
    }

    /// A blob in the middle rows that walks from left to right is its own mirror image from top to bottom.
    #[test]
    fn what_a_claim_is_much_like_is_named() {
        let walk: Vec<Vec<f64>> = (0..8)
            .map(|column| {
                let mut frame = vec![20.0; PIXELS];
                frame[24 + column] = 23.0;
                frame[32 + column] = 23.0;
                frame
            })
            .collect();
        let claims: Vec<&[f64]> = walk.iter().map(Vec::as_slice).collect();
        let turns = Turns::new(&claims, 0.1).unwrap();
        assert_eq!(turns.alike(), [Orientation::MirroredTopBottom]);
        assert!(Turns::new(&[&[20.0; PIXELS]], 1.0).is_none());
        assert!(Turns::new(&[&[20.0, 21.0]], 1.0).is_none());
    }

    /// What stands still weighs as much as it is told to: with 0 only what moves is looked at.
    #[test]
    fn what_stands_still_weighs_as_told() {
        let mut claims = [blob(1), blob(9)];
        let mut real = [blob(1), blob(9)];
        for (claim, real) in claims.iter_mut().zip(&mut real) {
            claim[58] = 26.0;
            real[61] = 26.0;
        }
        let claims = claims.each_ref().map(Vec::as_slice);
        let mirrored = |weight: f64| {
            let turns = Turns::new(&claims, weight).unwrap();
            likeness(&turns.of(&real), Orientation::MirroredLeftRight)
        };
        assert!((mirrored(0.0) - 1.0).abs() < 1e-12);
        assert!(mirrored(1.0) < 0.0);
    }
}
