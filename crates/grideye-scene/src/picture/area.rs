//! The paper's model without its sampling grid: each pixel is the integral of the visible surfaces, weighted by the
//! pixel's response.
//!
//! On an ever finer grid, the weights of `imresize` tend to triangles over two pixels, linear between pixel centers. A
//! piece cut at these centers contributes to four pixels by its moments. A Gauss rule of degree 5 integrates the law's
//! fourth root. Round bodies that move are drawn as their outlines in one plane each: what a person
//! adds is off by 1 to 4 %.

use crate::geometry::{Pose, clipped, count, polygon::bounds};
use crate::model::Sensor;
use crate::picture::subject::Subject;
use crate::radiometry::{Air, Glow};
use glam::{DVec2, DVec3};
use std::borrow::Cow;
use std::cmp::Ordering;

/// A convex polygon in the image plane, in pixels: x to the right, y down, from the top left corner.
type Polygon = Vec<DVec2>;

#[derive(Debug, Clone)]
pub(crate) struct Area {
    pose: Pose,
    air: Air,
    plane: ImagePlane,
    still: Facets,
    /// The visible parts of the still facets.
    pieces: Vec<Piece>,
    /// The pixels with still bodies only.
    still_c: Vec<f64>,
}

#[derive(Debug, Clone)]
struct Facet {
    outline: Polygon,
    /// Bounds of the outline.
    bounds: (DVec2, DVec2),
    /// The inverse depth is `inverse_depth · (x, y, 1)`.
    inverse_depth: DVec3,
    /// The largest inverse depth of its corners.
    nearest: f64,
    glow: Glow,
    /// Perceived temperature where its plane is nearest, °C above ambient: decides which of two facets at one depth is
    /// seen.
    warmth_c: f64,
    owner: u32,
}

#[derive(Debug, Clone)]
struct Piece {
    outline: Polygon,
    /// Bounds of the outline.
    bounds: (DVec2, DVec2),
    facet: usize,
}

#[derive(Debug, Clone)]
struct ImagePlane {
    columns: usize,
    rows: usize,
    /// Slope per pixel on each axis, and half the image in pixels.
    pitch: DVec2,
    half: DVec2,
}

impl ImagePlane {
    fn new(sensor: &Sensor) -> Self {
        let half = 0.5 * DVec2::new(count::float(sensor.columns), count::float(sensor.rows));
        Self {
            columns: sensor.columns,
            rows: sensor.rows,
            pitch: sensor.view_slopes() / half,
            half,
        }
    }

    /// The facet of a face in the sensor's axes; `inverse_depth` times ray `(1, left, up)` is the inverse depth there.
    fn facet(
        &self,
        mut in_view: Vec<DVec3>,
        inverse_depth: DVec3,
        (air, glow, owner): (&Air, Glow, u32),
    ) -> Option<Facet> {
        let slope = self.half * self.pitch;
        let borders = [
            DVec3::new(slope.x, 1.0, 0.0),
            DVec3::new(slope.x, -1.0, 0.0),
            DVec3::new(slope.y, 0.0, 1.0),
            DVec3::new(slope.y, 0.0, -1.0),
        ];
        for border in borders {
            in_view = clipped(&in_view, |corner| border.dot(corner));
        }
        let outline: Polygon = in_view
            .iter()
            .filter(|corner| corner.x > 0.0)
            .map(|corner| self.half - DVec2::new(corner.y, corner.z) / corner.x / self.pitch)
            .collect();
        let by_pixel = -DVec2::new(inverse_depth.y, inverse_depth.z) * self.pitch;
        let by_point = by_pixel.extend(inverse_depth.x - by_pixel.dot(self.half));
        let depths = outline
            .iter()
            .map(|point| by_point.dot(point.extend(1.0)).abs());
        let facet = Facet {
            inverse_depth: by_point,
            nearest: depths.fold(0.0, f64::max),
            bounds: bounds(outline.iter().copied()),
            outline: counter_clockwise(outline),
            warmth_c: air.excess(&glow, 1.0 / inverse_depth.length_squared()),
            glow,
            owner,
        };
        (area(&facet.outline) > AREA_MIN).then_some(facet)
    }

