//! Which surface is seen in each cell of the sampling grid, row by row: the nearest one.

use crate::perceived::{Air, Glow, Root, Shade, WithShade};
use crate::resample::Resampler;
use crate::view::{Patch, View};
use pulp::{Arch, Scalar256b, Simd, WithSimd};
use std::ops::Range;

/// Surfaces whose depths along a ray differ by less than this part are at one depth: less than a nanometre in a room,
/// and more than the rounding of the two.
const SAME_DEPTH: f64 = 1e-11;

/// The most cells that any processor paints at once; rows are longer by so many.
pub(crate) const LANES_MAX: usize = 8;

/// A patch and what it is made of.
#[derive(Debug, Clone)]
pub(crate) struct Painted {
    pub(crate) patch: Patch,
    pub(crate) glow: Glow,
    pub(crate) root: Root,
    /// Whose it is, for those who ask whom a cell shows.
    pub(crate) owner: u32,
}

/// Runs a task with the widest vectors that this processor has. The bits are the same with any.
fn dispatch<T: WithSimd>(task: T) -> T::Output {
    match Arch::new() {
        // Four at once in plain code, of which compilers make what every processor of the kind has.
        Arch::Scalar => task.with_simd(Scalar256b),
        arch => arch.dispatch(task),
    }
}

/// A patch in the cells of one row. All slices have one length; what comes of the cells beyond the patch's last means
/// nothing.
struct Stroke<'a, S: Simd, O> {
    /// One over the plane's depth on the ray without slope to the left, and what each unit of slope adds.
    at_axis: (f64, f64),
    /// Square of the distance to depth 1 on the ray without slope to the left.
    ray2: f64,
    /// Slopes to the left, and their squares.
    left: &'a [S::f64s],
    left2: &'a [S::f64s],
    outcome: O,
}

/// What is kept of a stroke.
trait Outcome<S: Simd> {
    /// The same with slices of this length, so that the compiler need not look at each place whether it is there.
    fn fit(self, length: usize) -> Self;

    fn keep(&mut self, simd: S, at: usize, new: Seen<S>);
}

/// One over the depth of what is seen in several cells, and how warm it seems.
type Seen<S> = (<S as Simd>::f64s, <S as Simd>::f64s);

/// What is there before a patch is drawn: one over the depths, 0 where nothing is, and how much warmer than ambient it
/// seems, °C.
struct Behind<'a, S: Simd> {
    depth: &'a [S::f64s],
    excess: &'a [S::f64s],
}

impl<'a, S: Simd> Behind<'a, S> {
    #[inline(always)]
    fn new(depth: &'a [f64], excess: &'a [f64]) -> Self {
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

/// Two rows of pixels to which a change in one row of cells is given: their sums, column by column, and what the row of
/// cells weighs in each.
struct Sums<'a, S: Simd> {
    rows: [&'a mut [S::f64s]; 2],
    weights: [f64; 2],
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
    fn add(&mut self, simd: S, at: usize, change: S::f64s) {
        for (sums, weight) in self.rows.iter_mut().zip(self.weights) {
            let weighted = simd.mul_f64s(simd.splat_f64s(weight), change);
            sums[at] = simd.add_f64s(sums[at], weighted);
        }
    }
}

/// By how much a patch before nothing changes each cell, in degrees.
struct Alone<'a, S: Simd> {
    sums: Sums<'a, S>,
}

/// By how much a patch that is nearer than all that is there changes each cell, in degrees.
struct Before<'a, S: Simd> {
    sums: Sums<'a, S>,
    excess: &'a [S::f64s],
}

/// By how much the patch changes each cell, in degrees or by what it counts.
struct Change<'a, S: Simd> {
    sums: Sums<'a, S>,
    behind: Behind<'a, S>,
    counts: Option<f64>,
}

/// What cells count before a patch is drawn and after, and what the patch does.
type Counts<'a, S> = (&'a [<S as Simd>::f64s], &'a mut [<S as Simd>::f64s], f64);

