//! Finds when convex bodies first meet, by steps of distance / speed until the distance is zero.
//!
//! A step never skips a contact, but is at least [`STEP_M`] long, so a shorter contact may be missed. Non-convex bodies
//! are tested face by face.

use crate::geometry::distance::{Gap, gap, meet};
use crate::geometry::mesh::{Enclosure, Mesh};
use crate::geometry::polygon::normal;
use glam::DVec3;

/// Convex bodies are shrunk by this on each side, meters: touching, or an overlap of up to twice this, is no contact.
pub(crate) const TOLERANCE_M: f64 = 5e-4;

const STEP_M: f64 = 5e-4;

const STEPS_MAX: f64 = 10_000.0;

/// Halvings of the last step: to a millionth of it.
const HALVINGS: usize = 20;

#[derive(Debug, Clone, Copy)]
pub(crate) struct Meeting {
    pub(crate) time_s: f64,
    pub(crate) place_m: DVec3,
}

#[derive(Debug, Clone)]
pub(crate) struct Shape {
    pub(crate) pieces: Vec<Piece>,
    pub(crate) bounds: Bounds,
}

#[derive(Debug, Clone)]
pub(crate) struct Piece {
    points: Vec<DVec3>,
    bounds: Bounds,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds {
    low: DVec3,
    high: DVec3,
}

impl Bounds {
    pub(crate) const NOTHING: Self = Self {
        low: DVec3::INFINITY,
        high: DVec3::NEG_INFINITY,
    };

    fn of(points: &[DVec3]) -> Self {
        points.iter().fold(Self::NOTHING, |bounds, point| Self {
            low: bounds.low.min(*point),
            high: bounds.high.max(*point),
        })
    }

    pub(crate) fn with(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    /// The box around everything that this box covers while it moves from one place to another.
    pub(crate) fn swept(self, from_m: DVec3, to_m: DVec3) -> Self {
        Self {
            low: self.low + from_m.min(to_m),
            high: self.high + from_m.max(to_m),
        }
    }

    pub(crate) fn meets(&self, other: &Self) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }
}

impl Shape {
    pub(crate) fn new<'s>(meshes: impl IntoIterator<Item = &'s Mesh>) -> Self {
        Self::of_pieces(meshes.into_iter().flat_map(pieces).collect())
    }

    pub(crate) fn of_pieces(pieces: Vec<Piece>) -> Self {
        let bounds = pieces.iter().map(|piece| piece.bounds);
        Self {
            bounds: bounds.fold(Bounds::NOTHING, Bounds::with),
            pieces,
        }
    }

    pub(crate) fn overlaps(&self, other: &Self) -> bool {
        self.pieces.iter().any(|one| {
            other
                .pieces
                .iter()
                .any(|other| one.bounds.meets(&other.bounds) && meet(&one.points, &other.points))
        })
    }
}

impl Piece {
    fn new(points: Vec<DVec3>) -> Self {
        Self {
            bounds: Bounds::of(&points),
            points,
        }
    }

    /// A convex face of a room, counter-clockwise from within, moved outwards and shrunk by [`TOLERANCE_M`] to clear
    /// its neighbors.
    pub(crate) fn of_wall(side: &[DVec3]) -> Self {
        let out_m = -TOLERANCE_M * normal(side);
        let moved: Vec<DVec3> = side.iter().map(|corner| *corner + out_m).collect();
        Self::new(shrunk(&moved))
    }
}

fn pieces(mesh: &Mesh) -> Vec<Piece> {
    if mesh.enclosure() == Enclosure::Convex {
        return vec![Piece::new(shrunk(mesh.vertices_m()))];
    }
    let vertices_m = mesh.vertices_m();
    let face = |corners: &[usize]| corners.iter().map(|corner| vertices_m[*corner]).collect();
    let faces = mesh.faces();
    faces.map(|corners| Piece::new(face(corners))).collect()
}

/// The corners, moved towards the center by at most [`TOLERANCE_M`] on each axis.
fn shrunk(points: &[DVec3]) -> Vec<DVec3> {
    let Bounds { low, high } = Bounds::of(points);
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let keep = (half - TOLERANCE_M).max(DVec3::ZERO) / half.max(DVec3::splat(TOLERANCE_M));
    let points = points.iter();
    let nearer = points.map(|vertex| middle + (*vertex - middle) * keep);
    nearer.collect()
}

/// A time during which neither of two bodies turns or changes direction.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Span {
    pub(crate) start_s: f64,
    pub(crate) end_s: f64,
    pub(crate) speed_max_m_per_s: f64,
}

impl Span {
    pub(crate) const STILL: Self = Self {
        start_s: 0.0,
        end_s: 0.0,
        speed_max_m_per_s: 0.0,
    };
}

pub(crate) type Moving<'a> = (&'a Shape, &'a dyn Fn(f64) -> DVec3);

pub(crate) fn first_meeting(one: Moving<'_>, other: Moving<'_>, span: &Span) -> Option<Meeting> {
    let swept = |bounds: Bounds, moved_m: &dyn Fn(f64) -> DVec3| {
        bounds.swept(moved_m(span.start_s), moved_m(span.end_s))
    };
    let mut first: Option<Meeting> = None;
    for piece in &one.0.pieces {
        let bounds = swept(piece.bounds, one.1);
        if !bounds.meets(&swept(other.0.bounds, other.1)) {
            continue;
        }
        for other_piece in &other.0.pieces {
            if !bounds.meets(&swept(other_piece.bounds, other.1)) {
                continue;
            }
            let gap_at = |time_s: f64| {
                let (moved_m, other_moved_m) = (one.1(time_s), other.1(time_s));
                let gap = gap(&piece.points, moved_m - other_moved_m, &other_piece.points);
                Gap {
                    middle_m: gap.middle_m + other_moved_m,
                    ..gap
                }
            };
            // Only contacts before the first one found matter.
            let span = Span {
                end_s: first.map_or(span.end_s, |first| first.time_s),
                ..*span
            };
            let sooner = |found: &Meeting| first.is_none_or(|first| found.time_s < first.time_s);
            first = advance(&gap_at, &span).filter(sooner).or(first);
            if first.is_some_and(|first| first.time_s <= span.start_s) {
                return first;
            }
        }
    }
    first
}

fn advance(gap_at: &dyn Fn(f64) -> Gap, span: &Span) -> Option<Meeting> {
    let (start_s, end_s, speed) = (span.start_s, span.end_s, span.speed_max_m_per_s);
    let step_min_m = STEP_M.max(speed * (end_s - start_s) / STEPS_MAX);
    let (mut free_s, mut time_s) = (start_s, start_s);
    loop {
        let gap = gap_at(time_s);
        if gap.distance_m <= 0.0 {
            return Some(refined(gap_at, free_s, (time_s, gap)));
        }
        if time_s >= end_s || speed <= 0.0 {
            return None;
        }
        free_s = time_s;
        time_s = (time_s + gap.distance_m.max(step_min_m) / speed).min(end_s);
    }
}

/// Finds the start of the contact between a free time and a time of contact.
fn refined(gap_at: &dyn Fn(f64) -> Gap, mut free_s: f64, mut met: (f64, Gap)) -> Meeting {
    for _ in 0..HALVINGS {
        let middle_s = 0.5 * (free_s + met.0);
        let gap = gap_at(middle_s);
        if gap.distance_m <= 0.0 {
            met = (middle_s, gap);
        } else {
            free_s = middle_s;
        }
    }
    Meeting {
        time_s: met.0,
        place_m: met.1.middle_m,
    }
}