    fn excess(&self, air: &Air, facet: &Facet, point: DVec2) -> f64 {
        let slope = (self.half - point) * self.pitch;
        let inverse_depth = facet.inverse_depth.dot(point.extend(1.0));
        let ray2 = 1.0 + slope.length_squared();
        air.excess(&facet.glow, ray2 / (inverse_depth * inverse_depth))
    }
}

impl Area {
    pub(crate) fn new(air: Air, sensor: &Sensor, standing: &[Subject<'_>]) -> Self {
        let mut area = Self {
            pose: sensor.pose,
            air,
            plane: ImagePlane::new(sensor),
            still: Facets::new(Vec::new()),
            pieces: Vec::new(),
            still_c: vec![air.ambient_c(); sensor.columns * sensor.rows],
        };
        let still = area.facets(standing);
        let mut still_c = std::mem::take(&mut area.still_c);
        let pieces = still.visible(None).into_iter().map(|(facet, outline)| {
            let excess = area.excess(&still.all[facet]);
            area.plane.integrate(&outline, &excess, &mut still_c);
            Piece {
                bounds: bounds(outline.iter().copied()),
                outline,
                facet,
            }
        });
        area.pieces = pieces.collect();
        Self {
            still,
            still_c,
            ..area
        }
    }

    /// The image, °C, and of each of so many agents the share of each pixel, seen and if nothing hid the agent.
    pub(crate) fn image(
        &self,
        moving: &[Subject<'_>],
        agents: usize,
    ) -> (Vec<f64>, Vec<[Vec<f64>; 2]>) {
        let moving = self.facets(moving);
        let visible = moving.visible(Some(&self.still));
        let mut celsius = self.still_c.clone();
        for (facet, outline) in &visible {
            self.draw(&moving.all[*facet], outline, &mut celsius);
        }
        let of_owner = |owner: u32| {
            let is_own = |facet: &&Facet| facet.owner == owner;
            let alone = moving.all.iter().filter(is_own).cloned().collect();
            let alone = Facets::new(alone);
            let seen = visible
                .iter()
                .filter(|(facet, _)| is_own(&&moving.all[*facet]));
            [
                self.share(seen.map(|(_, outline)| outline)),
                self.share(alone.visible(None).iter().map(|(_, outline)| outline)),
            ]
        };
        let shares = (0..).take(agents).map(of_owner).collect();
        (celsius, shares)
    }

    fn share<'a>(&self, outlines: impl Iterator<Item = &'a Polygon>) -> Vec<f64> {
        let mut share = vec![0.0; self.still_c.len()];
        outlines.for_each(|outline| self.plane.integrate(outline, &|_| 1.0, &mut share));
        share
    }

    fn facets(&self, subjects: &[Subject<'_>]) -> Facets {
        let mut facets = Vec::new();
        for subject in subjects {
            let made_of = |surface| (&self.air, self.air.glow(surface), subject.owner);
            match subject.outline(&self.pose) {
                Some((outline, depth)) => {
                    let made_of = made_of(subject.surface);
                    facets.extend(self.plane.facet(outline, depth, made_of));
                }
                None => facets.extend(subject.faces(&self.pose).iter().filter_map(|face| {
                    let made_of = made_of(subject.of_face(face.face));
                    let corners = face.corners.clone();
                    self.plane.facet(corners, face.inverse_depth, made_of)
                })),
            }
        }
        Facets::new(facets)
    }

    /// Adds what a visible part of a facet changes in the image of the still bodies.
    fn draw(&self, facet: &Facet, outline: &Polygon, pixels: &mut [f64]) {
        self.plane.integrate(outline, &self.excess(facet), pixels);
        let of_outline = bounds(outline.iter().copied());
        for piece in &self.pieces {
            if !overlap(of_outline, piece.bounds) {
                continue;
            }
            let covered = intersection(outline, &piece.outline);
            let behind = self.excess(&self.still.all[piece.facet]);
            self.plane
                .integrate(&covered, &|point| -behind(point), pixels);
        }
    }

    fn excess(&self, facet: &Facet) -> impl Fn(DVec2) -> f64 {
        move |point| self.plane.excess(&self.air, facet, point)
    }
}

impl ImagePlane {
    /// Adds the integral of a smooth value over a convex polygon to the pixels, weighted by their responses.
    fn integrate(&self, outline: &[DVec2], value: &impl Fn(DVec2) -> f64, pixels: &mut [f64]) {
        if area(outline) <= AREA_MIN {
            return;
        }
        let (low, high) = bounds(outline.iter().copied());
        for row in bands(low.y, high.y, self.rows) {
            let strip = within(outline, (low.y, high.y), band(row, self.rows), |point| {
                point.y
            });
            if area(&strip) <= AREA_MIN {
                continue;
            }
            let (low, high) = bounds(strip.iter().copied());
            for column in bands(low.x, high.x, self.columns) {
                let (left, right) = band(column, self.columns);
                let cell = within(&strip, (low.x, high.x), (left, right), |point| point.x);
                self.integrate_between_centers(&cell, (row, column), value, pixels);
            }
        }
    }

    /// As [`Self::integrate`], for a polygon between four pixel centers; `row` and `column` are of the lower right one.
    fn integrate_between_centers(
        &self,
        cell: &[DVec2],
        (row, column): (usize, usize),
        value: &impl Fn(DVec2) -> f64,
        pixels: &mut [f64],
    ) {
        let Some((anchor, rest)) = cell.split_first() else {
            return;
        };
        // Share of the pixel after the center on an axis: 1 before the first center, 0 after the last.
        let after = |at: f64, band: usize, count: usize| {
            let share = at - (count::float(band) - 0.5);
            match band {
                0 => 1.0,
                last if last == count => 0.0,
                _ => share,
            }
        };
        let mut moments = [0.0; 4];
        for pair in rest.windows(2) {
            let (along, across) = (pair[0] - *anchor, pair[1] - *anchor);
            let double_area = along.perp_dot(across);
            for (weight, share_along, share_across) in GAUSS {
                let point = *anchor + share_along * along + share_across * across;
                let part = 0.5 * double_area * weight * value(point);
                let right = after(point.x, column, self.columns);
                let below = after(point.y, row, self.rows);
                moments[0] += part * (1.0 - right) * (1.0 - below);
                moments[1] += part * right * (1.0 - below);
                moments[2] += part * (1.0 - right) * below;
                moments[3] += part * right * below;
            }
        }
        let (left, right) = (column.saturating_sub(1), column.min(self.columns - 1));
        let (above, below) = (row.saturating_sub(1), row.min(self.rows - 1));
        for (moment, (row, column)) in
            moments
                .into_iter()
                .zip([(above, left), (above, right), (below, left), (below, right)])
        {
            pixels[row * self.columns + column] += moment;
        }
    }
}

/// Radon's rule of degree 5 on a triangle (Radon 1948; Stroud 1971, T2:5-1): weight, second and third corner's share.
const GAUSS: [(f64, f64, f64); 7] = {
    const ROOT_15: f64 = 3.872_983_346_207_417;
    const NEAR: f64 = (6.0 - ROOT_15) / 21.0;
    const FAR: f64 = (6.0 + ROOT_15) / 21.0;
    const NEAR_WEIGHT: f64 = (155.0 - ROOT_15) / 1200.0;
    const FAR_WEIGHT: f64 = (155.0 + ROOT_15) / 1200.0;
    [
        (0.225, 1.0 / 3.0, 1.0 / 3.0),
        (NEAR_WEIGHT, NEAR, NEAR),
        (NEAR_WEIGHT, 1.0 - 2.0 * NEAR, NEAR),
        (NEAR_WEIGHT, NEAR, 1.0 - 2.0 * NEAR),
        (FAR_WEIGHT, FAR, FAR),
        (FAR_WEIGHT, 1.0 - 2.0 * FAR, FAR),
        (FAR_WEIGHT, FAR, 1.0 - 2.0 * FAR),
    ]
};

const AREA_MIN: f64 = 1e-12;

/// Facets with a smaller relative difference of depth are at the same depth.
const SAME_DEPTH: f64 = 1e-9;

/// The bands between pixel centers that an interval reaches: band 0 lies before the first center.
fn bands(low: f64, high: f64, count: usize) -> std::ops::RangeInclusive<usize> {
    count::floor(low + 0.5).min(count)..=count::floor(high + 0.5).min(count)
}

fn band(index: usize, count: usize) -> (f64, f64) {
    let center = count::float(index);
    (
        if index == 0 { 0.0 } else { center - 0.5 },
        if index == count { center } else { center + 0.5 },
    )
}

/// The part of a polygon in a band of one coordinate; most polygons are in one band already.
fn within(
    outline: &[DVec2],
    (low, high): (f64, f64),
    (first, last): (f64, f64),
    at: impl Fn(DVec2) -> f64,
) -> Cow<'_, [DVec2]> {
    if first <= low && high <= last {
        return Cow::Borrowed(outline);
    }
    let after = clipped(outline, |point| at(point) - first);
    Cow::Owned(clipped(&after, |point| last - at(point)))
}

/// Facets by cells of a grid over all of them: most of those of a body are nowhere near each other.
#[derive(Debug, Clone)]
struct Facets {
    all: Vec<Facet>,
    low: DVec2,
    cells_per_pixel: DVec2,
    /// For each cell, row by row, a bit for each facet that reaches it.
    in_cells: Vec<u64>,
    words: usize,
}

impl Facets {
    const CELLS: usize = 8;

