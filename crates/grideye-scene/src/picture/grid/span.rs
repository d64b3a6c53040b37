//! One patch in one row of cells: its depth and temperature there, and what of it remains visible.

use super::shaded::ShadedPatch;
use crate::picture::projection::{LANES_MAX, SamplingGrid};
use crate::radiometry::{Air, Shade, WithShade};
use pulp::Simd;
use std::ops::Range;

/// Relative difference below which depths are equal: under a nanometer in a room, and above their rounding.
const SAME_DEPTH: f64 = 1e-11;

/// A patch in the cells of one row. All slices have one length; cells beyond the patch's last one are meaningless.
struct SpanShader<'a, S: Simd, O> {
    /// The plane's inverse depth at zero slope to the left, and its change per unit of slope.
    at_axis: (f64, f64),
    /// Squared distance to depth 1 at zero slope to the left.
    ray2: f64,
    /// Slopes to the left, and their squares.
    left: &'a [S::f64s],
    left2: &'a [S::f64s],
    outcome: O,
}

pub(super) trait Outcome<S: Simd> {
    /// Cuts its slices to this length, so that the compiler can omit bounds checks.
    fn fit(self, length: usize) -> Self;

    fn keep(&mut self, simd: S, at: usize, new: Seen<S>);
}

/// Inverse depth and excess temperature in several cells.
type Seen<S> = (<S as Simd>::f64s, <S as Simd>::f64s);

/// The cells before a patch is drawn: inverse depths (0 for nothing) and excesses over ambient, °C.
pub(super) struct Existing<'a, S: Simd> {
    depth: &'a [S::f64s],
    pub(super) excess: &'a [S::f64s],
}

impl<'a, S: Simd> Existing<'a, S> {
    #[inline(always)]
    pub(super) fn new(depth: &'a [f64], excess: &'a [f64]) -> Self {
        Self {
            depth: S::as_simd_f64s(depth).0,
            excess: S::as_simd_f64s(excess).0,
        }
    }

    #[inline(always)]
    fn fit(self, length: usize) -> Self {
        Self {
            depth: &self.depth[..length],
            excess: &self.excess[..length],
        }
    }
}

/// Two pixel rows that a row of cells changes: their sums by column, and the row's weight in each.
pub(super) struct Sums<'a, S: Simd> {
    pub(super) rows: [&'a mut [S::f64s]; 2],
    pub(super) weights: [f64; 2],
}

impl<S: Simd> Sums<'_, S> {
    #[inline(always)]
    fn fit(self, length: usize) -> Self {
        let [first, second] = self.rows;
        Self {
            rows: [&mut first[..length], &mut second[..length]],
            weights: self.weights,
        }
    }

    #[inline(always)]
    pub(super) fn add(&mut self, simd: S, at: usize, change: S::f64s) {
        for (sums, weight) in self.rows.iter_mut().zip(self.weights) {
            let weighted = simd.mul_f64s(simd.splat_f64s(weight), change);
            sums[at] = simd.add_f64s(sums[at], weighted);
        }
    }
}

/// Each cell's change by a patch with nothing behind it, in degrees.
pub(super) struct OverNothing<'a, S: Simd> {
    pub(super) sums: Sums<'a, S>,
}

/// Each cell's change by a patch nearer than everything there, in degrees.
pub(super) struct InFront<'a, S: Simd> {
    pub(super) sums: Sums<'a, S>,
    pub(super) excess: &'a [S::f64s],
}

/// Each cell's change by a patch tested for depth, in degrees or counts.
pub(super) struct DepthTested<'a, S: Simd> {
    pub(super) sums: Sums<'a, S>,
    pub(super) existing: Existing<'a, S>,
    pub(super) counts: Option<f64>,
}

/// Cell counts before and after a patch is drawn, and the patch's own count.
type Counts<'a, S> = (&'a [<S as Simd>::f64s], &'a mut [<S as Simd>::f64s], f64);

/// The cells after a patch is drawn.
pub(super) struct Overwrite<'a, S: Simd> {
    pub(super) existing: Existing<'a, S>,
    pub(super) depth: &'a mut [S::f64s],
    pub(super) excess: &'a mut [S::f64s],
    pub(super) counts: Option<Counts<'a, S>>,
}

