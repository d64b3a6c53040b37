//! The visible faces along one horizontal line of the image.

use crate::geometry::Contour;
use crate::picture::subject::SeenFace;
use glam::DVec3;

/// A band of the image: the upward slope of its middle line, and how far it reaches to either side.
#[derive(Debug, Clone, Copy)]
pub(super) struct Level {
    up: f64,
    half: f64,
}

impl Level {
    /// The band between two angles.
    pub(super) fn of((low, high): (f64, f64)) -> Self {
        let up = libm::tan(0.5 * (low + high));
        Self {
            up,
            half: 0.5 * (high - low) * (1.0 + up * up),
        }
    }
}

#[derive(Debug, Clone)]
pub(super) struct Face {
    /// The outline of a round body; `None` if flat sides bound it.
    round: Option<Contour>,
    /// A ray meets the face if its products with all of these are not negative.
    sides: Vec<DVec3>,
    /// Its product with a ray `(1, left, up)` is the inverse depth where the ray meets the face's plane.
    inverse_depth: DVec3,
    pub(super) up: (f64, f64),
    pub(super) excess: f64,
    pub(super) owner: u32,
}

/// The mean chord of a parabola's cap relative to the chord at half its height: 2/3 over the root of 1/2.
const CAP_PER_CHORD: f64 = 0.942_809_041_582_063_4;

/// Surfaces along a ray with a smaller relative difference of depth are at the same depth.
const SAME_DEPTH: f64 = 1e-11;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Span {
    pub(super) from: f64,
    pub(super) to: f64,
    /// The inverse depth at zero slope to the left, and its change per unit of slope.
    inverse_depth: (f64, f64),
    pub(super) excess: f64,
    pub(super) owner: u32,
}

impl Face {
    pub(super) fn new(seen: &SeenFace, excess: f64, owner: u32) -> Self {
        Self {
            round: None,
            sides: seen.sides().collect(),
            inverse_depth: seen.inverse_depth,
            up: reach(&seen.corners),
            excess,
            owner,
        }
    }

    /// A round body: the flat patch within its outline.
    pub(super) fn round(contour: Contour, excess: f64, owner: u32) -> Self {
        Self {
            round: Some(contour),
            sides: Vec::new(),
            inverse_depth: contour.inverse_depth,
            up: contour.reach(),
            excess,
            owner,
        }
    }

    /// The chord of a round body; where the body ends within the band, a chord with the area of the cap in it.
    fn across(&self, contour: &Contour, level: &Level) -> Option<(f64, f64)> {
        let low = self.up.0.max(level.up - level.half);
        let high = self.up.1.min(level.up + level.half);
        let filled = 0.5 * (high - low) / level.half;
        if filled > 1.0 - 1e-9 {
            return contour.across(level.up);
        }
        let (from, to) = contour.across(0.5 * (low + high))?;
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        let half = half * filled * CAP_PER_CHORD;
        half.is_finite().then_some((middle - half, middle + half))
    }

    /// Where the face crosses the line of rays with this upward slope, up to `left_max` to either side.
    pub(super) fn span(&self, level: &Level, left_max: f64) -> Option<Span> {
        let up = level.up;
        let (mut from, mut to) = (-left_max, left_max);
        if let Some(contour) = &self.round {
            let across = self.across(contour, level)?;
            (from, to) = (from.max(across.0), to.min(across.1));
        }
        for side in &self.sides {
            let at_axis = side.x + side.z * up;
            if side.y > 0.0 {
                from = from.max(-at_axis / side.y);
            } else if side.y < 0.0 {
                to = to.min(-at_axis / side.y);
            } else if at_axis < 0.0 {
                return None;
            }
        }
        (from < to).then_some(Span {
            from,
            to,
            inverse_depth: (
                self.inverse_depth.x + self.inverse_depth.z * up,
                self.inverse_depth.y,
            ),
            excess: self.excess,
            owner: self.owner,
        })
    }
}

/// The vertical extent of corners as slopes; infinite if one is not in front of the sensor.
fn reach(corners: &[DVec3]) -> (f64, f64) {
    let mut up = (f64::INFINITY, f64::NEG_INFINITY);
    for corner in corners {
        if corner.x <= 0.0 {
            return (f64::NEG_INFINITY, f64::INFINITY);
        }
        let slope = corner.z / corner.x;
        up = (up.0.min(slope), up.1.max(slope));
    }
    up
}

impl Span {
    fn inverse_depth_at(&self, left: f64) -> f64 {
        self.inverse_depth.0 + self.inverse_depth.1 * left
    }

    fn part(&self, from: f64, to: f64) -> Self {
        Self { from, to, ..*self }
    }

    /// How far in front of another span it is at a slope: positive if in front, 0 at the same depth.
    fn before(&self, other: &Self, left: f64) -> f64 {
        let (here, there) = (self.inverse_depth_at(left), other.inverse_depth_at(left));
        let ahead = here - there;
        if ahead.abs() <= SAME_DEPTH * here.abs().max(there.abs()) {
            0.0
        } else {
            ahead
        }
    }
}

#[derive(Debug, Clone, Default)]
pub(super) struct Line {
    spans: Vec<Span>,
}

impl Line {
    pub(super) fn spans(&self) -> &[Span] {
        &self.spans
    }

    pub(super) fn copy_from(&mut self, other: &Self) {
        self.spans.clear();
        self.spans.extend_from_slice(&other.spans);
    }

    pub(super) fn clear(&mut self) {
        self.spans.clear();
    }

