//! Sums of all measures over pairs of frames, on one thread or several.

use crate::compare::prepared::{ComparedFrames, FrameSet, Means, Tally, thinned};
use crate::frames::RealFrame;
use crate::metrics::gain::GainSums;
use crate::metrics::pair::Graph;
use crate::metrics::score::Measure;

#[derive(Clone, Default)]
pub(crate) struct Sums {
    pub(crate) means: Means,
    pub(crate) gain: GainSums,
    pub(crate) graph: Graph,
    pub(crate) offsets: Vec<f64>,
    pub(crate) pairs: usize,
}

/// Pairs per chunk. Chunks are added in order, so the number of threads does not change the result.
const PAIRS_AT_ONCE: usize = 4_096;

/// All measures over pairs of a real frame and one of `side`; those of places over at most `placed_max` pairs.
pub(crate) fn sums(
    view: &ComparedFrames,
    pairs: &[(usize, usize)],
    side: &FrameSet,
    (placed_max, threads): (usize, usize),
) -> Sums {
    let goes: Vec<&[(usize, usize)]> = pairs.chunks(PAIRS_AT_ONCE).collect();
    let mut sums = Sums::default();
    for part in in_threads(&goes, threads, |pairs| Sums::of(view, pairs, side)) {
        sums.merge(part);
    }
    for (measure, gain) in sums.gain.gains() {
        sums.means.set(measure, gain);
    }
    for (real, put) in thinned(pairs, placed_max) {
        let (real, put) = (real, &side.frames[put]);
        let beside = view.simulated.beside(real).unwrap_or(put);
        sums.means.add(&view.placed(&view.real[real], put, beside));
    }
    sums
}

impl Sums {
    fn of(view: &ComparedFrames, pairs: &[(usize, usize)], side: &FrameSet) -> Self {
        let mut tally = Tally::new();
        let mut sums = Self {
            pairs: pairs.len(),
            offsets: view.offsets(pairs, side).collect(),
            ..Self::default()
        };
        for &(real, put) in pairs {
            let scores = tally.plain(&view.real[real], &side.frames[put]);
            sums.means.add(&scores);
        }
        view.add_to_gain(&mut sums.gain, pairs, &sums.offsets, side);
        sums.graph = tally.graph;
        sums
    }

    fn merge(&mut self, part: Self) {
        self.means.merge(&part.means);
        self.gain.merge(part.gain);
        self.graph.merge(&part.graph);
        self.offsets.extend(part.offsets);
        self.pairs += part.pairs;
    }

    /// The repeat of each real frame in place of the simulation, where there is one.
    pub(crate) fn of_repeat(view: &ComparedFrames, real: &[RealFrame], sigma_c: f64) -> Self {
        let (mut means, mut gain, mut tally) =
            (Means::default(), GainSums::default(), Tally::new());
        for (index, frame) in real.iter().enumerate() {
            let Some(later) = frame.later.as_deref() else {
                continue;
            };
            let (now, later) = (&view.real[index], view.preparation.real(later, later));
            means.add(&tally.plain(now, &later));
            let beside = view.simulated.beside(index).unwrap_or(&later);
            let placed = view.placed(now, &later, beside);
            means.add(&placed.map(|(measure, value)| match measure {
                Measure::ContrastSlope => (measure, view.slope_over_repeat(now, &later)),
                _ => (measure, value),
            }));
            view.add_repeat_to_gain(&mut gain, index, &later);
        }
        for (measure, gain) in gain.without_noise(sigma_c).gains() {
            means.set(measure, gain);
        }
        count_noise_once(&mut means, sigma_c);
        Self {
            means,
            graph: tally.graph,
            ..Self::default()
        }
    }
}

pub(crate) fn in_threads<T: Sync, R: Send>(
    items: &[T],
    threads: usize,
    count: impl Fn(&T) -> R + Sync,
) -> Vec<R> {
    let threads = threads.clamp(1, items.len().max(1));
    if threads == 1 {
        return items.iter().map(count).collect();
    }
    let each = items.len().div_ceil(threads);
    let count_all = |items: &[T]| -> Vec<R> { items.iter().map(&count).collect() };
    std::thread::scope(|scope| {
        let running: Vec<_> = items
            .chunks(each)
            .map(|share| (share, scope.spawn(move || count_all(share))))
            .collect();
        running
            .into_iter()
            // If a thread panicked, its share is counted here.
            .flat_map(|(share, thread)| thread.join().unwrap_or_else(|_| count_all(share)))
            .collect()
    })
}

/// Corrects for the repeat's noise, which a noise-free prediction would not have.
///
/// C: Spearman's correction for attenuation. RMSE and foreground RMSE: less the noise variance; MAE in proportion to
/// RMSE, as for Gaussian differences. Chi squared: halved. Centroid error: divided by √2.
fn count_noise_once(means: &mut Means, sigma_c: f64) {
    let correlation = means.get(Measure::Correlation).filter(|&c| c > 0.0);
    means.set(Measure::Correlation, correlation.map(f64::sqrt));
    let once = |rmse: f64| (rmse * rmse - sigma_c * sigma_c).max(0.0).sqrt();
    if let Some(rmse) = means.get(Measure::Rmse).filter(|&rmse| rmse > 0.0) {
        let mae = means.get(Measure::Mae);
        means.set(Measure::Mae, mae.map(|mae| mae * once(rmse) / rmse));
        means.set(Measure::Rmse, Some(once(rmse)));
    }
    let foreground = means.get(Measure::ForegroundRmse);
    means.set(Measure::ForegroundRmse, foreground.map(once));
    let chi = means.get(Measure::ChiSquaredPerDegree);
    means.set(Measure::ChiSquaredPerDegree, chi.map(|chi| chi / 2.0));
    for measure in [Measure::CentroidErrorPixels, Measure::CentroidErrorDegrees] {
        let error = means.get(measure);
        means.set(measure, error.map(|error| error / std::f64::consts::SQRT_2));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_of_the_repeat_is_counted_once() {
        let measures = [
            (Measure::Correlation, 0.64, 0.8),
            (Measure::Rmse, 0.5, 0.4),
            (Measure::Mae, 0.4, 0.32),
            (Measure::ForegroundRmse, 0.5, 0.4),
            (Measure::ChiSquaredPerDegree, 2.0, 1.0),
            (Measure::CentroidErrorPixels, 2.0_f64.sqrt(), 1.0),
            (Measure::ImageSimilarity, 0.9, 0.9),
        ];
        let mut means = Means::default();
        for (measure, twice, _) in measures {
            means.set(measure, Some(twice));
        }
        count_noise_once(&mut means, 0.3);
        for (measure, _, once) in measures {
            let found = means.get(measure).unwrap();
            assert!((found - once).abs() < 1e-12, "{measure}: {found}");
        }
    }
}
