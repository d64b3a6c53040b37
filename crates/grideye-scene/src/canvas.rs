//! Which surface is seen in each cell of the sampling grid, row by row: the nearest one.

use crate::perceived::{Air, Glow, LANES, Rays, Root, lanes};
use crate::resample::Resampler;
use crate::view::{Patch, View};
use std::ops::Range;
use wide::{CmpGe as _, CmpGt as _, f64x4};

/// Surfaces whose depths along a ray differ by less than this part are at one depth: less than a nanometre in a room,
/// and more than the rounding of the two.
const SAME_DEPTH: f64 = 1e-11;

/// A patch and what it is made of.
#[derive(Debug, Clone)]
pub(crate) struct Painted {
    pub(crate) patch: Patch,
    pub(crate) glow: Glow,
    pub(crate) root: Root,
    /// Whose it is, for those who ask whom a cell shows.
    pub(crate) owner: u32,
}

/// One row of cells, or a part of it.
struct Row<'a> {
    /// One over the depth of what is seen; 0 where nothing is.
    inverse_depth: &'a mut [f64],
    /// How much warmer than ambient it seems, °C.
    excess_c: &'a mut [f64],
    /// Whose surface it is.
    owner: Option<&'a mut [u32]>,
    sheet: &'a mut Sheet,
}

/// The cells of one patch in one row, before it is known which of them are seen; a few more at the end do not count.
#[derive(Debug, Default)]
struct Sheet {
    inverse_depth: Vec<f64>,
    excess_c: Vec<f64>,
}

impl Row<'_> {
    /// Puts the part of a patch that is before what there is into these cells of `row`, which it covers.
    ///
    /// Of two surfaces at one depth the warmer is seen, so that their order does not matter.
    fn paint(
        &mut self,
        view: &View,
        air: &Air,
        row: usize,
        cells: &Range<usize>,
        painted: &Painted,
    ) {
        let up = view.slope_up(row);
        let (left, left2) = view.slopes_left(cells.clone());
        let sheet = &mut *self.sheet;
        sheet.inverse_depth.resize(left.len(), 0.0);
        sheet.excess_c.resize(left.len(), 0.0);
        let rays = Rays {
            inverse_depth: painted.patch.inverse_depth(up),
            ray2: 1.0 + up * up,
            left,
            left2,
        };
        let places = (&mut sheet.inverse_depth, &mut sheet.excess_c);
        air.excesses(&painted.glow, &painted.root, &rays, places.0, places.1);
        let old = (
            &mut self.inverse_depth[cells.clone()],
            &mut self.excess_c[cells.clone()],
        );
        if let Some(owner) = &mut self.owner {
            sheet.give(&old, painted.owner, &mut owner[cells.clone()]);
        }
        sheet.put(old.0, old.1);
    }
}

impl Sheet {
    /// Puts the surface into the cells in which it is the one that is seen.
    fn put(&self, inverse_depth: &mut [f64], excess_c: &mut [f64]) {
        let mut depths = inverse_depth.chunks_exact_mut(LANES);
        let mut excesses = excess_c.chunks_exact_mut(LANES);
        let new_depths = self.inverse_depth.chunks_exact(LANES);
        let new_excesses = self.excess_c.chunks_exact(LANES);
        let margin = f64x4::splat(SAME_DEPTH);
        let mut whole = 0;
        for ((depth, excess), (new_depth, new_excess)) in (&mut depths)
            .zip(&mut excesses)
            .zip(new_depths.zip(new_excesses))
        {
            let (old_depth, old_excess) = (lanes(depth), lanes(excess));
            let (new_depth, new_excess) = (lanes(new_depth), lanes(new_excess));
            let margin = old_depth * margin;
            let nearer = new_depth.cmp_gt(old_depth + margin);
            let as_near = new_depth.cmp_ge(old_depth - margin);
            let wins = nearer | (as_near & new_excess.cmp_gt(old_excess));
            depth.copy_from_slice(wins.blend(new_depth, old_depth).as_array_ref());
            excess.copy_from_slice(wins.blend(new_excess, old_excess).as_array_ref());
            whole += LANES;
        }
        let rest = depths
            .into_remainder()
            .iter_mut()
            .zip(excesses.into_remainder());
        let new = self.inverse_depth[whole..]
            .iter()
            .zip(&self.excess_c[whole..]);
        for ((old_depth, old_excess), (new_depth, new_excess)) in rest.zip(new) {
            if is_seen((*new_depth, *new_excess), (*old_depth, *old_excess)) {
                (*old_depth, *old_excess) = (*new_depth, *new_excess);
            }
        }
    }