/// What is seen after the patch was drawn.
struct Picture<'a, S: Simd> {
    behind: Behind<'a, S>,
    depth: &'a mut [S::f64s],
    excess: &'a mut [S::f64s],
    counts: Option<Counts<'a, S>>,
}

impl<S: Simd> Outcome<S> for Alone<'_, S> {
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

impl<S: Simd> Outcome<S> for Before<'_, S> {
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

impl<S: Simd> Outcome<S> for Change<'_, S> {
    #[inline(always)]
    fn fit(self, length: usize) -> Self {
        Self {
            sums: self.sums.fit(length),
            behind: self.behind.fit(length),
            counts: self.counts,
        }
    }

    #[inline(always)]
    fn keep(&mut self, simd: S, at: usize, new: Seen<S>) {
        let old = (self.behind.depth[at], self.behind.excess[at]);
        let change = match self.counts {
            Some(counts) => simd.splat_f64s(counts),
            None => simd.sub_f64s(new.1, old.1),
        };
        let is_changed = wins(simd, new, old);
        let change = simd.select_f64s_m64s(is_changed, change, simd.splat_f64s(0.0));
        self.sums.add(simd, at, change);
    }
}

impl<S: Simd> Outcome<S> for Picture<'_, S> {
    #[inline(always)]
    fn fit(self, length: usize) -> Self {
        Self {
            behind: self.behind.fit(length),
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
        let old = (self.behind.depth[at], self.behind.excess[at]);
        let wins = wins(simd, new, old);
        self.depth[at] = simd.select_f64s_m64s(wins, new.0, old.0);
        self.excess[at] = simd.select_f64s_m64s(wins, new.1, old.1);
        if let Some((before, after, patch)) = &mut self.counts {
            after[at] = simd.select_f64s_m64s(wins, simd.splat_f64s(*patch), before[at]);
        }
    }
}

// No closures in here: the compiler would keep them out of the code for the processor's own vectors.
impl<S: Simd, O: Outcome<S>> WithShade<S> for Stroke<'_, S, O> {
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

/// Where a surface hides another.
///
/// Of two surfaces at one depth the warmer is seen, so that their order does not matter.
#[inline(always)]
fn wins<S: Simd>(simd: S, new: Seen<S>, old: Seen<S>) -> S::m64s {
    let margin = simd.mul_f64s(old.0, simd.splat_f64s(SAME_DEPTH));
    let nearer = simd.greater_than_f64s(new.0, simd.add_f64s(old.0, margin));
    let as_near = simd.greater_than_or_equal_f64s(new.0, simd.sub_f64s(old.0, margin));
    let warmer = simd.greater_than_f64s(new.1, old.1);
    simd.or_m64s(nearer, simd.and_m64s(as_near, warmer))
}

/// A patch in one row.
#[derive(Debug, Clone)]
struct Strip<'a> {
    painted: &'a Painted,
    /// The columns that it covers.
    covered: Range<usize>,
    /// What it counts, if that is asked for.
    counts: Option<f64>,
}

/// The row in which strips are drawn.
#[derive(Clone, Copy)]
struct Line<'a> {
    view: &'a View,
    air: &'a Air,
    row: usize,
}

impl Line<'_> {
    /// Draws some cells of a patch, and a few more to fill the last vector.
    #[inline(always)]
    fn draw<S: Simd>(
        &self,
        simd: S,
        painted: &Painted,
        covered: Range<usize>,
        outcome: impl Outcome<S>,
    ) {
        let up = self.view.slope_up(self.row);
        let cells = covered.len().next_multiple_of(S::F64_LANES);
        let (left, left2) = self.view.slopes_left(covered.start..covered.start + cells);
        let stroke = Stroke {
            at_axis: painted.patch.inverse_depth(up),
            ray2: 1.0 + up * up,
            left: S::as_simd_f64s(left).0,
            left2: S::as_simd_f64s(left2).0,
            outcome,
        };
        self.air.shade(simd, &painted.glow, &painted.root, stroke);
    }
}

