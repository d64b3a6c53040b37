//! Frames made ready to be scored many times, and the sums over pairs of them.

use crate::compare::{RealFrame, Settings, SimulatedFrame};
use crate::metrics::{
    self, Binning, IS_THRESHOLD, bins, count, entropy_of_bins, joint_entropy_of_bins, mutual_of,
};
use crate::score::Measure;
use crate::verdict::WarmPixels;
use std::collections::BTreeMap;

/// The values of one pair of frames.
pub(crate) type PairValues = [(Measure, Option<f64>); 13];

/// One frame with its bins and entropies worked out.
#[derive(Clone)]
pub(crate) struct Prepared {
    celsius: Vec<f64>,
    noise_free: Vec<f64>,
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
pub(crate) struct SceneView<'a> {
    pub(crate) real: Vec<Prepared>,
    pub(crate) simulated: Vec<Prepared>,
    pub(crate) blank: Prepared,
    settings: &'a Settings,
    warm_above_c: f64,
}

/// Sums over the pixels that are warm in either image of a pair.
#[derive(Default)]
pub(crate) struct Union {
    pixels: usize,
    both: usize,
    simulated: usize,
    square_simulated: f64,
    square_blank: f64,
    square_simulated_with_offset: f64,
    square_blank_with_offset: f64,
}

/// The real sequence against itself some frames later.
pub(crate) struct Repeat {
    later: Vec<(usize, Prepared)>,
    means: Means,
}

impl Prepared {
    fn new(celsius: &[f64], noise_free: &[f64], step_c: f64) -> Self {
        Self {
            celsius: celsius.to_vec(),
            noise_free: noise_free.to_vec(),
            grey: Binned::new(celsius, Binning::PaperGrey256),
            step: Binned::new(celsius, Binning::Step { width_c: step_c }),
        }
    }

    pub(crate) fn celsius(&self) -> &[f64] {
        &self.celsius
    }