impl<S: Simd> Outcome<S> for OverNothing<'_, S> {
    #[inline(always)]
    fn fit(self, length: usize) -> Self {
        Self {
            sums: self.sums.fit(length),
        }
    }

    #[inline(always)]
    fn keep(&mut self, simd: S, at: usize, new: Seen<S>) {
        self.sums.add(simd, at, new.1);
    }
}

impl<S: Simd> Outcome<S> for InFront<'_, S> {
    #[inline(always)]
    fn fit(self, length: usize) -> Self {
        Self {
            sums: self.sums.fit(length),
            excess: &self.excess[..length],
        }
    }

    #[inline(always)]
    fn keep(&mut self, simd: S, at: usize, new: Seen<S>) {
        let change = simd.sub_f64s(new.1, self.excess[at]);
        self.sums.add(simd, at, change);
    }
}

impl<S: Simd> Outcome<S> for DepthTested<'_, S> {
    #[inline(always)]
    fn fit(self, length: usize) -> Self {
        Self {
            sums: self.sums.fit(length),
            existing: self.existing.fit(length),
            counts: self.counts,
        }
    }

    #[inline(always)]
    fn keep(&mut self, simd: S, at: usize, new: Seen<S>) {
        let old = (self.existing.depth[at], self.existing.excess[at]);
        let change = match self.counts {
            Some(counts) => simd.splat_f64s(counts),
            None => simd.sub_f64s(new.1, old.1),
        };
        let is_changed = wins(simd, new, old);
        let change = simd.select_f64s_m64s(is_changed, change, simd.splat_f64s(0.0));
        self.sums.add(simd, at, change);
    }
}

impl<S: Simd> Outcome<S> for Overwrite<'_, S> {
    #[inline(always)]
    fn fit(self, length: usize) -> Self {
        Self {
            existing: self.existing.fit(length),
            depth: &mut self.depth[..length],
            excess: &mut self.excess[..length],
            counts: match self.counts {
                Some((before, after, patch)) => {
                    Some((&before[..length], &mut after[..length], patch))
                }
                None => None,
            },
        }
    }

    #[inline(always)]
    fn keep(&mut self, simd: S, at: usize, new: Seen<S>) {
        let old = (self.existing.depth[at], self.existing.excess[at]);
        let wins = wins(simd, new, old);
        self.depth[at] = simd.select_f64s_m64s(wins, new.0, old.0);
        self.excess[at] = simd.select_f64s_m64s(wins, new.1, old.1);
        if let Some((before, after, patch)) = &mut self.counts {
            after[at] = simd.select_f64s_m64s(wins, simd.splat_f64s(*patch), before[at]);
        }
    }
}

// No closures in here: the compiler would not build them for the processor's own vectors.
impl<S: Simd, O: Outcome<S>> WithShade<S> for SpanShader<'_, S, O> {
    #[inline(always)]
    fn with(self, simd: S, shade: impl Shade) {
        let length = self.left.len();
        let (left, left2) = (self.left, &self.left2[..length]);
        let mut outcome = self.outcome.fit(length);
        let start = simd.splat_f64s(self.at_axis.0);
        let by_slope = simd.splat_f64s(self.at_axis.1);
        let ray2 = simd.splat_f64s(self.ray2);
        for at in 0..length {
            let new_depth = simd.add_f64s(start, simd.mul_f64s(by_slope, left[at]));
            let rays2 = simd.add_f64s(ray2, left2[at]);
            let excess = shade.excesses_c(simd, new_depth, rays2);
            outcome.keep(simd, at, (new_depth, excess));
        }
    }
}

/// Where a surface hides another; at the same depth the warmer is seen, in either order.
#[inline(always)]
fn wins<S: Simd>(simd: S, new: Seen<S>, old: Seen<S>) -> S::m64s {
    let margin = simd.mul_f64s(old.0, simd.splat_f64s(SAME_DEPTH));
    let nearer = simd.greater_than_f64s(new.0, simd.add_f64s(old.0, margin));
    let as_near = simd.greater_than_or_equal_f64s(new.0, simd.sub_f64s(old.0, margin));
    let warmer = simd.greater_than_f64s(new.1, old.1);
    simd.or_m64s(nearer, simd.and_m64s(as_near, warmer))
}

#[derive(Debug, Clone)]
pub(super) struct CellSpan<'a> {
    pub(super) shaded: &'a ShadedPatch,
    pub(super) covered: Range<usize>,
    pub(super) counts: Option<f64>,
}