impl Line<'_> {
    /// Whether a patch hides all that is not nearer than this one over a depth, in these columns.
    #[inline(always)]
    fn is_before(&self, painted: &Painted, columns: &Range<usize>, nearest: f64) -> bool {
        let (start, by_slope) = painted.patch.inverse_depth(self.view.slope_up(self.row));
        // Along a row, one over the depth rises or falls all the way. Twice the margin is more than its rounding.
        let (left, _) = self.view.slopes_left(columns.clone());
        let least = nearest + 2.0 * SAME_DEPTH * nearest;
        let is_nearer = |slope: f64| start + by_slope * slope > least;
        is_nearer(left[0]) && is_nearer(left[left.len() - 1])
    }
}

/// What stands beyond so many values: always as much, whatever of it is in the last vector, since copies of a fixed
/// length are the fastest.
#[inline(always)]
fn tail(values: &[f64], count: usize) -> [f64; LANES_MAX] {
    let mut beyond = [0.0; LANES_MAX];
    beyond.copy_from_slice(&values[count..count + LANES_MAX]);
    beyond
}

#[inline(always)]
fn put_back(values: &mut [f64], count: usize, beyond: &[f64; LANES_MAX]) {
    values[count..count + LANES_MAX].copy_from_slice(beyond);
}

/// Where several patches of one row are drawn before one another.
#[derive(Debug)]
struct Easel {
    /// What is seen, and what it counts.
    depth: Vec<f64>,
    excess: Vec<f64>,
    counts: Vec<f64>,
    /// The same where a strip has just been drawn. Two places, so that it is written whole: to write here and there
    /// takes many times as long on some processors.
    new_depth: Vec<f64>,
    new_excess: Vec<f64>,
    new_counts: Vec<f64>,
}

impl Easel {
    fn new(columns: usize) -> Self {
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
    fn draw<S: Simd>(&mut self, simd: S, line: Line<'_>, strip: &Strip<'_>) {
        let (start, cells) = (strip.covered.start, strip.covered.len());
        let picture = Picture {
            behind: Behind::new(&self.depth[start..], &self.excess[start..]),
            depth: S::as_mut_simd_f64s(&mut self.new_depth).0,
            excess: S::as_mut_simd_f64s(&mut self.new_excess).0,
            counts: match strip.counts {
                Some(counts) => Some((
                    S::as_simd_f64s(&self.counts[start..]).0,
                    S::as_mut_simd_f64s(&mut self.new_counts).0,
                    counts,
                )),
                None => None,
            },
        };
        line.draw(simd, strip.painted, strip.covered.clone(), picture);
        self.depth[strip.covered.clone()].copy_from_slice(&self.new_depth[..cells]);
        self.excess[strip.covered.clone()].copy_from_slice(&self.new_excess[..cells]);
        if strip.counts.is_some() {
            self.counts[strip.covered.clone()].copy_from_slice(&self.new_counts[..cells]);
        }
    }
}

/// What stands still, seen in every cell.
#[derive(Debug, Clone)]
pub(crate) struct Backdrop {
    /// Cells from one row to the next: none where one row of them stands for all.
    stride: usize,
    inverse_depth: Vec<f64>,
    excess_c: Vec<f64>,
    /// Where each row shows anything, row after row, and how many of these come before each row and in all.
    runs: Vec<Run>,
    runs_before: Vec<usize>,
}

/// Cells of one row that show something, but for gaps of fewer than [`LANES_MAX`].
#[derive(Debug, Clone)]
struct Run {
    columns: Range<usize>,
    /// One over the depth of the nearest.
    nearest: f64,
}

/// What is behind some cells of a row.
#[derive(Debug, Clone, Copy)]
enum Back {
    Nothing,
    /// Something of which nothing is nearer than this one over a depth.
    Something(f64),
}

impl Backdrop {
    pub(crate) fn new(view: &View, air: &Air, patches: &[Painted]) -> Self {
        let cells = view.columns() * view.rows();
        let mut backdrop = Self {
            stride: view.columns(),
            inverse_depth: vec![0.0; cells + LANES_MAX],
            excess_c: vec![0.0; cells + LANES_MAX],
            runs: Vec::new(),
            runs_before: vec![0; view.rows() + 1],
        };
        dispatch(PaintBackdrop {
            backdrop: &mut backdrop,
            view,
            air,
            patches,
        });
        backdrop.find_runs();
        backdrop
    }

