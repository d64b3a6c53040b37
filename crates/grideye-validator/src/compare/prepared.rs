//! Frames prepared for repeated scoring, and sums over pairs of them.

use crate::compare::settings::Settings;
use crate::frames::{Protocol, RealFrame, Shape, SimulatedFrame};
use crate::metrics::counting::{Binned, Counter, mutual_corrected, mutual_of};
use crate::metrics::distance::Centered;
use crate::metrics::gain::{GainSums, Prediction, WarmLimits, WarmRegion};
use crate::metrics::pair::Graph;
use crate::metrics::score::Measure;
use crate::metrics::{self, Binning, Blob, structural_similarity};
use crate::numbers::{common_offset, count, difference_sums, evenly, finite, mean_frame, median};

/// A frame with its bins, entropies and warm pixels.
#[derive(Clone)]
pub(crate) struct Prepared {
    pub(crate) celsius: Vec<f64>,
    /// Where warm pixels are read from: the claim, the sequence's mean (static), or the frame itself.
    pub(crate) steady: Vec<f64>,
    centered: Centered,
    steady_centered: Centered,
    grey: Binned,
    chosen: Binned,
    /// Warm pixels of the frame, or of a simulated frame's claim.
    warm: Vec<bool>,
    blob: Option<Blob>,
    /// The median, against which pixels are warm; no order of the pixels changes it.
    background: f64,
    truth: Option<Vec<bool>>,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Preparation {
    pub(crate) shape: Shape,
    pub(crate) binning: Binning,
    pub(crate) warm_above_c: f64,
}

/// Frames for the simulated side of the pairs.
pub(crate) struct FrameSet {
    pub(crate) frames: Vec<Prepared>,
    /// For each frame the first in a row of frames with the same claim, which is evaluated once.
    claims: Vec<usize>,
}

/// Both sides of a comparison, and the blank frame.
pub(crate) struct ComparedFrames {
    pub(crate) real: Vec<Prepared>,
    pub(crate) simulated: FrameSet,
    pub(crate) blank: Prepared,
    pub(crate) preparation: Preparation,
    pub(crate) sigma_c: f64,
    pub(crate) ambient_c: f64,
    field_of_view_rad: Option<[f64; 2]>,
    pub(crate) warmth: WarmLimits,
}

/// Mean of each measure over the pairs where it is defined.
#[derive(Clone)]
pub(crate) struct Means(Vec<(f64, usize)>);

pub(crate) struct Tally {
    counter: Counter,
    pub(crate) graph: Graph,
}

impl Preparation {
    pub(crate) fn real(&self, celsius: &[f64], steady: &[f64]) -> Prepared {
        self.frame(celsius, steady, celsius, None)
    }

    pub(crate) fn simulated(
        &self,
        celsius: &[f64],
        claim: &[f64],
        truth: Option<&[bool]>,
    ) -> Prepared {
        self.frame(celsius, claim, claim, truth)
    }

    fn frame(
        &self,
        celsius: &[f64],
        steady: &[f64],
        shown: &[f64],
        truth: Option<&[bool]>,
    ) -> Prepared {
        let counter = Counter::new();
        // Already checked; if not, a single bin would at least claim no information.
        let binned = |binning| {
            let binned = counter.binned(celsius, binning);
            binned.unwrap_or_else(|| Binned::of_nothing(celsius.len()))
        };
        Prepared {
            celsius: celsius.to_vec(),
            steady: steady.to_vec(),
            centered: Centered::new(celsius),
            steady_centered: Centered::new(steady),
            grey: binned(Binning::PaperGrey256),
            chosen: binned(self.binning),
            warm: metrics::warm(shown, self.warm_above_c),
            blob: Blob::find(shown, self.shape.columns, self.warm_above_c),
            background: median(shown).unwrap_or(0.0),
            truth: truth.map(<[bool]>::to_vec),
        }
    }

