//! Frames made ready to be scored many times, and the sums over pairs of them.

use crate::compare::{Protocol, RealFrame, Settings, SimulatedFrame};
use crate::metrics::{
    self, Binning, IS_THRESHOLD, bins, count, entropy_of_bins, joint_entropy_of_bins, mutual_of,
};
use crate::score::Measure;
use crate::union::{Prediction, Union, Warmth, offset};
use std::collections::BTreeMap;

/// The values of one pair of frames.
pub(crate) type PairValues = [(Measure, Option<f64>); 13];

/// One frame with its bins and entropies worked out.
#[derive(Clone)]
pub(crate) struct Prepared {
    celsius: Vec<f64>,
    /// What warm pixels are read from: the noise-free claim of a simulated frame, the mean of the sequence for a real
    /// one under the static protocol, else the frame itself.
    steady: Vec<f64>,
    grey: Binned,
    step: Binned,
}

#[derive(Clone)]
struct Binned {
    bins: Vec<u32>,
    entropy: f64,
}

/// Means over pairs, of the pairs for which a measure is defined.
#[derive(Default)]
pub(crate) struct Means(BTreeMap<Measure, (f64, usize)>);

/// Both sides of a comparison, and the blank frame.
pub(crate) struct SceneView {
    pub(crate) real: Vec<Prepared>,
    pub(crate) simulated: Vec<Prepared>,
    pub(crate) blank: Prepared,
    step_c: f64,
    warmth: Warmth,
}

/// The real sequence against itself some frames later.
pub(crate) struct Repeat {
    later: Vec<(usize, Prepared)>,
    means: Means,
}

impl Prepared {
    pub(crate) fn new(celsius: &[f64], steady: &[f64], step_c: f64) -> Self {
        Self {
            celsius: celsius.to_vec(),
            steady: steady.to_vec(),
            grey: Binned::new(celsius, Binning::PaperGrey256),
            step: Binned::new(celsius, Binning::Step { width_c: step_c }),
        }
    }

    pub(crate) fn celsius(&self) -> &[f64] {
        &self.celsius
    }

    pub(crate) fn steady(&self) -> &[f64] {
        &self.steady
    }

    /// The same pixels in another order; entropies do not change by it.
    pub(crate) fn permuted(&self, order: &[usize]) -> Self {
        Self {
            celsius: pick(&self.celsius, order),
            steady: pick(&self.steady, order),
            grey: self.grey.permuted(order),
            step: self.step.permuted(order),
        }
    }

    /// Every measure that is a mean over pairs, with `self` as the real frame.
    pub(crate) fn pair_values(&self, simulated: &Self) -> PairValues {
        let (x, y) = (&self.celsius, &simulated.celsius);
        let grey = joint_entropy_of_bins(&self.grey.bins, &simulated.grey.bins);
        let step = joint_entropy_of_bins(&self.step.bins, &simulated.step.bins);
        [
            (Measure::Correlation, metrics::correlation(x, y)),
            (
                Measure::ImageSimilarity,
                metrics::image_similarity(x, y, IS_THRESHOLD),
            ),
            (Measure::Rmse, metrics::rmse(x, y)),
            (Measure::Mae, metrics::mae(x, y)),
            (Measure::Bias, metrics::bias(x, y)),
            (Measure::EntropyRealGrey, Some(self.grey.entropy)),
            (Measure::EntropySimulatedGrey, Some(simulated.grey.entropy)),
            (Measure::JointEntropyGrey, Some(grey)),
            (
                Measure::MutualInformationGrey,
                Some(mutual_of(self.grey.entropy, simulated.grey.entropy, grey)),
            ),
            (Measure::EntropyRealStep, Some(self.step.entropy)),
            (Measure::EntropySimulatedStep, Some(simulated.step.entropy)),
            (Measure::JointEntropyStep, Some(step)),
            (
                Measure::MutualInformationStep,
                Some(mutual_of(self.step.entropy, simulated.step.entropy, step)),
            ),
        ]
    }
}

impl Binned {
    fn new(celsius: &[f64], binning: Binning) -> Self {
        // Frames and width were checked before; were they not, one bin for all would claim no information.
        let bins = bins(celsius, binning).unwrap_or_else(|| vec![0; celsius.len()]);
        let entropy = entropy_of_bins(&bins);
        Self { bins, entropy }
    }

    fn permuted(&self, order: &[usize]) -> Self {
        Self {
            bins: order.iter().map(|&index| self.bins[index]).collect(),
            entropy: self.entropy,
        }
    }
}