    /// Nothing but the room, in the memory of one row.
    pub(crate) fn empty(view: &View) -> Self {
        let row = || vec![0.0; view.columns() + LANES_MAX];
        Self {
            stride: 0,
            inverse_depth: row(),
            excess_c: row(),
            runs: Vec::new(),
            runs_before: vec![0; view.rows() + 1],
        }
    }

    /// °C above ambient of the pixels.
    pub(crate) fn pixels_c(&self, resampler: &Resampler) -> Vec<f64> {
        let rows = 0..self.runs_before.len() - 1;
        let covered = rows.map(|row| {
            let runs = self.runs(row).iter();
            runs.fold(0..0, |all, run| hull(all, run.columns.clone()))
        });
        resampler.apply_covered(&self.excess_c, &covered.collect::<Vec<_>>())
    }

    /// Looks where each row shows anything.
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

    /// The runs of a row, from the left.
    #[inline(always)]
    fn runs(&self, row: usize) -> &[Run] {
        &self.runs[self.runs_before[row]..self.runs_before[row + 1]]
    }

    /// What is there from a cell on.
    #[inline(always)]
    fn from<S: Simd>(&self, cell: usize) -> Behind<'_, S> {
        Behind::new(&self.inverse_depth[cell..], &self.excess_c[cell..])
    }

    #[inline(always)]
    fn cells(&self, row: usize, columns: Range<usize>) -> Range<usize> {
        let start = row * self.stride;
        start + columns.start..start + columns.end
    }
}

struct PaintBackdrop<'a> {
    backdrop: &'a mut Backdrop,
    view: &'a View,
    air: &'a Air,
    patches: &'a [Painted],
}

impl WithSimd for PaintBackdrop<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (view, backdrop) = (self.view, self.backdrop);
        let mut easel = Easel::new(backdrop.stride);
        for painted in self.patches {
            for row in painted.patch.rows() {
                let covered = painted.patch.columns(view.slope_up(row), view.columns());
                if covered.is_empty() {
                    continue;
                }
                let line = Line {
                    view,
                    air: self.air,
                    row,
                };
                let cells = backdrop.cells(row, covered.clone());
                let picture = Picture {
                    behind: backdrop.from(cells.start),
                    depth: S::as_mut_simd_f64s(&mut easel.new_depth).0,
                    excess: S::as_mut_simd_f64s(&mut easel.new_excess).0,
                    counts: None,
                };
                line.draw(simd, painted, covered, picture);
                let (depth, excess) = (&easel.new_depth, &easel.new_excess);
                let count = cells.len();
                backdrop.inverse_depth[cells.clone()].copy_from_slice(&depth[..count]);
                backdrop.excess_c[cells].copy_from_slice(&excess[..count]);
            }
        }
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
    easel: Easel,
    /// By how much the row at hand changes, column by column.
    values: Vec<f64>,
    /// A row of sums that nobody reads.
    spare: Vec<f64>,
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
            easel: Easel::new(columns),
            values: vec![0.0; columns + LANES_MAX],
            spare: vec![0.0; columns + LANES_MAX],
            sums: vec![0.0; resampler.output_rows() * (columns + LANES_MAX)],
            changed: 0..0,
            changed_rows: 0..0,
        }
    }

    /// Adds to each pixel what the patches change in its cells, in degrees.
    pub(crate) fn add_excess(mut self, patches: &[Painted], pixels: &mut [f64]) {
        dispatch(Draw {
            bench: &mut self,
            patches,
            counts: None,
        });
        self.add_to(pixels);
    }

    /// Adds to each pixel the share of its cells in which a patch is seen whose owner counts.
    pub(crate) fn add_share(
        mut self,
        patches: &[Painted],
        counts: impl Fn(u32) -> bool,
        pixels: &mut [f64],
    ) {
        let counts: Vec<f64> = patches
            .iter()
            .map(|painted| f64::from(u8::from(counts(painted.owner))))
            .collect();
        dispatch(Draw {
            bench: &mut self,
            patches,
            counts: Some(&counts),
        });
        self.add_to(pixels);
    }

    /// Gives the sums to the pixels, column by column, so that no row waits for its last addition.
    fn add_to(&self, pixels: &mut [f64]) {
        let stride = self.view.columns() + LANES_MAX;
        let pixel_columns = self.resampler.output_columns();
        for column in self.changed.clone() {
            let (reached, weights) = self.resampler.columns_of(column);
            for row in self.changed_rows.clone() {
                let sum = self.sums[row * stride + column];
                let pixels = &mut pixels[row * pixel_columns..][reached.clone()];
                for (pixel, weight) in pixels.iter_mut().zip(weights) {
                    *pixel += weight * sum;
                }
            }
        }
    }
}