    /// Makes `owner` the owner of the cells in which the surface is seen.
    fn give(&self, old: &(&mut [f64], &mut [f64]), owner: u32, owners: &mut [u32]) {
        let new = self.inverse_depth.iter().zip(&self.excess_c);
        let old = old.0.iter().zip(&*old.1);
        for ((new, old), of_cell) in new.zip(old).zip(owners) {
            if is_seen((*new.0, *new.1), (*old.0, *old.1)) {
                *of_cell = owner;
            }
        }
    }
}

/// Whether a surface hides another on one ray: each as one over its depth, and how warm it seems.
#[inline]
fn is_seen(new: (f64, f64), old: (f64, f64)) -> bool {
    let margin = old.0 * SAME_DEPTH;
    let nearer = new.0 > old.0 + margin;
    let as_near = new.0 >= old.0 - margin;
    nearer | (as_near & (new.1 > old.1))
}

/// What stands still, seen in every cell.
#[derive(Debug, Clone)]
pub(crate) struct Backdrop {
    columns: usize,
    inverse_depth: Vec<f64>,
    excess_c: Vec<f64>,
}

impl Backdrop {
    pub(crate) fn new(view: &View, air: &Air, patches: &[Painted]) -> Self {
        let cells = view.columns() * view.rows();
        let mut backdrop = Self {
            columns: view.columns(),
            inverse_depth: vec![0.0; cells],
            excess_c: vec![0.0; cells],
        };
        let mut sheet = Sheet::default();
        for painted in patches {
            for row in painted.patch.rows() {
                let covered = painted.patch.columns(view.slope_up(row), view.columns());
                let cells = backdrop.cells(row, 0..view.columns());
                let mut canvas = Row {
                    inverse_depth: &mut backdrop.inverse_depth[cells.clone()],
                    excess_c: &mut backdrop.excess_c[cells],
                    owner: None,
                    sheet: &mut sheet,
                };
                canvas.paint(view, air, row, &covered, painted);
            }
        }
        backdrop
    }

    /// °C above ambient, cell by cell.
    pub(crate) fn excess_c(&self) -> &[f64] {
        &self.excess_c
    }

    fn cells(&self, row: usize, columns: Range<usize>) -> Range<usize> {
        let start = row * self.columns;
        start + columns.start..start + columns.end
    }
}

/// Where what moves is drawn before the backdrop, one row at a time, and added up for the pixels.
///
/// Resampling is separable: the rows' weights are applied here, cell by cell, so that each inner loop runs along a row
/// of cells; the columns' weights follow once for each row of pixels.
pub(crate) struct Bench<'a> {
    view: &'a View,
    air: &'a Air,
    backdrop: &'a Backdrop,
    resampler: &'a Resampler,
    inverse_depth: Vec<f64>,
    excess_c: Vec<f64>,
    owner: Vec<u32>,
    sheet: Sheet,
    covered: Vec<Range<usize>>,
    /// Of each row of pixels, the weighted sums of the cells' values, column by column.
    sums: Vec<f64>,
    /// The columns that any row has changed, and the rows of pixels that this reaches.
    changed: Range<usize>,
    changed_rows: Range<usize>,
}

/// The owner of what stands still.
pub(crate) const NOBODY: u32 = u32::MAX;

impl<'a> Bench<'a> {
    pub(crate) fn new(
        view: &'a View,
        air: &'a Air,
        backdrop: &'a Backdrop,
        resampler: &'a Resampler,
    ) -> Self {
        let columns = view.columns();
        Self {
            view,
            air,
            backdrop,
            resampler,
            inverse_depth: vec![0.0; columns],
            excess_c: vec![0.0; columns],
            owner: vec![NOBODY; columns],
            sheet: Sheet::default(),
            covered: Vec::new(),
            sums: vec![0.0; resampler.output_rows() * columns],
            changed: 0..0,
            changed_rows: 0..0,
        }
    }

    /// Adds to each pixel what the patches change in its cells, in degrees.
    pub(crate) fn add_excess(mut self, patches: &[Painted], pixels: &mut [f64]) {
        self.draw::<false>(patches, |cell| cell.excess_c - cell.backdrop_excess_c);
        self.add_to(pixels);
    }