impl Means {
    pub(crate) fn add(&mut self, values: &PairValues) {
        for &(measure, value) in values {
            if let Some(value) = value {
                let (sum, number) = self.0.entry(measure).or_default();
                *sum += value;
                *number += 1;
            }
        }
    }

    pub(crate) fn set(&mut self, measure: Measure, value: Option<f64>) {
        if let Some(value) = value {
            self.0.insert(measure, (value, 1));
        }
    }

    pub(crate) fn get(&self, measure: Measure) -> Option<f64> {
        self.0
            .get(&measure)
            .map(|&(sum, number)| sum / count(number))
    }
}

impl SceneView {
    pub(crate) fn new(
        real: &[RealFrame],
        simulated: &[SimulatedFrame],
        settings: &Settings,
        noise_sigma_c: f64,
    ) -> Self {
        let step_c = settings.step_c;
        let pixels = real.first().map_or(0, |frame| frame.celsius.len());
        let ambient = vec![settings.ambient_c; pixels];
        // What stands still is seen better in the mean of all frames than in any one of them.
        let (steady, averaged) = match settings.protocol {
            Protocol::Static => (Some(mean_frame(real)), real.len()),
            Protocol::Dynamic => (None, 1),
        };
        let real = real
            .iter()
            .map(|frame| {
                Prepared::new(
                    &frame.celsius,
                    steady.as_ref().unwrap_or(&frame.celsius),
                    step_c,
                )
            })
            .collect();
        let simulated = simulated
            .iter()
            .map(|frame| Prepared::new(&frame.celsius, &frame.noise_free, step_c))
            .collect();
        let above_c = settings.warm_above(noise_sigma_c / count(averaged.max(1)).sqrt());
        Self {
            real,
            simulated,
            blank: Prepared::new(&ambient, &ambient, step_c),
            step_c,
            warmth: Warmth::new(settings.ambient_c, above_c),
        }
    }

    pub(crate) fn pixels(&self) -> usize {
        self.blank.celsius.len()
    }

    /// From how far above ambient on a pixel of the real side belongs to the union.
    pub(crate) fn union_above_c(&self) -> f64 {
        self.warmth.real_above_c
    }

    /// The common offset of each pair.
    pub(crate) fn offsets(&self, pairs: &[(usize, usize)]) -> Vec<f64> {
        pairs
            .iter()
            .map(|&(r, s)| self.offset(r, &self.simulated[s]))
            .collect()
    }

    /// Sums the squares over the pixels that the scene claims to be warm or that are.
    pub(crate) fn union(&self, pairs: &[(usize, usize)], simulated: &[Prepared]) -> Union {
        let mut union = Union::default();
        for &(r, s) in pairs {
            let prediction = Prediction {
                celsius: &simulated[s].celsius,
                offset_c: 0.0,
            };
            let offset_c = self.offset(r, &simulated[s]);
            union.add(
                &self.real[r],
                offset_c,
                &simulated[s].steady,
                prediction,
                self.warmth,
            );
        }
        union
    }

    /// The same sums with the repeat of a real frame in the simulation's place, over the same pixels.
    fn union_of_repeat(&self, repeats: &[(usize, Prepared)]) -> Union {
        let mut union = Union::default();
        for (index, later) in repeats {
            let Some(beside) = self.simulated.get(*index).or(self.simulated.last()) else {
                continue;
            };
            let real = &self.real[*index];
            let offset_c = self.offset(*index, beside);
            let prediction = Prediction {
                celsius: &later.celsius,
                offset_c: offset_c + offset(&later.celsius, &real.celsius),
            };
            union.add(real, offset_c, &beside.steady, prediction, self.warmth);
        }
        union
    }

    fn offset(&self, real: usize, simulated: &Prepared) -> f64 {
        offset(&self.real[real].celsius, &simulated.steady)
    }

    /// What the blank frame scores. Its gain over itself is 0 by definition.
    pub(crate) fn blank_means(&self) -> Means {
        let mut means = Means::default();
        for real in &self.real {
            means.add(&real.pair_values(&self.blank));
        }
        means.set(Measure::Gain, Some(0.0));
        means.set(Measure::GainWithOffset, Some(0.0));
        means
    }
}