/// Draws all rows that the patches cover.
struct Draw<'b, 'a> {
    bench: &'b mut Bench<'a>,
    patches: &'b [Painted],
    /// Which of them count, if that is what is asked for.
    counts: Option<&'b [f64]>,
}

impl WithSimd for Draw<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut upcoming: Vec<usize> = (0..self.patches.len()).collect();
        upcoming.sort_by_key(|index| std::cmp::Reverse(self.patches[*index].patch.rows().start));
        let (mut current, mut strips) = (Vec::new(), Vec::new());
        let rows = self.patches.iter().map(|painted| painted.patch.rows());
        for row in rows.reduce(hull).unwrap_or(0..0) {
            while let Some(index) = upcoming.pop() {
                if self.patches[index].patch.rows().start > row {
                    upcoming.push(index);
                    break;
                }
                current.push(index);
            }
            current.retain(|index| self.patches[*index].patch.rows().end > row);
            self.cut(row, &current, &mut strips);
            let mut rest = &strips[..];
            while !rest.is_empty() {
                let (group, after) = rest.split_at(overlapping(rest));
                self.bench.draw(simd, row, group);
                rest = after;
            }
        }
    }
}

impl<'b> Draw<'b, '_> {
    /// The strips of these patches in a row, from the left.
    #[inline(always)]
    fn cut(&self, row: usize, current: &[usize], strips: &mut Vec<Strip<'b>>) {
        let (up, columns) = (self.bench.view.slope_up(row), self.bench.view.columns());
        strips.clear();
        for index in current {
            let painted = &self.patches[*index];
            let covered = painted.patch.columns(up, columns);
            if covered.is_empty() {
                continue;
            }
            strips.push(Strip {
                painted,
                covered,
                counts: self.counts.map(|counts| counts[*index]),
            });
            let mut place = strips.len() - 1;
            while place > 0 && strips[place - 1].covered.start > strips[place].covered.start {
                strips.swap(place - 1, place);
                place -= 1;
            }
        }
    }
}

