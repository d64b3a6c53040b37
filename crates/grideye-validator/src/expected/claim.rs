//! The scores behind the verdict as functions of recorded frames, the same for the recording and for drawn units.

use crate::align::Orientation;
use crate::align::aligner::SAME_MIN;
use crate::frames::SimulatedFrame;
use crate::metrics::distance::Centered;
use crate::metrics::foreground::CenteredProducts;
use crate::metrics::gain::{GainSums, Prediction, WarmLimits};
use crate::metrics::unclaimed::{AllowedWarmth, Unclaimed};
use crate::numbers::{common_offset, count, mean, mean_frame, sum_of};
use grideye_frame::PIXELS;

/// The simulated side, prepared for many recordings.
pub(crate) struct Claim {
    people: Vec<Shown>,
    /// The scene without its people; empty if unknown.
    nobody: Vec<Shown>,
    pairs: Vec<(usize, usize)>,
    warmth: WarmLimits,
    pub(crate) ambient_c: f64,
    is_static: bool,
    turns: Option<Turns>,
    places: AllowedWarmth,
}

/// A frame of the simulated side.
struct Shown {
    claim: Vec<f64>,
    /// The claim with simulated noise.
    noisy: Vec<f64>,
    centered: Centered,
    /// The first frame with the same claim.
    same_as: usize,
}

/// The scores behind the verdict; `None` where undefined.
#[derive(Debug, Clone, Default)]
pub(crate) struct Statistics {
    pub(crate) correlation: Option<f64>,
    pub(crate) gain: Option<f64>,
    /// C with the empty room subtracted from both sides.
    pub(crate) above_room: Option<f64>,
    /// Gain beyond that of the scene without its people.
    pub(crate) over_nobody: Option<f64>,
    pub(crate) unclaimed: Unclaimed,
    /// How much more the recording resembles the claim than the claim in each other orientation.
    pub(crate) upright: Vec<(Orientation, f64)>,
}

pub(crate) struct Sides<'a> {
    pub(crate) simulated: Vec<&'a SimulatedFrame>,
    /// The scene without its people for each simulated frame; empty if unknown.
    pub(crate) nobody: Vec<&'a [f64]>,
    pub(crate) pairs: Vec<(usize, usize)>,
    pub(crate) warmth: WarmLimits,
    pub(crate) ambient_c: f64,
    /// Whether warm pixels are read from the mean of all frames.
    pub(crate) is_static: bool,
    pub(crate) columns: usize,
    /// The unit's pattern within the simulated frames, row by row; empty if none.
    pub(crate) pattern: &'a [f64],
    /// Weight of the mean image against one frame: noise² / (noise² + frames · pattern²).
    pub(crate) still_weight: f64,
}

impl Claim {
    pub(crate) fn new(sides: Sides<'_>) -> Self {
        let simulated = || sides.simulated.iter();
        let claims: Vec<&[f64]> = simulated().map(|frame| &frame.noise_free[..]).collect();
        let people = simulated().map(|frame| (frame.noise_free.clone(), frame.celsius.clone()));
        let nobody = sides.simulated.iter().zip(&sides.nobody);
        let nobody = nobody.map(|(frame, empty)| (empty.to_vec(), frame.under_noise(empty)));
        Self {
            people: shown(people),
            nobody: shown(nobody),
            turns: Turns::new(&claims, sides.still_weight),
            places: AllowedWarmth::new(
                &without(sides.pattern, &claims),
                sides.columns,
                sides.warmth,
            ),
            pairs: sides.pairs,
            warmth: sides.warmth,
            ambient_c: sides.ambient_c,
            is_static: sides.is_static,
        }
    }

    pub(crate) fn pixels(&self) -> usize {
        self.people.first().map_or(0, |shown| shown.claim.len())
    }

    pub(crate) fn claimed(&self, real: usize) -> &[f64] {
        beside(&self.people, real)
    }

    pub(crate) fn nobody(&self, real: usize) -> &[f64] {
        beside(&self.nobody, real)
    }

    pub(crate) fn knows_nobody(&self) -> bool {
        !self.nobody.is_empty()
    }

    /// Orientations in which the claim looks much as it does upright.
    pub(crate) fn alike(&self) -> &[Orientation] {
        self.turns.as_ref().map_or(&[], |turns| &turns.alike)
    }

    /// Scores recorded frames, with the recording's own empty room if it was learned.
    pub(crate) fn of_all(&self, frames: &[Vec<f64>], room: Option<&[f64]>) -> Statistics {
        let claims: Vec<&[f64]> = (0..frames.len()).map(|index| self.claimed(index)).collect();
        let turns = self.turns.as_ref();
        Statistics {
            correlation: self.correlation(frames),
            unclaimed: self.places.of(frames, &claims),
            upright: turns.map_or_else(Vec::new, |turns| turns.of(frames)),
            ..self.of_people(frames, room)
        }
    }

    pub(crate) fn of_image(&self, frames: &[Vec<f64>]) -> Statistics {
        Statistics {
            correlation: self.correlation(frames),
            gain: self.gain(frames, &self.people),
            ..Statistics::default()
        }
    }

    pub(crate) fn of_people(&self, frames: &[Vec<f64>], room: Option<&[f64]>) -> Statistics {
        let gain = self.gain(frames, &self.people);
        let without = self.gain(frames, &self.nobody);
        Statistics {
            gain,
            above_room: self.above_room(frames, room),
            over_nobody: gain
                .filter(|_| self.knows_nobody())
                .map(|gain| gain - without.unwrap_or(0.0)),
            ..Statistics::default()
        }
    }