    /// The same pixels in another order; entropies do not change by it.
    pub(crate) fn permuted(&self, order: &[usize]) -> Self {
        Self {
            celsius: pick(&self.celsius, order),
            noise_free: pick(&self.noise_free, order),
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

impl<'a> SceneView<'a> {
    pub(crate) fn new(
        real: &[RealFrame],
        simulated: &[SimulatedFrame],
        settings: &'a Settings,
        warm_above_c: f64,
    ) -> Self {
        let step_c = settings.step_c;
        let pixels = real.first().map_or(0, |frame| frame.celsius.len());
        let ambient = vec![settings.ambient_c; pixels];
        Self {
            real: real
                .iter()
                .map(|frame| Prepared::new(&frame.celsius, &frame.celsius, step_c))
                .collect(),
            simulated: simulated
                .iter()
                .map(|frame| Prepared::new(&frame.celsius, &frame.noise_free, step_c))
                .collect(),
            blank: Prepared::new(&ambient, &ambient, step_c),
            settings,
            warm_above_c,
        }
    }

    pub(crate) fn pixels(&self) -> usize {
        self.blank.celsius.len()
    }

    /// The common offset of each pair.
    pub(crate) fn offsets(&self, pairs: &[(usize, usize)]) -> Vec<f64> {
        pairs
            .iter()
            .map(|&(r, s)| offset(&self.real[r], &self.simulated[s]))
            .collect()
    }

    pub(crate) fn warm_pixels(&self, pairs: &[(usize, usize)]) -> WarmPixels {
        let union = self.union(pairs, &self.simulated);
        WarmPixels {
            real: self.warm_of_itself(),
            simulated: count(union.simulated) / count(pairs.len().max(1)),
            overlap: (union.pixels > 0).then(|| count(union.both) / count(union.pixels)),
        }
    }

    /// Warm pixels of a real frame above its own median: whether a recording is empty must not depend on what the
    /// scene claims.
    fn warm_of_itself(&self) -> f64 {
        let warm = |frame: &Prepared| {
            let background = median(&frame.celsius).unwrap_or(0.0);
            frame
                .celsius
                .iter()
                .filter(|&&value| value - background > self.warm_above_c)
                .count()
        };
        count(self.real.iter().map(warm).sum()) / count(self.real.len().max(1))
    }

    /// Sums the squares over the pixels that the scene claims to be warm or that are.
    pub(crate) fn union(&self, pairs: &[(usize, usize)], simulated: &[Prepared]) -> Union {
        let mut union = Union::default();
        for &(r, s) in pairs {
            let (real, simulated) = (&self.real[r], &simulated[s]);
            union.add(
                real,
                simulated,
                offset(real, simulated),
                self.settings.ambient_c,
                self.warm_above_c,
            );
        }
        union
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

impl Union {
    /// `offset_c` is taken from the real frame before it is asked which of its pixels are warm: a unit that reads
    /// a degree too high does not see a degree more person.
    fn add(
        &mut self,
        real: &Prepared,
        simulated: &Prepared,
        offset_c: f64,
        ambient_c: f64,
        warm_above_c: f64,
    ) {
        let pixels = real
            .celsius
            .iter()
            .zip(&simulated.celsius)
            .zip(&simulated.noise_free);
        for ((&real, &simulated), &claim) in pixels {
            let levelled = real - offset_c;
            let really_warm = levelled - ambient_c > warm_above_c;
            let claimed_warm = claim - ambient_c > warm_above_c;
            self.simulated += usize::from(claimed_warm);
            self.both += usize::from(really_warm && claimed_warm);
            if really_warm || claimed_warm {
                self.pixels += 1;
                self.square_simulated += (levelled - simulated).powi(2);
                self.square_blank += (levelled - ambient_c).powi(2);
                self.square_simulated_with_offset += (real - simulated).powi(2);
                self.square_blank_with_offset += (real - ambient_c).powi(2);
            }
        }
    }

    /// The sums with the noise of one side taken out of the simulated part.
    fn without_noise(mut self, sigma_c: f64) -> Self {
        let noise = count(self.pixels) * sigma_c * sigma_c;
        self.square_simulated = (self.square_simulated - noise).max(0.0);
        self.square_simulated_with_offset = (self.square_simulated_with_offset - noise).max(0.0);
        self
    }
}

/// The gains over the blank frame; not defined where nothing is warm.
pub(crate) fn gains(union: &Union) -> [(Measure, Option<f64>); 2] {
    let gain = |simulated: f64, blank: f64| (blank > 0.0).then(|| 1.0 - (simulated / blank).sqrt());
    [
        (
            Measure::Gain,
            gain(union.square_simulated, union.square_blank),
        ),
        (
            Measure::GainWithOffset,
            gain(
                union.square_simulated_with_offset,
                union.square_blank_with_offset,
            ),
        ),
    ]
}

impl Repeat {
    /// `None` when no frame has a repeat.
    pub(crate) fn new(
        view: &SceneView<'_>,
        real: &[RealFrame],
        sigma_c: Option<f64>,
    ) -> Option<Self> {
        let sigma_c = sigma_c?;
        let later: Vec<(usize, Prepared)> = real
            .iter()
            .enumerate()
            .filter_map(|(index, frame)| {
                let later = frame.later.as_deref()?;
                Some((index, Prepared::new(later, later, view.settings.step_c)))
            })
            .collect();
        let mut means = Means::default();
        let mut union = Union::default();
        for (index, later) in &later {
            means.add(&view.real[*index].pair_values(later));
            union.add_repeat(view, *index, later);
        }
        for (measure, gain) in gains(&union.without_noise(sigma_c)) {
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
        view: &'a SceneView<'_>,
    ) -> impl Iterator<Item = (&'a [f64], &'a [f64])> {
        self.later
            .iter()
            .map(|(index, later)| (view.real[*index].celsius(), later.celsius()))
    }
}

impl Union {
    /// The repeat stands where the simulation stands, brought to the scene's level like the frame itself.
    fn add_repeat(&mut self, view: &SceneView<'_>, index: usize, later: &Prepared) {
        let real = &view.real[index];
        let beside = index.min(view.simulated.len().saturating_sub(1));
        let Some(simulated) = view.simulated.get(beside) else {
            return;
        };
        let offset_c = offset(real, simulated);
        let drift_c = offset(later, real);
        let levelled: Vec<f64> = later
            .celsius
            .iter()
            .map(|value| value - offset_c - drift_c)
            .collect();
        let levelled = Prepared {
            noise_free: levelled.clone(),
            celsius: levelled,
            ..later.clone()
        };
        self.add(
            real,
            &levelled,
            offset_c,
            view.settings.ambient_c,
            view.warm_above_c,
        );
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

/// How much warmer the real frame is all over: the median of the differences, which a warm body in either image does
/// not move as long as it covers less than half of the view.
fn offset(real: &Prepared, simulated: &Prepared) -> f64 {
    let differences: Vec<f64> = real
        .celsius
        .iter()
        .zip(&simulated.noise_free)
        .map(|(real, claim)| real - claim)
        .collect();
    median(&differences).unwrap_or(0.0)
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

    /// By hand: ambient 20, warm above 1, no common offset. Pixel 0 is warm in both (real 24, simulated 23), pixel 1
    /// in the claim only (20, 22), pixel 2 in reality only (22, 20). Squares simulated 1 + 4 + 4, blank 16 + 0 + 4.
    #[test]
    fn gain_is_taken_over_the_union_of_claimed_and_really_warm() {
        let real = [24.0, 20.0, 22.0, 20.0, 20.0, 20.0, 20.0];
        let claim = [23.0, 22.0, 20.0, 20.0, 20.0, 20.0, 20.0];
        let (real, claim) = (
            Prepared::new(&real, &real, 0.25),
            Prepared::new(&claim, &claim, 0.25),
        );
        let mut union = Union::default();
        union.add(&real, &claim, offset(&real, &claim), 20.0, 1.0);
        assert_eq!((union.pixels, union.both, union.simulated), (3, 1, 2));
        let [(_, gain), _] = gains(&union);
        assert!((gain.unwrap() - (1.0 - (9.0_f64 / 20.0).sqrt())).abs() < 1e-12);
    }

    #[test]
    fn an_offset_is_taken_out_of_the_gain_and_left_in_beside_it() {
        let claim = [23.0, 20.0, 20.0, 20.0, 20.0];
        let real = claim.map(|value| value + 2.0);
        let (real, claim) = (
            Prepared::new(&real, &real, 0.25),
            Prepared::new(&claim, &claim, 0.25),
        );
        let mut union = Union::default();
        union.add(&real, &claim, offset(&real, &claim), 20.0, 1.0);
        let [(_, gain), (_, with_offset)] = gains(&union);
        assert_eq!(gain, Some(1.0));
        assert!((with_offset.unwrap() - (1.0 - 2.0 / 5.0)).abs() < 1e-12);
    }
}
