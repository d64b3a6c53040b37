//! Orders pieces from far to near, so that each may be painted over those before it.

use super::camera::{Camera, Plane};
use glam::DVec3;
use grideye_scene::count;

#[derive(Debug, Clone)]
pub(super) struct Piece {
    /// Corners of a face, ends of a line, or one point.
    pub(super) points_m: Vec<DVec3>,
    /// For each corner of a face, whether to draw the edge that starts there.
    pub(super) edges: Vec<bool>,
    pub(super) paint: Paint,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Paint {
    /// A face: red, green, blue, and its opacity.
    Face {
        fill: [u8; 3],
        opacity: f64,
        edge: [u8; 3],
    },
    /// A dotted line.
    Line { color: [u8; 3] },
    /// A circle of this radius on the page.
    Circle { color: [u8; 3], radius: f64 },
}

impl Piece {
    /// A face with all its edges.
    pub(super) fn face(points_m: Vec<DVec3>, fill: [u8; 3], opacity: f64, edge: [u8; 3]) -> Self {
        Self {
            edges: vec![true; points_m.len()],
            points_m,
            paint: Paint::Face {
                fill,
                opacity,
                edge,
            },
        }
    }

    /// A line, a point, or a face to which corners will be added.
    pub(super) const fn without_edges(points_m: Vec<DVec3>, paint: Paint) -> Self {
        Self {
            points_m,
            edges: Vec::new(),
            paint,
        }
    }
}

/// The pieces from far to near, cut by each face's plane in turn (Fuchs, Kedem and Naylor 1980), on a stack.
pub(super) fn far_to_near(pieces: Vec<Piece>, camera: &Camera) -> Vec<Piece> {
    let mut ordered = Vec::with_capacity(pieces.len());
    let mut tasks = vec![Task::Divide(pieces)];
    while let Some(task) = tasks.pop() {
        match task {
            Task::Paint(pieces) => ordered.extend(pieces),
            Task::Divide(mut pieces) => match divider(&pieces) {
                None => ordered.extend(pieces),
                Some((index, plane)) => {
                    // The face is in its own plane despite rounding, so every task gets smaller by at least one piece.
                    let own = pieces.swap_remove(index);
                    let mut divided = divide(pieces, &turned_to(plane, camera));
                    divided.within.push(own);
                    // The last task is done first.
                    tasks.push(Task::Divide(divided.before));
                    tasks.push(Task::Paint(divided.within));
                    tasks.push(Task::Divide(divided.behind));
                }
            },
        }
    }
    ordered
}

/// The part of a convex face on the side that the plane's normal points to; the edge along the cut is not drawn.
pub(super) fn clipped(piece: &Piece, plane: &Plane) -> Option<Piece> {
    cut(piece, plane).1
}

enum Task {
    Divide(Vec<Piece>),
    Paint(Vec<Piece>),
}

#[derive(Default)]
struct Divided {
    behind: Vec<Piece>,
    within: Vec<Piece>,
    before: Vec<Piece>,
}

fn turned_to(plane: Plane, camera: &Camera) -> Plane {
    if camera.side_of(&plane) >= 0.0 {
        plane
    } else {
        plane.opposite()
    }
}

/// Among a few faces, finds one with a plane that cuts few others and leaves halves of similar size.
fn divider(pieces: &[Piece]) -> Option<(usize, Plane)> {
    let plane = |index: usize| {
        let piece = &pieces[index];
        let is_face = matches!(piece.paint, Paint::Face { .. });
        let plane = Plane::of_face(&piece.points_m).filter(|_| is_face);
        plane.map(|plane| (index, plane))
    };
    let step = pieces.len().div_ceil(CANDIDATES).max(1);
    (0..pieces.len())
        .step_by(step)
        .filter_map(plane)
        .min_by_key(|(_, plane)| cost(plane, pieces))
        .or_else(|| (0..pieces.len()).find_map(plane))
}

fn cost(plane: &Plane, pieces: &[Piece]) -> usize {
    let (mut behind, mut before, mut both) = (0_usize, 0_usize, 0_usize);
    for piece in pieces {
        let (lowest, highest) = reach_m(piece, plane);
        match (lowest < -SLACK_M, highest > SLACK_M) {
            (true, true) => both += 1,
            (true, false) => behind += 1,
            (false, true) => before += 1,
            (false, false) => {}
        }
    }
    8 * both + behind.abs_diff(before)
}

fn reach_m(piece: &Piece, plane: &Plane) -> (f64, f64) {
    let heights = piece.points_m.iter().map(|point| plane.height_m(*point));
    count::range(heights)
}

fn divide(pieces: Vec<Piece>, plane: &Plane) -> Divided {
    let mut divided = Divided::default();
    for piece in pieces {
        let (lowest, highest) = reach_m(&piece, plane);
        let is_face = matches!(piece.paint, Paint::Face { .. });
        match (lowest < -SLACK_M, highest > SLACK_M) {
            (true, true) => {
                let (behind, before) = cut(&piece, plane);
                divided.behind.extend(behind);
                divided.before.extend(before);
            }
            (true, false) => divided.behind.push(piece),
            (false, false) if is_face => divided.within.push(piece),
            // A line on a face is drawn over it.
            _ => divided.before.push(piece),
        }
    }
    divided
}

fn cut(piece: &Piece, plane: &Plane) -> (Option<Piece>, Option<Piece>) {
    if let Paint::Line { .. } = piece.paint {
        return cut_line(piece, plane);
    }
    let empty = || Piece::without_edges(Vec::new(), piece.paint);
    let (mut below, mut above) = (empty(), empty());
    let corners = piece.points_m.len();
    for index in 0..corners {
        let (point, next) = (piece.points_m[index], piece.points_m[(index + 1) % corners]);
        let drawn = piece.edges.get(index).copied().unwrap_or(false);
        let (height, next_height) = (plane.height_m(point), plane.height_m(next));
        let crosses = (height < 0.0 && next_height > 0.0) || (height > 0.0 && next_height < 0.0);
        let crossing = point.lerp(next, height / (height - next_height));
        for (part, sign) in [(&mut below, -1.0), (&mut above, 1.0)] {
            let (here, there) = (sign * height, sign * next_height);
            if here >= 0.0 {
                part.points_m.push(point);
                // Along the plane or out of it, the next edge is the cut.
                part.edges
                    .push(drawn && (here > 0.0 || there > 0.0 || next_height == 0.0));
            }
            if crosses {
                part.points_m.push(crossing);
                part.edges.push(drawn && there > 0.0);
            }
        }
    }
    (solid_part(below), solid_part(above))
}

fn cut_line(piece: &Piece, plane: &Plane) -> (Option<Piece>, Option<Piece>) {
    let [from, to] = piece.points_m[..] else {
        return (None, Some(piece.clone()));
    };
    let (start, end) = (plane.height_m(from), plane.height_m(to));
    let crossing = from.lerp(to, start / (start - end));
    let part = |points_m: [DVec3; 2]| {
        Some(Piece {
            points_m: points_m.to_vec(),
            ..piece.clone()
        })
    };
    match (start < 0.0, end < 0.0) {
        (true, true) => (part([from, to]), None),
        (false, false) => (None, part([from, to])),
        (true, false) => (part([from, crossing]), part([crossing, to])),
        (false, true) => (part([crossing, to]), part([from, crossing])),
    }
}

fn solid_part(part: Piece) -> Option<Piece> {
    (part.points_m.len() >= 3).then_some(part)
}

const CANDIDATES: usize = 6;
const SLACK_M: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::super::camera::Panel;
    use super::*;