    fn new(all: Vec<Facet>) -> Self {
        let corners = all.iter().map(|facet| facet.bounds);
        let (low, high) = bounds(corners.flat_map(|(low, high)| [low, high]));
        let words = all.len().div_ceil(64);
        let mut facets = Self {
            all,
            low,
            cells_per_pixel: count::float(Self::CELLS) / (high - low),
            in_cells: vec![0; Self::CELLS * Self::CELLS * words],
            words,
        };
        for index in 0..facets.all.len() {
            for cell in facets.cells(facets.all[index].bounds) {
                facets.in_cells[cell * words + index / 64] |= 1 << (index % 64);
            }
        }
        facets
    }

    /// The parts that neither the others nor those behind them hide, each with its facet's index.
    fn visible(&self, still: Option<&Self>) -> Vec<(usize, Polygon)> {
        let mut visible = Vec::with_capacity(self.all.len());
        for (index, facet) in self.all.iter().enumerate() {
            let mut outlines = vec![facet.outline.clone()];
            for (other, of) in self.near(facet).filter(|(other, _)| *other != index) {
                hide(&mut outlines, facet, of, other < index);
            }
            for (_, of) in still.into_iter().flat_map(|still| still.near(facet)) {
                hide(&mut outlines, facet, of, true);
            }
            visible.extend(outlines.into_iter().map(|outline| (index, outline)));
        }
        visible
    }

