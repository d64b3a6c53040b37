//! Finds the nearest surface in each cell of the sampling grid, row by row.

mod backdrop;
mod shaded;
mod span;

pub(crate) use backdrop::Backdrop;
pub(crate) use shaded::ShadedPatch;

use crate::picture::projection::{LANES_MAX, SamplingGrid};
use crate::picture::resample::Resampler;
use crate::radiometry::Air;
use backdrop::Background;
use pulp::{Simd, WithSimd};
use shaded::{dispatch, hull};
use span::{
    CellRow, CellSpan, DepthTested, InFront, OverNothing, RowBuffers, Sums, put_back, tail,
};
use std::ops::Range;

/// Draws moving patches over the backdrop, row by row. Row weights apply per cell, column weights once per pixel row.
pub(crate) struct Accumulator<'a> {
    view: &'a SamplingGrid,
    air: &'a Air,
    backdrop: &'a Backdrop,
    resampler: &'a Resampler,
    buffers: RowBuffers,
    /// The change of the current row, column by column.
    values: Vec<f64>,
    /// A row of sums that is never read.
    spare: Vec<f64>,
    /// For each pixel row, the weighted sums of cell values, column by column.
    sums: Vec<f64>,
    /// The columns changed by any row, and the pixel rows affected.
    changed: Range<usize>,
    changed_rows: Range<usize>,
}

pub(crate) const NOBODY: u32 = u32::MAX;

impl<'a> Accumulator<'a> {
    pub(crate) fn new(
        view: &'a SamplingGrid,
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
            buffers: RowBuffers::new(columns),
            values: vec![0.0; columns + LANES_MAX],
            spare: vec![0.0; columns + LANES_MAX],
            sums: vec![0.0; resampler.output_rows() * (columns + LANES_MAX)],
            changed: 0..0,
            changed_rows: 0..0,
        }
    }

    pub(crate) fn add_excess(mut self, patches: &[ShadedPatch], pixels: &mut [f64]) {
        dispatch(Draw {
            accumulator: &mut self,
            patches,
            counts: None,
        });
        self.add_to(pixels);
    }

    pub(crate) fn add_share(
        mut self,
        patches: &[ShadedPatch],
        counts: impl Fn(u32) -> bool,
        pixels: &mut [f64],
    ) {
        let counts: Vec<f64> = patches
            .iter()
            .map(|shaded| f64::from(u8::from(counts(shaded.owner))))
            .collect();
        dispatch(Draw {
            accumulator: &mut self,
            patches,
            counts: Some(&counts),
        });
        self.add_to(pixels);
    }

    /// Adds the sums to the pixels column by column, so that no row waits for its last addition.
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

struct Draw<'b, 'a> {
    accumulator: &'b mut Accumulator<'a>,
    patches: &'b [ShadedPatch],
    /// The patches' counts, if a share is requested.
    counts: Option<&'b [f64]>,
}

impl WithSimd for Draw<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut upcoming: Vec<usize> = (0..self.patches.len()).collect();
        upcoming.sort_by_key(|index| std::cmp::Reverse(self.patches[*index].patch.rows().start));
        let (mut current, mut spans) = (Vec::new(), Vec::new());
        let rows = self.patches.iter().map(|shaded| shaded.patch.rows());
        for row in rows.reduce(hull).unwrap_or(0..0) {
            while let Some(index) = upcoming.pop() {
                if self.patches[index].patch.rows().start > row {
                    upcoming.push(index);
                    break;
                }
                current.push(index);
            }
            current.retain(|index| self.patches[*index].patch.rows().end > row);
            self.cut(row, &current, &mut spans);
            let mut rest = &spans[..];
            while !rest.is_empty() {
                let (group, after) = rest.split_at(overlapping(rest));
                self.accumulator.draw(simd, row, group);
                rest = after;
            }
        }
    }
}

impl<'b> Draw<'b, '_> {
    #[inline(always)]
    fn cut(&self, row: usize, current: &[usize], spans: &mut Vec<CellSpan<'b>>) {
        let (up, columns) = (
            self.accumulator.view.slope_up(row),
            self.accumulator.view.columns(),
        );
        spans.clear();
        for index in current {
            let shaded = &self.patches[*index];
            let covered = shaded.patch.columns(up, columns);
            if covered.is_empty() {
                continue;
            }
            spans.push(CellSpan {
                shaded,
                covered,
                counts: self.counts.map(|counts| counts[*index]),
            });
            let mut place = spans.len() - 1;
            while place > 0 && spans[place - 1].covered.start > spans[place].covered.start {
                spans.swap(place - 1, place);
                place -= 1;
            }
        }
    }
}