#[derive(Clone, Copy)]
pub(super) struct CellRow<'a> {
    pub(super) view: &'a SamplingGrid,
    pub(super) air: &'a Air,
    pub(super) row: usize,
}

impl CellRow<'_> {
    /// Draws some cells of a patch, and a few more to fill the last vector.
    #[inline(always)]
    pub(super) fn draw<S: Simd>(
        &self,
        simd: S,
        shaded: &ShadedPatch,
        covered: Range<usize>,
        outcome: impl Outcome<S>,
    ) {
        let up = self.view.slope_up(self.row);
        let cells = covered.len().next_multiple_of(S::F64_LANES);
        let (left, left2) = self.view.slopes_left(covered.start..covered.start + cells);
        let shader = SpanShader {
            at_axis: shaded.patch.inverse_depth(up),
            ray2: 1.0 + up * up,
            left: S::as_simd_f64s(left).0,
            left2: S::as_simd_f64s(left2).0,
            outcome,
        };
        self.air.shade(simd, &shaded.glow, &shaded.root, shader);
    }
}

impl CellRow<'_> {
    /// Whether a patch hides everything up to the inverse depth `nearest` in these columns.
    #[inline(always)]
    pub(super) fn is_before(
        &self,
        shaded: &ShadedPatch,
        columns: &Range<usize>,
        nearest: f64,
    ) -> bool {
        let (start, by_slope) = shaded.patch.inverse_depth(self.view.slope_up(self.row));
        // Along a row the inverse depth is monotonic. Twice the margin exceeds its rounding.
        let (left, _) = self.view.slopes_left(columns.clone());
        let least = nearest + 2.0 * SAME_DEPTH * nearest;
        let is_nearer = |slope: f64| start + by_slope * slope > least;
        is_nearer(left[0]) && is_nearer(left[left.len() - 1])
    }
}

/// The values beyond `count`, as a copy of fixed length, which is fastest.
#[inline(always)]
pub(super) fn tail(values: &[f64], count: usize) -> [f64; LANES_MAX] {
    let mut beyond = [0.0; LANES_MAX];
    beyond.copy_from_slice(&values[count..count + LANES_MAX]);
    beyond
}

#[inline(always)]
pub(super) fn put_back(values: &mut [f64], count: usize, beyond: &[f64; LANES_MAX]) {
    values[count..count + LANES_MAX].copy_from_slice(beyond);
}

/// Buffers for drawing overlapping patches of one row.
#[derive(Debug)]
pub(super) struct RowBuffers {
    /// The visible depth and excess, and the counts.
    pub(super) depth: Vec<f64>,
    pub(super) excess: Vec<f64>,
    pub(super) counts: Vec<f64>,
    /// The same for the span just drawn, kept apart because scattered writes are many times slower.
    pub(super) new_depth: Vec<f64>,
    pub(super) new_excess: Vec<f64>,
    pub(super) new_counts: Vec<f64>,
}

impl RowBuffers {
    pub(super) fn new(columns: usize) -> Self {
        let row = || vec![0.0; columns + LANES_MAX];
        Self {
            depth: row(),
            excess: row(),
            counts: row(),
            new_depth: row(),
            new_excess: row(),
            new_counts: row(),
        }
    }

    #[inline(always)]
    pub(super) fn draw<S: Simd>(&mut self, simd: S, line: CellRow<'_>, span: &CellSpan<'_>) {
        let (start, cells) = (span.covered.start, span.covered.len());
        let picture = Overwrite {
            existing: Existing::new(&self.depth[start..], &self.excess[start..]),
            depth: S::as_mut_simd_f64s(&mut self.new_depth).0,
            excess: S::as_mut_simd_f64s(&mut self.new_excess).0,
            counts: match span.counts {
                Some(counts) => Some((
                    S::as_simd_f64s(&self.counts[start..]).0,
                    S::as_mut_simd_f64s(&mut self.new_counts).0,
                    counts,
                )),
                None => None,
            },
        };
        line.draw(simd, span.shaded, span.covered.clone(), picture);
        self.depth[span.covered.clone()].copy_from_slice(&self.new_depth[..cells]);
        self.excess[span.covered.clone()].copy_from_slice(&self.new_excess[..cells]);
        if span.counts.is_some() {
            self.counts[span.covered.clone()].copy_from_slice(&self.new_counts[..cells]);
        }
    }
}