    /// A simulated frame with its pixels reordered; entropies are unchanged, and the truth stays in place.
    fn permuted(&self, frame: &Prepared, order: &[usize]) -> Prepared {
        let steady = pick(&frame.steady, order);
        let warm: Vec<bool> = order.iter().map(|&index| frame.warm[index]).collect();
        Prepared {
            celsius: pick(&frame.celsius, order),
            blob: Blob::of(&steady, self.shape.columns, frame.background, &warm),
            background: frame.background,
            steady,
            centered: frame.centered.permuted(order),
            steady_centered: frame.steady_centered.permuted(order),
            grey: frame.grey.permuted(order),
            chosen: frame.chosen.permuted(order),
            warm,
            truth: frame.truth.clone(),
        }
    }
}

impl FrameSet {
    pub(crate) fn new(frames: Vec<Prepared>) -> Self {
        let mut claims: Vec<usize> = Vec::with_capacity(frames.len());
        for (index, frame) in frames.iter().enumerate() {
            let same = claims
                .last()
                .copied()
                .filter(|&before| frames[before].steady == frame.steady);
            claims.push(same.unwrap_or(index));
        }
        Self { frames, claims }
    }

    pub(crate) fn permuted(&self, preparation: &Preparation, order: &[usize]) -> Self {
        let permuted = |frame| preparation.permuted(frame, order);
        Self {
            frames: self.frames.iter().map(permuted).collect(),
            claims: self.claims.clone(),
        }
    }

    /// The frames that pairs need, and the pairs with new indices.
    pub(crate) fn of_pairs(&self, pairs: &[(usize, usize)]) -> (Self, Vec<(usize, usize)>) {
        let mut wanted: Vec<usize> = pairs.iter().map(|&(_, simulated)| simulated).collect();
        wanted.sort_unstable();
        wanted.dedup();
        let place = |simulated: usize| wanted.partition_point(|&other| other < simulated);
        let pairs = pairs
            .iter()
            .map(|&(real, simulated)| (real, place(simulated)));
        let pairs = pairs.collect();
        let frames = wanted.iter().map(|&index| self.frames[index].clone());
        (Self::new(frames.collect()), pairs)
    }

    /// The simulated frame for a real one; the last one if there are fewer.
    pub(crate) fn beside(&self, real: usize) -> Option<&Prepared> {
        self.frames.get(real).or(self.frames.last())
    }
}

impl Default for Means {
    fn default() -> Self {
        Self(vec![(0.0, 0); Measure::ALL.len()])
    }
}

impl Means {
    pub(crate) fn add(&mut self, values: &[(Measure, Option<f64>)]) {
        for &(measure, value) in values {
            if let Some(value) = value {
                let (sum, number) = &mut self.0[measure.place()];
                *sum += value;
                *number += 1;
            }
        }
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        for ((sum, number), (more, further)) in self.0.iter_mut().zip(&other.0) {
            *sum += more;
            *number += further;
        }
    }

    pub(crate) fn set(&mut self, measure: Measure, value: Option<f64>) {
        if let Some(value) = value {
            self.0[measure.place()] = (value, 1);
        }
    }

    pub(crate) fn get(&self, measure: Measure) -> Option<f64> {
        let (sum, number) = self.0[measure.place()];
        (number > 0).then(|| sum / count(number))
    }
}

impl Tally {
    pub(crate) fn new() -> Self {
        Self {
            counter: Counter::new(),
            graph: Graph::default(),
        }
    }