/// How many of the spans at the start of a row overlap: 1 if the first is alone.
#[inline(always)]
fn overlapping(spans: &[CellSpan<'_>]) -> usize {
    let (mut count, mut end) = (0, usize::MAX);
    for span in spans {
        if count > 0 && span.covered.start >= end {
            break;
        }
        end = if count == 0 {
            span.covered.end
        } else {
            end.max(span.covered.end)
        };
        count += 1;
    }
    count
}

impl Accumulator<'_> {
    #[inline(always)]
    fn draw<S: Simd>(&mut self, simd: S, row: usize, spans: &[CellSpan<'_>]) {
        let line = CellRow {
            view: self.view,
            air: self.air,
            row,
        };
        let (pixel_rows, weights) = self.resampler.rows_of(row);
        self.changed_rows = hull(self.changed_rows.clone(), pixel_rows.clone());
        if let ([span], [_] | [_, _]) = (spans, weights) {
            self.changed = hull(self.changed.clone(), span.covered.clone());
            self.draw_one(simd, line, span);
        } else {
            let mut changed = 0..0;
            for span in spans {
                changed = hull(changed, span.covered.clone());
            }
            self.changed = hull(self.changed.clone(), changed.clone());
            self.draw_over_one_another(simd, line, spans, &changed);
            self.collect(row, changed);
        }
    }

    /// Draws a span and adds its changes to the pixel rows, one run of the background at a time.
    #[inline(always)]
    fn draw_one<S: Simd>(&mut self, simd: S, line: CellRow<'_>, span: &CellSpan<'_>) {
        let (mut start, end) = (span.covered.start, span.covered.end);
        let backdrop = self.backdrop;
        for run in backdrop.runs(line.row) {
            if run.columns.end <= start {
                continue;
            }
            if run.columns.start >= end {
                break;
            }
            if run.columns.start > start {
                self.draw_part(
                    simd,
                    line,
                    span,
                    start..run.columns.start,
                    Background::Nothing,
                );
                start = run.columns.start;
            }
            let part = start..run.columns.end.min(end);
            start = part.end;
            self.draw_part(simd, line, span, part, Background::Something(run.nearest));
        }
        if start < end {
            self.draw_part(simd, line, span, start..end, Background::Nothing);
        }
    }

    /// Draws part of a span and restores the sums beyond it, which is faster than a test in each cell.
    #[inline(always)]
    fn draw_part<S: Simd>(
        &mut self,
        simd: S,
        line: CellRow<'_>,
        span: &CellSpan<'_>,
        part: Range<usize>,
        back: Background,
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
        let (shaded, covered) = (span.shaded, part.clone());
        let existing = self.backdrop.from::<S>(cell);
        match (back, span.counts) {
            (Background::Nothing, None) => line.draw(simd, shaded, covered, OverNothing { sums }),
            (Background::Something(nearest), None) if line.is_before(shaded, &part, nearest) => {
                let excess = existing.excess;
                line.draw(simd, shaded, covered, InFront { sums, excess });
            }
            (_, counts) => {
                let change = DepthTested {
                    sums,
                    existing,
                    counts,
                };
                line.draw(simd, shaded, covered, change);
            }
        }
        put_back(first, part.len(), &beyond[0]);
        put_back(second, part.len(), &beyond[1]);
    }

    #[inline(always)]
    fn draw_over_one_another<S: Simd>(
        &mut self,
        simd: S,
        line: CellRow<'_>,
        spans: &[CellSpan<'_>],
        changed: &Range<usize>,
    ) {
        let cells = self.backdrop.cells(line.row, changed.clone());
        let count = cells.len();
        let before = &self.backdrop.excess_c[cells.clone()];
        let buffers = &mut self.buffers;
        buffers.depth[changed.clone()].copy_from_slice(&self.backdrop.inverse_depth[cells]);
        buffers.excess[changed.clone()].copy_from_slice(before);
        buffers.counts[changed.clone()].fill(0.0);
        let mut is_counted = false;
        for span in spans {
            is_counted |= span.counts.is_some();
            buffers.draw(simd, line, span);
        }
        if is_counted {
            self.values[..count].copy_from_slice(&buffers.counts[changed.clone()]);
            return;
        }
        let after = buffers.excess[changed.clone()].iter().zip(before);
        for (value, (after, before)) in self.values[..count].iter_mut().zip(after) {
            *value = after - before;
        }
    }

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Body, Scene};
    use crate::picture::projection::Sight;
    use crate::radiometry::Law;
    use glam::DVec3;
    use pulp::Scalar256b;
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
        let view = SamplingGrid::new(sensor);
        let shaded = |body: &Body| -> Vec<ShadedPatch> {
            let sight = Sight::new(&sensor.pose, &body.mesh, DVec3::ZERO);
            let patches = view.patches(&sight).into_iter();
            let glow = air.glow(body.surface);
            patches
                .map(|patch| ShadedPatch {
                    root: air.root(&glow, patch.distances_m()),
                    patch,
                    glow,
                    owner: 0,
                })
                .collect()
        };
        let bodies = scene.objects();
        let backdrop = Backdrop::new(&view, &air, &shaded(&bodies[0]));
        let resampler = Resampler::new((view.columns(), view.rows()), (8, 8));
        let moving = [shaded(&bodies[1]), shaded(&bodies[2])].concat();
        for counts in [None, Some(vec![1.0; moving.len()])] {
            let sums = |run: fn(Draw<'_, '_>)| -> Vec<u64> {
                let mut accumulator = Accumulator::new(&view, &air, &backdrop, &resampler);
                run(Draw {
                    accumulator: &mut accumulator,
                    patches: &moving,
                    counts: counts.as_deref(),
                });
                accumulator.sums.iter().map(|sum| sum.to_bits()).collect()
            };
            let widest = sums(|draw| dispatch(draw));
            assert!(widest.iter().filter(|bits| **bits != 0).count() > 100);
            assert_eq!(widest, sums(|draw| draw.with_simd(Scalar256b)));
            assert_eq!(widest, sums(|draw| draw.with_simd(pulp::Scalar)));
        }
    }
}