    /// Inserts a span in front of what it hides and behind what hides it.
    pub(super) fn insert(&mut self, new: Span, scratch: &mut Vec<Span>) {
        let start = self.spans.partition_point(|old| old.to <= new.from);
        let over = self.spans[start..].partition_point(|old| old.from < new.to);
        if over == 0 {
            self.spans.insert(start, new);
            return;
        }
        scratch.clear();
        let mut done = new.from;
        for old in &self.spans[start..start + over] {
            push(scratch, old.part(old.from, new.from.min(old.to)));
            push(scratch, new.part(done, old.from));
            let both = (old.from.max(new.from), old.to.min(new.to));
            nearer(scratch, old, &new, both);
            push(scratch, old.part(new.to.max(old.from), old.to));
            done = both.1;
        }
        push(scratch, new.part(done, new.to));
        // Cheaper than a splice: a line has few spans.
        scratch.extend_from_slice(&self.spans[start + over..]);
        self.spans.truncate(start);
        self.spans.append(scratch);
    }
}

fn push(spans: &mut Vec<Span>, span: Span) {
    if span.from < span.to {
        spans.push(span);
    }
}

/// The nearer of two spans where both exist; at the same depth the one with more radiance.
fn nearer(spans: &mut Vec<Span>, old: &Span, new: &Span, (from, to): (f64, f64)) {
    let (at_from, at_to) = (new.before(old, from), new.before(old, to));
    let wins = |ahead: f64| ahead > 0.0;
    if at_from == 0.0 && at_to == 0.0 {
        let seen = if new.excess > old.excess { new } else { old };
        push(spans, seen.part(from, to));
    } else if at_from >= 0.0 && at_to >= 0.0 {
        push(spans, new.part(from, to));
    } else if at_from <= 0.0 && at_to <= 0.0 {
        push(spans, old.part(from, to));
    } else {
        let meet = (from + (to - from) * (at_from / (at_from - at_to))).clamp(from, to);
        let (first, second) = if wins(at_from) {
            (new, old)
        } else {
            (old, new)
        };
        push(spans, first.part(from, meet));
        push(spans, second.part(meet, to));
    }
}

/// A step of a value along a line: the slope to the left, and the rise there.
pub(super) type Step = (f64, f64);

/// Where, and by how much, the difference of two lines' values changes.
pub(super) fn steps(
    spans: &[Span],
    value: impl Fn(&Span) -> f64,
    less: &[Span],
    steps: &mut Vec<Step>,
) {
    steps.clear();
    let (mut new, mut old) = (spans, less);
    let (mut at, mut before) = (f64::NEG_INFINITY, 0.0);
    loop {
        new = beyond(new, at);
        old = beyond(old, at);
        let (here_new, next_new) = stretch(new.first(), at, &value);
        let (here_old, next_old) = stretch(old.first(), at, |span| span.excess);
        let here = here_new - here_old;
        if here != before {
            steps.push((at, here - before));
            before = here;
        }
        at = next_new.min(next_old);
        if at == f64::INFINITY {
            return;
        }
    }
}

/// The spans that do not end at a place or before.
fn beyond(mut spans: &[Span], at: f64) -> &[Span] {
    while let [first, rest @ ..] = spans {
        if first.to > at {
            break;
        }
        spans = rest;
    }
    spans
}

/// Where the union of these spans begins and ends.
pub(super) fn union(spans: &mut [Span], steps: &mut Vec<Step>) {
    spans.sort_unstable_by(|one, other| one.from.total_cmp(&other.from));
    steps.clear();
    let mut end = f64::NEG_INFINITY;
    for span in spans {
        if span.from > end {
            if !steps.is_empty() {
                steps.push((end, -1.0));
            }
            steps.push((span.from, 1.0));
        }
        end = end.max(span.to);
    }
    if !steps.is_empty() {
        steps.push((end, -1.0));
    }
}

/// The value at a place, and where it may change next.
fn stretch(span: Option<&Span>, at: f64, value: impl Fn(&Span) -> f64) -> (f64, f64) {
    match span {
        None => (0.0, f64::INFINITY),
        Some(span) if span.from > at => (0.0, span.from),
        Some(span) => (value(span), span.to),
    }
}

/// Upward slopes at which to cut the image, so that edges flatter than `height` and wider than `width` are exact.
pub(super) fn levels(faces: &[SeenFace], (height, width): (f64, f64), levels: &mut Vec<f64>) {
    if faces.len() > ROUND_FACES_MIN {
        let reaches = faces.iter().map(|face| reach(&face.corners));
        let ends = reaches.reduce(|one, other| (one.0.min(other.0), one.1.max(other.1)));
        levels.extend(ends.into_iter().flat_map(|ends| [ends.0, ends.1]));
        return;
    }
    for face in faces {
        let corners = face.corners.iter();
        for (from, to) in corners.clone().zip(corners.cycle().skip(1)) {
            if from.x <= 0.0 || to.x <= 0.0 {
                continue;
            }
            let (low, high) = (from.z / from.x, to.z / to.x);
            let along = (from.y / from.x - to.y / to.x).abs();
            if (high - low).abs() < height && along > width {
                let quarters = [0.0, 0.25, 0.5, 0.75, 1.0];
                levels.extend(quarters.map(|share| low + share * (high - low)));
            }
        }
    }
}

/// A body that shows more faces is round, and is cut only at its ends.
const ROUND_FACES_MIN: usize = 24;