    /// The paper's measures and the plain distances; adds the differences to the evaluation graph.
    pub(crate) fn plain(
        &mut self,
        real: &Prepared,
        simulated: &Prepared,
    ) -> [(Measure, Option<f64>); 15] {
        use Measure as M;
        let (x, y) = (&real.celsius, &simulated.celsius);
        let pixels = count(x.len());
        let similar = self.graph.add(x, y);
        let [squares, absolute, plain] = difference_sums(x, y);
        let correlation = real.centered.correlation(&simulated.centered);
        let mut bits = |real: &Binned, simulated: &Binned| {
            let joint = self.counter.joint(real, simulated);
            let mutual = mutual_of(real, simulated, joint);
            let corrected = mutual_corrected(real, simulated, joint);
            let own = [real.entropy, simulated.entropy, joint.entropy];
            (own.map(Some), [mutual, corrected].map(Some))
        };
        let ([real_grey, simulated_grey, joint_grey], grey) = bits(&real.grey, &simulated.grey);
        let ([real_own, simulated_own, joint_own], own) = bits(&real.chosen, &simulated.chosen);
        [
            (M::Correlation, correlation),
            (M::ImageSimilarity, finite(count(similar) / pixels)),
            (M::Rmse, finite(squares / pixels).map(f64::sqrt)),
            (M::Mae, finite(absolute / pixels)),
            (M::Bias, finite(plain / pixels)),
            (M::EntropyRealGrey, real_grey),
            (M::EntropySimulatedGrey, simulated_grey),
            (M::JointEntropyGrey, joint_grey),
            (M::MutualInformationGrey, grey[0]),
            (M::MutualInformationGreyCorrected, grey[1]),
            (M::EntropyRealBinned, real_own),
            (M::EntropySimulatedBinned, simulated_own),
            (M::JointEntropyBinned, joint_own),
            (M::MutualInformationBinned, own[0]),
            (M::MutualInformationBinnedCorrected, own[1]),
        ]
    }
}

impl ComparedFrames {
    pub(crate) fn new(
        preparation: Preparation,
        real: &[RealFrame],
        simulated: &[SimulatedFrame],
        settings: &Settings,
        noise_sigma_c: f64,
    ) -> Self {
        let ambient = vec![settings.ambient_c; preparation.shape.pixels()];
        // What stands still is clearer in the mean of all frames.
        let (steady, averaged) = match settings.protocol {
            Protocol::Static => (
                Some(mean_frame(real.iter().map(|frame| &frame.celsius))),
                real.len(),
            ),
            Protocol::Dynamic => (None, 1),
        };
        let prepare_real = |frame: &RealFrame| {
            preparation.real(&frame.celsius, steady.as_ref().unwrap_or(&frame.celsius))
        };
        let prepare_simulated = |frame: &SimulatedFrame| {
            preparation.simulated(&frame.celsius, &frame.noise_free, frame.truth.as_deref())
        };
        let above_c = settings.warm_above(noise_sigma_c / count(averaged.max(1)).sqrt());
        Self {
            real: real.iter().map(prepare_real).collect(),
            simulated: FrameSet::new(simulated.iter().map(prepare_simulated).collect()),
            blank: preparation.simulated(&ambient, &ambient, None),
            preparation,
            sigma_c: noise_sigma_c,
            ambient_c: settings.ambient_c,
            field_of_view_rad: settings.field_of_view_rad,
            warmth: WarmLimits::new(settings.ambient_c, above_c),
        }
    }

    pub(crate) fn pixels(&self) -> usize {
        self.blank.celsius.len()
    }

    /// Measures of places and noise; the truth is that of `beside`, whatever frame is `put` in its place.
    pub(crate) fn placed(
        &self,
        real: &Prepared,
        put: &Prepared,
        beside: &Prepared,
    ) -> [(Measure, Option<f64>); 7] {
        let (x, y) = (&real.celsius, &put.celsius);
        let columns = self.preparation.shape.columns;
        let blobs = real.blob.as_ref().zip(put.blob.as_ref());
        let shape = (columns, self.preparation.shape.rows);
        let angle = |(real, put): (&Blob, &Blob)| {
            metrics::angle_between(real, put, shape, self.field_of_view_rad?)
        };
        let covered = beside.truth.as_deref();
        let covered = covered.and_then(|mask| metrics::foreground_rmse(x, y, mask));
        let slope = real.centered.slope_over(&put.steady_centered);
        let apart = blobs.map(|(real, put)| real.distance_pixels(put));
        let overlap = metrics::overlap(&real.warm, &put.warm);
        let chi = metrics::chi_squared(x, &put.steady, self.sigma_c);
        let structure = structural_similarity(x, y, columns, self.ambient_c);
        [
            (Measure::ForegroundRmse, covered),
            (Measure::ContrastSlope, slope),
            (Measure::CentroidErrorPixels, apart),
            (Measure::CentroidErrorDegrees, blobs.and_then(angle)),
            (Measure::WarmOverlap, overlap),
            (
                Measure::ChiSquaredPerDegree,
                chi.and_then(|chi| chi.per_degree()),
            ),
            (Measure::StructuralSimilarity, structure),
        ]
    }