impl Repeat {
    /// `None` when no frame has a repeat.
    pub(crate) fn new(view: &SceneView, real: &[RealFrame], sigma_c: Option<f64>) -> Option<Self> {
        let sigma_c = sigma_c?;
        let later: Vec<(usize, Prepared)> = real
            .iter()
            .enumerate()
            .filter_map(|(index, frame)| {
                let later = frame.later.as_deref()?;
                Some((index, Prepared::new(later, later, view.step_c)))
            })
            .collect();
        let mut means = Means::default();
        for (index, later) in &later {
            means.add(&view.real[*index].pair_values(later));
        }
        for (measure, gain) in view.union_of_repeat(&later).without_noise(sigma_c).gains() {
            means.set(measure, gain);
        }
        count_noise_once(&mut means, sigma_c);
        Some(Self { later, means })
    }

    pub(crate) fn ceiling(&self, measure: Measure) -> Option<f64> {
        self.means.get(measure)
    }

    pub(crate) fn pairs<'a>(
        &'a self,
        view: &'a SceneView,
    ) -> impl Iterator<Item = (&'a [f64], &'a [f64])> {
        self.later
            .iter()
            .map(|(index, later)| (view.real[*index].celsius(), later.celsius()))
    }
}

/// The repeat holds the noise twice, a prediction without noise would meet it once only.
///
/// C: Spearman's correction for attenuation, the root of the correlation of two equally noisy measurements. RMSE: the
/// variance of the noise is subtracted; MAE shrinks in the same proportion, as it does for Gaussian differences.
fn count_noise_once(means: &mut Means, sigma_c: f64) {
    if let Some(correlation) = means
        .get(Measure::Correlation)
        .filter(|&correlation| correlation > 0.0)
    {
        means.set(Measure::Correlation, Some(correlation.sqrt()));
    }
    let (rmse, mae) = (means.get(Measure::Rmse), means.get(Measure::Mae));
    if let Some(rmse) = rmse.filter(|&rmse| rmse > 0.0) {
        let once = (rmse * rmse - sigma_c * sigma_c).max(0.0).sqrt();
        means.set(Measure::Rmse, Some(once));
        means.set(Measure::Mae, mae.map(|mae| mae * once / rmse));
    }
}

/// The thresholds of the evaluation graph: 0 to 5 degrees in steps of a twentieth.
pub(crate) fn grid() -> Vec<f64> {
    (0..=100_u32).map(|step| f64::from(step) / 20.0).collect()
}

/// Mean image similarity of many pairs at each of several ascending thresholds, in one pass over the pixels.
pub(crate) fn shares_below<'a>(
    thresholds: &[f64],
    pairs: impl Iterator<Item = (&'a [f64], &'a [f64])>,
) -> Vec<f64> {
    let mut first_above = vec![0_usize; thresholds.len() + 1];
    let mut pixels = 0;
    for (real, simulated) in pairs {
        pixels += real.len();
        for (x, y) in real.iter().zip(simulated) {
            let difference = (y - x).abs();
            first_above[thresholds.partition_point(|&threshold| threshold <= difference)] += 1;
        }
    }
    let mut below = 0;
    thresholds
        .iter()
        .zip(first_above)
        .map(|(_, here)| {
            below += here;
            count(below) / count(pixels.max(1))
        })
        .collect()
}

/// The median; the mean of the middle two of an even number. `None` of nothing.
pub(crate) fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let upper = *sorted.get(sorted.len() / 2)?;
    let lower = *sorted.get((sorted.len() - 1) / 2)?;
    Some(f64::midpoint(lower, upper))
}

fn mean_frame(real: &[RealFrame]) -> Vec<f64> {
    let pixels = real.first().map_or(0, |frame| frame.celsius.len());
    let mean = |pixel: usize| {
        real.iter().map(|frame| frame.celsius[pixel]).sum::<f64>() / count(real.len())
    };
    (0..pixels).map(mean).collect()
}

fn pick(values: &[f64], order: &[usize]) -> Vec<f64> {
    order.iter().map(|&index| values[index]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_those_of_the_metric() {
        let real = [20.0, 20.0, 20.0, 20.0, 21.5];
        let simulated = [20.0, 20.05, 20.5, 17.0, 40.0];
        let graph = shares_below(&grid(), std::iter::once((&real[..], &simulated[..])));
        assert_eq!(
            Some(graph),
            metrics::evaluation_graph(&real, &simulated, &grid())
        );
    }

    #[test]
    fn median_of_few() {
        assert_eq!(median(&[]), None);
        assert_eq!(median(&[3.0]), Some(3.0));
        assert_eq!(median(&[4.0, 1.0, 3.0, 2.0]), Some(2.5));
        assert_eq!(median(&[9.0, 1.0, 2.0]), Some(2.0));
    }
}
