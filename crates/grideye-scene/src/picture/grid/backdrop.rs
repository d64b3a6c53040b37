//! The still bodies, drawn once, and the occupied columns of each row.

use super::shaded::{ShadedPatch, dispatch, hull};
use super::span::{CellRow, Existing, Overwrite, RowBuffers};
use crate::picture::projection::{LANES_MAX, SamplingGrid};
use crate::picture::resample::Resampler;
use crate::radiometry::Air;
use pulp::{Simd, WithSimd};
use std::ops::Range;

#[derive(Debug, Clone)]
pub(crate) struct Backdrop {
    /// Cells from one row to the next; 0 if one row stands for all.
    stride: usize,
    pub(super) inverse_depth: Vec<f64>,
    pub(super) excess_c: Vec<f64>,
    /// The runs of all rows, and the number of runs before each row and in total.
    runs: Vec<Run>,
    runs_before: Vec<usize>,
}

/// Occupied cells of one row, including gaps shorter than [`LANES_MAX`].
#[derive(Debug, Clone)]
pub(super) struct Run {
    pub(super) columns: Range<usize>,
    pub(super) nearest: f64,
}

#[derive(Debug, Clone, Copy)]
pub(super) enum Background {
    Nothing,
    /// Something with inverse depths up to this one.
    Something(f64),
}

impl Backdrop {
    pub(crate) fn new(view: &SamplingGrid, air: &Air, patches: &[ShadedPatch]) -> Self {
        let cells = view.columns() * view.rows();
        let mut backdrop = Self {
            stride: view.columns(),
            inverse_depth: vec![0.0; cells + LANES_MAX],
            excess_c: vec![0.0; cells + LANES_MAX],
            runs: Vec::new(),
            runs_before: vec![0; view.rows() + 1],
        };
        dispatch(DrawBackdrop {
            backdrop: &mut backdrop,
            view,
            air,
            patches,
        });
        backdrop.find_runs();
        backdrop
    }

    pub(crate) fn empty(view: &SamplingGrid) -> Self {
        let row = || vec![0.0; view.columns() + LANES_MAX];
        Self {
            stride: 0,
            inverse_depth: row(),
            excess_c: row(),
            runs: Vec::new(),
            runs_before: vec![0; view.rows() + 1],
        }
    }

    pub(crate) fn pixels_c(&self, resampler: &Resampler) -> Vec<f64> {
        let rows = 0..self.runs_before.len() - 1;
        let covered = rows.map(|row| {
            let runs = self.runs(row).iter();
            runs.fold(0..0, |all, run| hull(all, run.columns.clone()))
        });
        resampler.apply_covered(&self.excess_c, &covered.collect::<Vec<_>>())
    }

    fn find_runs(&mut self) {
        for row in 0..self.runs_before.len() - 1 {
            let first = self.runs.len();
            let cells = &self.inverse_depth[self.cells(row, 0..self.stride)];
            for (column, inverse_depth) in cells.iter().copied().enumerate() {
                if inverse_depth == 0.0 {
                    continue;
                }
                match self.runs[first..].last_mut() {
                    Some(run) if column < run.columns.end + LANES_MAX => {
                        run.columns.end = column + 1;
                        run.nearest = run.nearest.max(inverse_depth);
                    }
                    _ => self.runs.push(Run {
                        columns: column..column + 1,
                        nearest: inverse_depth,
                    }),
                }
            }
            self.runs_before[row + 1] = self.runs.len();
        }
    }

    #[inline(always)]
    pub(super) fn runs(&self, row: usize) -> &[Run] {
        &self.runs[self.runs_before[row]..self.runs_before[row + 1]]
    }

    #[inline(always)]
    pub(super) fn from<S: Simd>(&self, cell: usize) -> Existing<'_, S> {
        Existing::new(&self.inverse_depth[cell..], &self.excess_c[cell..])
    }

    #[inline(always)]
    pub(super) fn cells(&self, row: usize, columns: Range<usize>) -> Range<usize> {
        let start = row * self.stride;
        start + columns.start..start + columns.end
    }
}

struct DrawBackdrop<'a> {
    backdrop: &'a mut Backdrop,
    view: &'a SamplingGrid,
    air: &'a Air,
    patches: &'a [ShadedPatch],
}

impl WithSimd for DrawBackdrop<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (view, backdrop) = (self.view, self.backdrop);
        let mut buffers = RowBuffers::new(backdrop.stride);
        for shaded in self.patches {
            for row in shaded.patch.rows() {
                let covered = shaded.patch.columns(view.slope_up(row), view.columns());
                if covered.is_empty() {
                    continue;
                }
                let line = CellRow {
                    view,
                    air: self.air,
                    row,
                };
                let cells = backdrop.cells(row, covered.clone());
                let picture = Overwrite {
                    existing: backdrop.from(cells.start),
                    depth: S::as_mut_simd_f64s(&mut buffers.new_depth).0,
                    excess: S::as_mut_simd_f64s(&mut buffers.new_excess).0,
                    counts: None,
                };
                line.draw(simd, shaded, covered, picture);
                let (depth, excess) = (&buffers.new_depth, &buffers.new_excess);
                let count = cells.len();
                backdrop.inverse_depth[cells.clone()].copy_from_slice(&depth[..count]);
                backdrop.excess_c[cells].copy_from_slice(&excess[..count]);
            }
        }
    }
}