    /// Slope of a frame over its repeat, corrected for the repeat's noise.
    pub(crate) fn slope_over_repeat(&self, real: &Prepared, later: &Prepared) -> Option<f64> {
        real.centered
            .slope_over_noisy(&later.centered, self.sigma_c)
    }

    /// Adds pairs, over the pixels that are warm in the claim or in reality, each with its common offset.
    pub(crate) fn add_to_gain(
        &self,
        gain: &mut GainSums,
        pairs: &[(usize, usize)],
        offsets: &[f64],
        side: &FrameSet,
    ) {
        let mut marked = WarmRegion::default();
        let mut last = None;
        for (&(real, put), &offset_c) in pairs.iter().zip(offsets) {
            let (frame, put, claim) = (&self.real[real], &side.frames[put], side.claims[put]);
            if last.replace((real, claim)) != Some((real, claim)) {
                marked.mark(&frame.steady, offset_c, &put.steady, self.warmth);
            }
            let prediction = Prediction {
                celsius: &put.celsius,
                offset_c: 0.0,
            };
            gain.add_marked(&frame.celsius, offset_c, &marked, prediction, self.warmth);
        }
    }

    /// Adds the repeat of a real frame in place of the simulation, over the same pixels.
    pub(crate) fn add_repeat_to_gain(&self, gain: &mut GainSums, real: usize, later: &Prepared) {
        let Some(beside) = self.simulated.beside(real) else {
            return;
        };
        let frame = &self.real[real];
        let offset_c = self.offset(real, beside);
        let prediction = Prediction {
            celsius: &later.celsius,
            offset_c: offset_c + common_offset(&later.celsius, &frame.celsius),
        };
        let seen = (frame.celsius.as_slice(), frame.steady.as_slice());
        gain.add(seen, offset_c, &beside.steady, prediction, self.warmth);
    }

    pub(crate) fn offset(&self, real: usize, simulated: &Prepared) -> f64 {
        common_offset(&self.real[real].celsius, &simulated.steady)
    }

    pub(crate) fn offsets<'a>(
        &'a self,
        pairs: &'a [(usize, usize)],
        side: &'a FrameSet,
    ) -> impl Iterator<Item = f64> + 'a {
        let mut last = (usize::MAX, usize::MAX, 0.0);
        pairs.iter().map(move |&(real, put)| {
            let claim = side.claims[put];
            if (last.0, last.1) != (real, claim) {
                last = (real, claim, self.offset(real, &side.frames[put]));
            }
            last.2
        })
    }
}

fn pick(values: &[f64], order: &[usize]) -> Vec<f64> {
    order.iter().map(|&index| values[index]).collect()
}

pub(crate) fn pairs(protocol: Protocol, real: usize, simulated: usize) -> Vec<(usize, usize)> {
    match protocol {
        Protocol::Static => (0..real)
            .flat_map(|r| (0..simulated).map(move |s| (r, s)))
            .collect(),
        Protocol::Dynamic => (0..real.min(simulated)).map(|k| (k, k)).collect(),
    }
}

/// Up to `number` of the pairs, evenly spread, including first and last.
pub(crate) fn thinned(pairs: &[(usize, usize)], number: usize) -> Vec<(usize, usize)> {
    evenly(pairs.len(), number)
        .into_iter()
        .map(|index| pairs[index])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_claims_are_one() {
        let preparation = Preparation {
            shape: Shape {
                columns: 3,
                rows: 1,
            },
            binning: Binning::PaperGrey256,
            warm_above_c: 1.0,
        };
        let frame = |claim: f64| preparation.simulated(&[20.0, 21.0, 22.0], &[claim; 3], None);
        let side = FrameSet::new(vec![frame(1.0), frame(1.0), frame(2.0), frame(1.0)]);
        assert_eq!(side.claims, [0, 0, 2, 3]);
    }

    #[test]
    fn every_measure_knows_its_place() {
        for (index, measure) in Measure::ALL.iter().enumerate() {
            assert_eq!(measure.place(), index);
        }
    }
}