    fn cells(&self, (low, high): (DVec2, DVec2)) -> impl Iterator<Item = usize> + use<> {
        let cell = |at: f64| count::floor(at).min(Self::CELLS - 1);
        let first = (low - self.low) * self.cells_per_pixel;
        let last = (high - self.low) * self.cells_per_pixel;
        let columns = cell(first.x)..=cell(last.x);
        let rows = cell(first.y)..=cell(last.y);
        rows.flat_map(move |row| {
            columns
                .clone()
                .map(move |column| row * Self::CELLS + column)
        })
    }

    /// The facets whose bounds overlap those of this one, in order.
    fn near(&self, facet: &Facet) -> impl Iterator<Item = (usize, &Facet)> {
        let bounds = facet.bounds;
        let mut here = vec![0; self.words];
        for cell in self.cells(bounds) {
            let facets = &self.in_cells[cell * self.words..][..self.words];
            here.iter_mut()
                .zip(facets)
                .for_each(|(here, there)| *here |= there);
        }
        let indices = here.into_iter().enumerate().flat_map(|(word, mut bits)| {
            let next = move || {
                let bit = (bits != 0).then_some(bits.trailing_zeros())?;
                bits &= bits - 1;
                usize::try_from(bit).ok()
            };
            std::iter::from_fn(next).map(move |bit| 64 * word + bit)
        });
        let facets = indices.map(|index| (index, &self.all[index]));
        facets.filter(move |(_, other)| overlap(bounds, other.bounds))
    }
}

/// Removes what another facet hides that overlaps it. At the same depth the warmer one is seen; between equals `wins` decides.
fn hide(outlines: &mut Vec<Polygon>, facet: &Facet, other: &Facet, wins: bool) {
    if outlines.is_empty() {
        return;
    }
    let nearer = other.inverse_depth - facet.inverse_depth;
    let coincide = facet
        .outline
        .iter()
        .all(|point| nearer.dot(point.extend(1.0)).abs() <= SAME_DEPTH * facet.nearest);
    let in_front = |point: DVec2| nearer.dot(point.extend(1.0));
    let cover = if coincide {
        match other.warmth_c.total_cmp(&facet.warmth_c) {
            Ordering::Greater => Cow::Borrowed(&other.outline),
            Ordering::Equal if wins => Cow::Borrowed(&other.outline),
            _ => return,
        }
    } else if other.outline.iter().all(|point| in_front(*point) <= 0.0) {
        return;
    } else if other.outline.iter().all(|point| in_front(*point) >= 0.0) {
        Cow::Borrowed(&other.outline)
    } else {
        Cow::Owned(clipped(&other.outline, in_front))
    };
    if area(&cover) <= AREA_MIN {
        return;
    }
    *outlines = outlines
        .iter()
        .flat_map(|outline| difference(outline, &cover))
        .collect();
}

fn difference(outline: &[DVec2], cover: &[DVec2]) -> Vec<Polygon> {
    let whole = || vec![outline.to_vec()];
    if !may_meet(outline, cover) {
        return whole();
    }
    let mut parts = Vec::new();
    let mut rest = outline.to_vec();
    for side in sides(cover) {
        let outside = clipped(&rest, |point| -side(point));
        if area(&outside) > AREA_MIN {
            parts.push(outside);
        }
        rest = clipped(&rest, &side);
        if rest.is_empty() {
            break;
        }
    }
    // What they share is nothing but rounding.
    if area(&rest) <= AREA_MIN {
        return whole();
    }
    parts
}

fn intersection(one: &[DVec2], other: &[DVec2]) -> Polygon {
    if !may_meet(one, other) {
        return Vec::new();
    }
    sides(other).fold(one.to_vec(), |rest, side| clipped(&rest, side))
}

/// Shorter sides, in pixels, are rounding where a cut meets a corner, and have no direction.
const SIDE_MIN: f64 = 1e-7;

fn sides(outline: &[DVec2]) -> impl Iterator<Item = impl Fn(DVec2) -> f64> {
    let next = outline.iter().cycle().skip(1);
    outline
        .iter()
        .zip(next)
        .filter(|(from, to)| from.distance_squared(**to) > SIDE_MIN * SIDE_MIN)
        .map(|(from, to)| move |point: DVec2| (*to - *from).perp_dot(point - *from))
}

/// Whether the polygons can have more than an edge in common: a side of neither lies between them (separating axes).
fn may_meet(one: &[DVec2], other: &[DVec2]) -> bool {
    let is_beyond = |outline: &[DVec2], of: &[DVec2]| {
        sides(of).any(|side| outline.iter().all(|point| side(*point) <= 0.0))
    };
    overlap(bounds(one.iter().copied()), bounds(other.iter().copied()))
        && !is_beyond(one, other)
        && !is_beyond(other, one)
}

fn overlap((low, high): (DVec2, DVec2), (other_low, other_high): (DVec2, DVec2)) -> bool {
    low.cmple(other_high).all() && other_low.cmple(high).all()
}

fn area(outline: &[DVec2]) -> f64 {
    let Some((anchor, rest)) = outline.split_first() else {
        return 0.0;
    };
    rest.windows(2)
        .map(|pair| 0.5 * (pair[0] - *anchor).perp_dot(pair[1] - *anchor))
        .sum()
}

fn counter_clockwise(mut outline: Polygon) -> Polygon {
    if area(&outline) < 0.0 {
        outline.reverse();
    }
    outline
}
