//! Entropies and mutual information, by counting bins.

use crate::numbers::{all_finite, count, extremes};

/// Mutual information, bits: `H(X) + H(Y) - H(X, Y)` (PeerJ CS 11:e3124, Eq. 6); almost all bias on 64 pixels. Rounding must
/// not make it negative.
pub(crate) fn mutual([real, simulated, joint]: [f64; 3]) -> f64 {
    (real + simulated - joint).max(0.0)
}

/// 256 gray levels over the frame's own range, like an 8-bit image: the paper names no bins, these fit its entropies.
const TOP_LEVEL: f64 = 255.0;

/// The bin of each pixel, numbered from 0 without gaps.
#[derive(Debug, Clone)]
pub(crate) struct Binned {
    bins: Vec<usize>,
    distinct: usize,
    /// Shannon entropy of the frame, bits (PeerJ CS 11:e3124, Eq. 2).
    pub(crate) entropy: f64,
}

impl Binned {
    pub(crate) fn new(frame: &[f64]) -> Option<Self> {
        if frame.is_empty() || !all_finite(frame) {
            return None;
        }
        let (bins, counts) = numbered(&over_range(frame));
        let counter = Counter::new(frame.len());
        Some(Self {
            bins,
            distinct: counts.len(),
            entropy: counts.iter().map(|&count| counter.terms[count]).sum(),
        })
    }

    pub(crate) fn permuted(&self, order: &[usize]) -> Self {
        Self {
            bins: order.iter().map(|&pixel| self.bins[pixel]).collect(),
            ..*self
        }
    }
}

fn over_range(frame: &[f64]) -> Vec<f64> {
    let (coldest, warmest) = extremes(frame);
    let range = warmest - coldest;
    if range > 0.0 && range.is_finite() {
        let level = |value: &f64| (TOP_LEVEL * (value - coldest) / range).round();
        return frame.iter().map(level).collect();
    }
    vec![0.0; frame.len()]
}

/// The number of each pixel's level, in order of temperature, and how many pixels have each.
fn numbered(levels: &[f64]) -> (Vec<usize>, Vec<usize>) {
    let mut order: Vec<usize> = (0..levels.len()).collect();
    order.sort_unstable_by(|&a, &b| levels[a].total_cmp(&levels[b]));
    let (mut numbers, mut counts) = (vec![0; levels.len()], Vec::new());
    // By value, so that -0 and 0 share a bin.
    for run in order.chunk_by(|&a, &b| levels[a] == levels[b]) {
        run.iter().for_each(|&pixel| numbers[pixel] = counts.len());
        counts.push(run.len());
    }
    (numbers, counts)
}

/// Counts pairs of bins, reusing its table.
pub(crate) struct Counter {
    /// `-p log2 p` of each count of pixels.
    terms: Vec<f64>,
    cells: Vec<usize>,
}

impl Counter {
    /// For frames of so many pixels.
    pub(crate) fn new(pixels: usize) -> Self {
        let term = |number: usize| {
            let share = count(number) / count(pixels.max(1));
            // No pixels have no term, and all of them 0 and not minus 0.
            if number == 0 {
                0.0
            } else {
                0.0 - share * share.log2()
            }
        };
        Self {
            terms: (0..=pixels).map(term).collect(),
            cells: Vec::new(),
        }
    }

    /// Joint entropy of two frames, bits (PeerJ CS 11:e3124, Eq. 3); each frame has bins of its own.
    pub(crate) fn joint(&mut self, real: &Binned, simulated: &Binned) -> f64 {
        let size = real.distinct * simulated.distinct;
        if self.cells.len() < size {
            self.cells.resize(size, 0);
        }
        let pairs = || real.bins.iter().zip(&simulated.bins);
        let cell = |(x, y): (&usize, &usize)| x * simulated.distinct + y;
        for pair in pairs() {
            self.cells[cell(pair)] += 1;
        }
        // The first pixel of each cell takes the whole count, which leaves the table empty.
        pairs()
            .map(|pair| self.terms[std::mem::take(&mut self.cells[cell(pair)])])
            .sum()
    }
}