    fn correlation(&self, real: &[Vec<f64>]) -> Option<f64> {
        let centered: Vec<Centered> = real.iter().map(|frame| Centered::new(frame)).collect();
        let of_pair = |&(real, shown): &(usize, usize)| {
            centered[real].correlation(&self.people[shown].centered)
        };
        let all: Vec<f64> = self.pairs.iter().filter_map(of_pair).collect();
        mean(&all)
    }

    fn gain(&self, real: &[Vec<f64>], side: &[Shown]) -> Option<f64> {
        let steady = self.is_static.then(|| mean_frame(real));
        let mut union = GainSums::default();
        let mut last = (usize::MAX, usize::MAX, 0.0);
        for &(index, place) in &self.pairs {
            let (frame, shown) = (&real[index], side.get(place)?);
            if (last.0, last.1) != (index, shown.same_as) {
                last = (index, shown.same_as, common_offset(frame, &shown.claim));
            }
            let prediction = Prediction {
                celsius: &shown.noisy,
                offset_c: 0.0,
            };
            let seen = (
                frame.as_slice(),
                steady.as_ref().unwrap_or(frame).as_slice(),
            );
            union.add(seen, last.2, &shown.claim, prediction, self.warmth);
        }
        union.gains()[0].1
    }

    fn above_room(&self, frames: &[Vec<f64>], room: Option<&[f64]>) -> Option<f64> {
        let mut products = CenteredProducts::default();
        let claims = self.people.iter().zip(&self.nobody);
        for (frame, (claim, nobody)) in frames.iter().zip(claims) {
            let room = room.unwrap_or(&nobody.claim);
            products.add(frame, room, &claim.claim, &nobody.claim);
        }
        products.correlation()
    }
}

fn without(pattern: &[f64], frames: &[&[f64]]) -> Vec<Vec<f64>> {
    let taken = pattern.iter().copied().chain(std::iter::repeat(0.0));
    let without = |frame: &&[f64]| {
        let pixels = frame.iter().zip(taken.clone());
        pixels.map(|(celsius, pattern)| celsius - pattern).collect()
    };
    frames.iter().map(without).collect()
}

fn shown(frames: impl Iterator<Item = (Vec<f64>, Vec<f64>)>) -> Vec<Shown> {
    let mut all: Vec<Shown> = Vec::new();
    for (claim, noisy) in frames {
        let same_as = all
            .last()
            .filter(|before| before.claim == claim)
            .map_or(all.len(), |before| before.same_as);
        all.push(Shown {
            centered: Centered::new(&noisy),
            claim,
            noisy,
            same_as,
        });
    }
    all
}

fn beside(shown: &[Shown], real: usize) -> &[f64] {
    let frame = shown.get(real).or(shown.last());
    frame.map_or(&[], |shown| shown.claim.as_slice())
}

pub(crate) struct Turns {
    claims: Vec<(Orientation, Split)>,
    squares: f64,
    alike: Vec<Orientation>,
    still_weight: f64,
}

/// Centered frames split into their mean and the deviation from it.
struct Split {
    still: Vec<f64>,
    moving: Vec<Vec<f64>>,
}

/// A claim with less contrast than this over all pixels, °C, has no orientation.
const CONTRAST_MIN_C: f64 = 1e-3;

impl Turns {
    /// `None` for images that are not 8 x 8 or claim nothing.
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
        let mut found = found.iter();
        found.find(|found| found.0 == sought).unwrap().1
    }

    /// Pixel 1 of the first row, mirrored left to right, is pixel 6, which the recording shows.
    #[test]
    fn a_mirrored_recording_is_more_like_the_mirrored_claim() {
        let claim = blob(1);
        let turns = Turns::new(&[&claim, &claim], 1.0).unwrap();
        assert!(turns.alike.is_empty());
        let found = turns.of(&[blob(6), blob(6)]);
        // Two frames of one pixel each out of 64: different places have a likeness of -1/63.
        let expected = -1.0 / 63.0 - 1.0;
        assert!((likeness(&found, Orientation::MirroredLeftRight) - expected).abs() < 1e-12);
        assert!(likeness(&found, Orientation::Half).abs() < 1e-12);
        let nothing = [vec![20.0; PIXELS], vec![20.0; PIXELS]];
        assert!(turns.of(&nothing).is_empty());
    }

    /// A blob that walks along the middle rows is its own mirror image top to bottom.
    #[test]
    fn orientations_like_the_upright_one_are_named() {
        let walk: [Vec<f64>; 8] = std::array::from_fn(|column| {
            let mut frame = blob(24 + column);
            frame[32 + column] = 23.0;
            frame
        });
        let claims = walk.each_ref().map(Vec::as_slice);
        let turns = Turns::new(&claims, 0.1).unwrap();
        assert_eq!(turns.alike, [Orientation::MirroredTopBottom]);
        assert!(Turns::new(&[&[20.0; PIXELS]], 1.0).is_none());
        assert!(Turns::new(&[&[20.0, 21.0]], 1.0).is_none());
    }

    /// With weight 0 only motion counts.
    #[test]
    fn still_warmth_has_the_given_weight() {
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