    fn camera() -> Camera {
        let bounds_m = (DVec3::ZERO, DVec3::splat(4.0));
        Camera::from_above(bounds_m, &Panel::new(0.0, 0.0, 400.0, 400.0))
    }

    fn face(color: u8, corners: [DVec3; 4]) -> Piece {
        Piece::face(corners.to_vec(), [color, 0, 0], 1.0, [0; 3])
    }

    fn level(color: u8, height: f64) -> Piece {
        let corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)];
        face(color, corners.map(|(x, y)| DVec3::new(x, y, height)))
    }

    fn line(from: [f64; 3], to: [f64; 3]) -> Piece {
        let points_m = [from, to].map(DVec3::from_array).to_vec();
        Piece::without_edges(points_m, Paint::Line { color: [9, 0, 0] })
    }

    fn colors(pieces: &[Piece]) -> Vec<u8> {
        let color = |piece: &Piece| match piece.paint {
            Paint::Face { fill, .. } => fill[0],
            Paint::Line { color } | Paint::Circle { color, .. } => color[0],
        };
        pieces.iter().map(color).collect()
    }

    #[test]
    fn seen_from_above_higher_faces_are_painted_later_in_any_input_order() {
        for order in [[1, 2, 3], [3, 1, 2], [2, 3, 1], [3, 2, 1]] {
            let pieces = order.map(|color| level(color, f64::from(color)));
            assert_eq!(colors(&far_to_near(pieces.to_vec(), &camera())), [1, 2, 3]);
        }
    }

    /// Each overlaps the next and the last overlaps the first, so no order of whole faces is right.
    #[test]
    fn faces_that_overlap_in_a_circle_are_cut() {
        let bar = |color, from: [f64; 3], to: [f64; 3], wide: [f64; 3]| {
            let [a, b, w] = [from, to, wide].map(DVec3::from_array);
            face(color, [a - w, b - w, b + w, a + w])
        };
        let pieces = vec![
            bar(1, [0.0, 1.0, 1.0], [4.0, 1.0, 2.0], [0.0, 0.3, 0.0]),
            bar(2, [3.0, 0.0, 1.0], [3.0, 4.0, 2.0], [0.3, 0.0, 0.0]),
            bar(3, [4.0, 3.0, 1.0], [0.0, 3.0, 2.0], [0.0, 0.3, 0.0]),
            bar(4, [1.0, 4.0, 1.0], [1.0, 0.0, 2.0], [0.3, 0.0, 0.0]),
        ];
        let ordered = far_to_near(pieces, &camera());
        assert!(ordered.len() > 4);
        // The piece painted last at a crossing must be the highest bar there.
        for (x, y) in [(1.0, 1.0), (3.0, 1.0), (3.0, 3.0), (1.0, 3.0)] {
            let at = DVec3::new(x, y, 0.0);
            let height = |piece: &Piece| {
                let plane = Plane::of_face(&piece.points_m).unwrap();
                -plane.height_m(at) / plane.normal.z
            };
            let there = ordered.iter().filter(|piece| covers(piece, x, y));
            let heights: Vec<f64> = there.map(height).collect();
            assert!(heights.len() >= 2, "{heights:?}");
            let highest = heights.iter().copied().fold(f64::MIN, f64::max);
            assert_eq!(heights.last(), Some(&highest), "{heights:?} at {x}, {y}");
        }
    }

    fn covers(piece: &Piece, x: f64, y: f64) -> bool {
        let points = &piece.points_m;
        let turn = |index: usize| {
            let (a, b) = (points[index], points[(index + 1) % points.len()]);
            (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x)
        };
        (0..points.len()).all(|index| turn(index) >= -1e-9)
            || (0..points.len()).all(|index| turn(index) <= 1e-9)
    }

    #[test]
    fn a_line_is_hidden_below_a_face() {
        let pieces = vec![line([2.0, 2.0, 0.0], [2.0, 2.0, 4.0]), level(1, 2.0)];
        assert_eq!(colors(&far_to_near(pieces, &camera())), [9, 1, 9]);
    }

    #[test]
    fn a_line_in_a_face_is_painted_over_it_from_either_side() {
        let line = line([1.0, 2.0, 2.0], [3.0, 2.0, 2.0]);
        let mut downwards = level(1, 2.0);
        downwards.points_m.reverse();
        for sheet in [level(1, 2.0), downwards] {
            let pieces = vec![line.clone(), level(3, 3.0), sheet, level(2, 1.0)];
            assert_eq!(colors(&far_to_near(pieces, &camera())), [2, 1, 9, 3]);
        }
    }

    #[test]
    fn cutting_keeps_the_area_and_draws_no_edge_along_the_cut() {
        let square = level(1, 1.0);
        let (below, above) = cut(&square, &Plane::new(DVec3::X, 1.0));
        let area = |piece: &Piece| {
            let points = &piece.points_m;
            let sum: f64 = (0..points.len())
                .map(|index| points[index].cross(points[(index + 1) % points.len()]).z)
                .sum();
            0.5 * sum
        };
        let (below, above) = (below.unwrap(), above.unwrap());
        assert!((area(&below) - 4.0).abs() < 1e-12 && (area(&above) - 12.0).abs() < 1e-12);
        for part in [below, above] {
            let hidden: Vec<usize> = (0..part.edges.len())
                .filter(|corner| !part.edges[*corner])
                .collect();
            assert_eq!(hidden.len(), 1, "{part:?}");
            for end in [hidden[0], (hidden[0] + 1) % part.points_m.len()] {
                assert!((part.points_m[end].x - 1.0).abs() < 1e-12);
            }
        }
    }
}