    /// Adds to each pixel the share of its cells in which a patch is seen whose owner counts.
    pub(crate) fn add_share(
        mut self,
        patches: &[Painted],
        counts: impl Fn(u32) -> bool,
        pixels: &mut [f64],
    ) {
        self.draw::<true>(patches, |cell| f64::from(u8::from(counts(cell.owner))));
        self.add_to(pixels);
    }

    fn draw<const OWNED: bool>(&mut self, patches: &[Painted], value: impl Fn(Cell) -> f64) {
        let rows = patches.iter().map(|painted| painted.patch.rows());
        for row in rows.reduce(hull).unwrap_or(0..0) {
            let up = self.view.slope_up(row);
            self.covered.clear();
            self.covered.extend(patches.iter().map(|painted| {
                if painted.patch.rows().contains(&row) {
                    painted.patch.columns(up, self.view.columns())
                } else {
                    0..0
                }
            }));
            let changed = self.covered.iter().cloned().fold(0..0, hull);
            if changed.is_empty() {
                continue;
            }
            self.changed = hull(self.changed.clone(), changed.clone());
            self.paint_row::<OWNED>(row, patches, &changed);
            self.collect_row(row, changed, &value);
        }
    }

    fn paint_row<const OWNED: bool>(
        &mut self,
        row: usize,
        patches: &[Painted],
        changed: &Range<usize>,
    ) {
        let cells = self.backdrop.cells(row, changed.clone());
        self.inverse_depth[changed.clone()]
            .copy_from_slice(&self.backdrop.inverse_depth[cells.clone()]);
        self.excess_c[changed.clone()].copy_from_slice(&self.backdrop.excess_c[cells]);
        if OWNED {
            self.owner[changed.clone()].fill(NOBODY);
        }
        let mut canvas = Row {
            inverse_depth: &mut self.inverse_depth,
            excess_c: &mut self.excess_c,
            owner: OWNED.then_some(self.owner.as_mut_slice()),
            sheet: &mut self.sheet,
        };
        for (painted, covered) in patches.iter().zip(&self.covered) {
            if !covered.is_empty() {
                canvas.paint(self.view, self.air, row, covered, painted);
            }
        }
    }

    fn collect_row(&mut self, row: usize, changed: Range<usize>, value: &impl Fn(Cell) -> f64) {
        let columns = self.view.columns();
        let backdrop = &self.backdrop.excess_c[self.backdrop.cells(row, changed.clone())];
        let (pixel_rows, weights) = self.resampler.rows_of(row);
        self.changed_rows = hull(self.changed_rows.clone(), pixel_rows.clone());
        for (pixel_row, weight) in pixel_rows.zip(weights) {
            let sums = &mut self.sums[pixel_row * columns..][changed.clone()];
            let cells = self.excess_c[changed.clone()]
                .iter()
                .zip(backdrop)
                .zip(&self.owner[changed.clone()]);
            for (sum, ((excess_c, backdrop_excess_c), owner)) in sums.iter_mut().zip(cells) {
                *sum += weight
                    * value(Cell {
                        excess_c: *excess_c,
                        backdrop_excess_c: *backdrop_excess_c,
                        owner: *owner,
                    });
            }
        }
    }

    fn add_to(&self, pixels: &mut [f64]) {
        let columns = self.view.columns().max(1);
        let pixel_columns = self.resampler.output_columns().max(1);
        let rows = self
            .sums
            .chunks_exact(columns)
            .zip(pixels.chunks_exact_mut(pixel_columns));
        let changed_rows = self.changed_rows.clone();
        for (sums, pixels) in rows.skip(changed_rows.start).take(changed_rows.len()) {
            for column in self.changed.clone() {
                self.resampler.gather(column, sums[column], pixels);
            }
        }
    }
}

/// A cell after the patches were drawn.
struct Cell {
    excess_c: f64,
    backdrop_excess_c: f64,
    owner: u32,
}

/// The range that holds both; an empty one holds nothing.
fn hull(one: Range<usize>, other: Range<usize>) -> Range<usize> {
    if one.is_empty() {
        return other;
    }
    if other.is_empty() {
        return one;
    }
    one.start.min(other.start)..one.end.max(other.end)
}