/// How many of the strips, at the start of a row of them, lie over one another: 1 if the first is alone.
#[inline(always)]
fn overlapping(strips: &[Strip<'_>]) -> usize {
    let (mut count, mut end) = (0, usize::MAX);
    for strip in strips {
        if count > 0 && strip.covered.start >= end {
            break;
        }
        end = if count == 0 {
            strip.covered.end
        } else {
            end.max(strip.covered.end)
        };
        count += 1;
    }
    count
}

impl Bench<'_> {
    /// Draws strips that lie over one another, or one.
    #[inline(always)]
    fn draw<S: Simd>(&mut self, simd: S, row: usize, strips: &[Strip<'_>]) {
        let line = Line {
            view: self.view,
            air: self.air,
            row,
        };
        let (pixel_rows, weights) = self.resampler.rows_of(row);
        self.changed_rows = hull(self.changed_rows.clone(), pixel_rows.clone());
        if let ([strip], [_] | [_, _]) = (strips, weights) {
            self.changed = hull(self.changed.clone(), strip.covered.clone());
            self.draw_one(simd, line, strip);
        } else {
            let mut changed = 0..0;
            for strip in strips {
                changed = hull(changed, strip.covered.clone());
            }
            self.changed = hull(self.changed.clone(), changed.clone());
            self.draw_over_one_another(simd, line, strips, &changed);
            self.collect(row, changed);
        }
    }

    /// Draws a strip and gives what it changes to the rows of pixels, run by run of what is behind it.
    #[inline(always)]
    fn draw_one<S: Simd>(&mut self, simd: S, line: Line<'_>, strip: &Strip<'_>) {
        let (mut start, end) = (strip.covered.start, strip.covered.end);
        let backdrop = self.backdrop;
        for run in backdrop.runs(line.row) {
            if run.columns.end <= start {
                continue;
            }
            if run.columns.start >= end {
                break;
            }
            if run.columns.start > start {
                self.draw_part(simd, line, strip, start..run.columns.start, Back::Nothing);
                start = run.columns.start;
            }
            let part = start..run.columns.end.min(end);
            start = part.end;
            self.draw_part(simd, line, strip, part, Back::Something(run.nearest));
        }
        if start < end {
            self.draw_part(simd, line, strip, start..end, Back::Nothing);
        }
    }

    /// Draws a part of a strip. The sums beyond it are put back: to ask in each cell whether it belongs to the part
    /// would take longer.
    #[inline(always)]
    fn draw_part<S: Simd>(
        &mut self,
        simd: S,
        line: Line<'_>,
        strip: &Strip<'_>,
        part: Range<usize>,
        back: Back,
    ) {
        let cells = part.len().next_multiple_of(S::F64_LANES);
        let (pixel_rows, weights) = self.resampler.rows_of(line.row);
        let stride = self.view.columns() + LANES_MAX;
        let (first, rest) = self.sums[pixel_rows.start * stride..].split_at_mut(stride);
        let (second, weight) = match weights.get(1) {
            Some(weight) => (rest, *weight),
            None => (&mut self.spare[..], 0.0),
        };
        let (first, second) = (&mut first[part.start..], &mut second[part.start..]);
        let beyond = [tail(first, part.len()), tail(second, part.len())];
        let sums = Sums {
            rows: [
                S::as_mut_simd_f64s(&mut first[..cells]).0,
                S::as_mut_simd_f64s(&mut second[..cells]).0,
            ],
            weights: [weights[0], weight],
        };
        let cell = self.backdrop.cells(line.row, part.clone()).start;
        let (painted, covered) = (strip.painted, part.clone());
        let behind = self.backdrop.from::<S>(cell);
        match (back, strip.counts) {
            (Back::Nothing, None) => line.draw(simd, painted, covered, Alone { sums }),
            (Back::Something(nearest), None) if line.is_before(painted, &part, nearest) => {
                let excess = behind.excess;
                line.draw(simd, painted, covered, Before { sums, excess });
            }
            (_, counts) => {
                let change = Change {
                    sums,
                    behind,
                    counts,
                };
                line.draw(simd, painted, covered, change);
            }
        }
        put_back(first, part.len(), &beyond[0]);
        put_back(second, part.len(), &beyond[1]);
    }

    #[inline(always)]
    fn draw_over_one_another<S: Simd>(
        &mut self,
        simd: S,
        line: Line<'_>,
        strips: &[Strip<'_>],
        changed: &Range<usize>,
    ) {
        let cells = self.backdrop.cells(line.row, changed.clone());
        let count = cells.len();
        let before = &self.backdrop.excess_c[cells.clone()];
        let easel = &mut self.easel;
        easel.depth[changed.clone()].copy_from_slice(&self.backdrop.inverse_depth[cells]);
        easel.excess[changed.clone()].copy_from_slice(before);
        easel.counts[changed.clone()].fill(0.0);
        let mut is_counted = false;
        for strip in strips {
            is_counted |= strip.counts.is_some();
            easel.draw(simd, line, strip);
        }
        if is_counted {
            self.values[..count].copy_from_slice(&easel.counts[changed.clone()]);
            return;
        }
        let after = easel.excess[changed.clone()].iter().zip(before);
        for (value, (after, before)) in self.values[..count].iter_mut().zip(after) {
            *value = after - before;
        }
    }

    /// Gives what has changed in some cells of a row to the rows of pixels.
    #[inline(always)]
    fn collect(&mut self, row: usize, changed: Range<usize>) {
        let stride = self.view.columns() + LANES_MAX;
        let (pixel_rows, weights) = self.resampler.rows_of(row);
        for (pixel_row, weight) in pixel_rows.zip(weights) {
            let sums = &mut self.sums[pixel_row * stride..][changed.clone()];
            for (sum, value) in sums.iter_mut().zip(&self.values) {
                *sum += weight * value;
            }
        }
    }
}

/// The range that holds both; an empty one holds nothing.
#[inline(always)]
fn hull(one: Range<usize>, other: Range<usize>) -> Range<usize> {
    if one.is_empty() {
        return other;
    }
    if other.is_empty() {
        return one;
    }
    one.start.min(other.start)..one.end.max(other.end)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::perceived::Law;
    use crate::scene::{Body, Scene};
    use crate::view::Sight;
    use glam::DVec3;
    use std::io;

    const SCENE: &str = r#"
        room = { size_mm = [4000, 6000, 2700], ambient_c = 20 }
        object = [
            { name = "table", position_mm = [2000, 3100, 0], size_mm = [900, 700, 750], yaw_deg = 20, temperature_c = 24 },
            { name = "trunk", position_mm = [1800, 2700, 0], size_mm = [500, 300, 1400], yaw_deg = 35, temperature_c = 30 },
            { name = "head", position_mm = [1850, 2650, 1400], size_mm = [200, 200, 300], temperature_c = 33 },
        ]
        sensor = [{ name = "s", preset = "grid-eye", position_mm = [2000, 3000, 2700], elevation_deg = 85, azimuth_deg = 3 }]
    "#;

    #[test]
    fn every_width_of_vectors_gives_the_same_bits() {
        let files = |_: &str| Err(io::Error::from(io::ErrorKind::NotFound));
        let scene = Scene::parse(SCENE, "room.toml", &files).unwrap().scene;
        let (sensor, air) = (&scene.sensors()[0], Air::new(Law::B, 20.0, 5.0));
        let view = View::new(sensor);
        let painted = |body: &Body| -> Vec<Painted> {
            let sight = Sight::new(&sensor.pose, &body.solid, DVec3::ZERO);
            let patches = view.patches(&sight).into_iter();
            let glow = air.glow(body.surface);
            patches
                .map(|patch| Painted {
                    root: air.root(&glow, patch.distances_m()),
                    patch,
                    glow,
                    owner: 0,
                })
                .collect()
        };
        let bodies = scene.objects();
        let backdrop = Backdrop::new(&view, &air, &painted(&bodies[0]));
        let resampler = Resampler::new((view.columns(), view.rows()), (8, 8));
        let moving = [painted(&bodies[1]), painted(&bodies[2])].concat();
        for counts in [None, Some(vec![1.0; moving.len()])] {
            let sums = |run: fn(Draw<'_, '_>)| -> Vec<u64> {
                let mut bench = Bench::new(&view, &air, &backdrop, &resampler);
                run(Draw {
                    bench: &mut bench,
                    patches: &moving,
                    counts: counts.as_deref(),
                });
                bench.sums.iter().map(|sum| sum.to_bits()).collect()
            };
            let widest = sums(|draw| dispatch(draw));
            assert!(widest.iter().filter(|bits| **bits != 0).count() > 100);
            assert_eq!(widest, sums(|draw| draw.with_simd(Scalar256b)));
            assert_eq!(widest, sums(|draw| draw.with_simd(pulp::Scalar)));
        }
    }
}
