//! Orders faces from far to near for any eye: they are cut once where they meet (Fuchs, Kedem and Naylor 1980).

use crate::plane::Plane;
use glam::{DMat3, DVec3};
use grideye_scene::count;

/// The part of one surface that one pixel sees.
#[derive(Debug, Clone)]
pub(super) struct Footprint {
    /// The index of its sensor in the scene.
    pub(super) sensor: usize,
    pub(super) pixel: usize,
    pub(super) corners_m: Vec<DVec3>,
}

/// A flat convex face.
#[derive(Debug, Clone)]
pub(super) struct Face {
    /// The index of its shape.
    pub(super) shape: usize,
    pub(super) corners_m: Vec<DVec3>,
    /// For each corner, whether the edge that starts there is drawn.
    pub(super) edges: Vec<bool>,
    /// What pixels see of it.
    pub(super) footprints: Vec<Footprint>,
}

/// An ellipsoid.
#[derive(Debug, Clone)]
pub(super) struct Round {
    /// The index of its shape.
    pub(super) shape: usize,
    pub(super) center_m: DVec3,
    /// Its semi-axes as columns.
    pub(super) axes_m: DMat3,
    /// What pixels see of it.
    pub(super) footprints: Vec<Footprint>,
}

#[derive(Debug, Clone, Copy)]
pub(super) enum Drawn<'a> {
    Face(&'a Face),
    Round(&'a Round),
}

/// The first node is the root; each splits space by its plane.
#[derive(Debug, Default)]
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
}

#[derive(Debug)]
pub(super) struct Node {
    pub(super) plane: Plane,
    /// The faces in the plane.
    pub(super) faces: Vec<Face>,
    /// The nodes behind the plane and before it.
    pub(super) sides: [Option<usize>; 2],
}

impl Tree {
    pub(super) fn new(faces: Vec<Face>) -> Self {
        let mut nodes: Vec<Node> = Vec::new();
        let mut tasks = vec![(faces, None)];
        while let Some((mut faces, parent)) = tasks.pop() {
            let Some((index, plane)) = divider(&faces) else {
                continue;
            };
            // The face is in its own plane despite rounding, so every task gets smaller by at least one face.
            let mut within = vec![faces.swap_remove(index)];
            let mut sides = [Vec::new(), Vec::new()];
            for face in faces {
                match reach(&face, &plane) {
                    (false, false) => within.push(face),
                    (true, false) => sides[0].push(face),
                    (false, true) => sides[1].push(face),
                    (true, true) => {
                        let parts = cut(&face, &plane).into_iter().zip(&mut sides);
                        parts
                            .filter(|(part, _)| part.corners_m.len() > 2)
                            .for_each(|(part, side)| side.push(part));
                    }
                }
            }
            let number = nodes.len();
            nodes.push(Node {
                plane,
                faces: within,
                sides: [None; 2],
            });
            if let Some((parent, side)) = parent {
                let parent: &mut Node = &mut nodes[parent];
                parent.sides[side] = Some(number);
            }
            let sides = sides.into_iter().enumerate();
            tasks.extend(sides.map(|(side, faces)| (faces, Some((number, side)))));
        }
        Self { nodes }
    }

    /// Everything from far to near. Ellipsoids are not cut: each is where its center is. `side_of` is positive if the eye
    /// is before a plane.
    pub(super) fn far_to_near<'a>(
        &'a self,
        rounds: impl Iterator<Item = &'a Round>,
        side_of: impl Fn(&Plane) -> f64,
        depth_m: impl Fn(DVec3) -> f64,
    ) -> Vec<Drawn<'a>> {
        let mut drawn = Vec::new();
        let root = (!self.nodes.is_empty()).then_some(0);
        let mut tasks = vec![Task::Beyond(root, rounds.collect::<Vec<_>>())];
        while let Some(task) = tasks.pop() {
            match task {
                Task::Faces(node) => drawn.extend(node.faces.iter().map(Drawn::Face)),
                Task::Beyond(None, mut rounds) => {
                    let depth_m = |round: &&Round| depth_m(round.center_m);
                    rounds.sort_by(|one, other| depth_m(other).total_cmp(&depth_m(one)));
                    drawn.extend(rounds.into_iter().map(Drawn::Round));
                }
                Task::Beyond(Some(node), rounds) => {
                    let node = &self.nodes[node];
                    let is_before = |round: &&Round| node.plane.height_m(round.center_m) >= 0.0;
                    let (before, behind) = rounds.into_iter().partition(is_before);
                    let mut sides = [
                        Task::Beyond(node.sides[0], behind),
                        Task::Faces(node),
                        Task::Beyond(node.sides[1], before),
                    ];
                    // The last task is done first.
                    if side_of(&node.plane) >= 0.0 {
                        sides.reverse();
                    }
                    tasks.extend(sides);
                }
            }
        }
        drawn
    }
}

enum Task<'a> {
    Faces(&'a Node),
    Beyond(Option<usize>, Vec<&'a Round>),
}

/// Among a few faces, the one with a plane that cuts the fewest others.
fn divider(faces: &[Face]) -> Option<(usize, Plane)> {
    let plane = |index: usize| Some((index, Plane::of_face(&faces[index].corners_m)?));
    let cuts = |plane: &Plane| {
        let faces = faces.iter();
        faces
            .filter(|face| reach(face, plane) == (true, true))
            .count()
    };
    let mut best: Option<(usize, usize, Plane)> = None;
    for candidate in 0..CANDIDATES.min(faces.len()) {
        // From all over the list, and not always the same side of a box.
        let index = (candidate * faces.len() / CANDIDATES + candidate) % faces.len();
        let Some((index, plane)) = plane(index) else {
            continue;
        };
        let cuts = cuts(&plane);
        if best.is_none_or(|(fewest, ..)| cuts < fewest) {
            best = Some((cuts, index, plane));
        }
        if cuts == 0 {
            break;
        }
    }
    match best {
        Some((_, index, plane)) => Some((index, plane)),
        None => (0..faces.len()).find_map(plane),
    }
}

/// Whether a face reaches behind a plane, and before it.
fn reach(face: &Face, plane: &Plane) -> (bool, bool) {
    let heights = face.corners_m.iter().map(|corner| plane.height_m(*corner));
    let (lowest, highest) = count::range(heights);
    (lowest < -SLACK_M, highest > SLACK_M)
}

/// The parts behind a plane and before it; the edge along the cut is not drawn.
fn cut(face: &Face, plane: &Plane) -> [Face; 2] {
    let empty = || Face {
        shape: face.shape,
        corners_m: Vec::new(),
        edges: Vec::new(),
        footprints: Vec::new(),
    };
    let mut parts = [empty(), empty()];
    let corners = face.corners_m.len();
    for index in 0..corners {
        let (corner, next) = (face.corners_m[index], face.corners_m[(index + 1) % corners]);
        let drawn = face.edges.get(index).copied().unwrap_or(false);
        let (height, next_height) = (plane.height_m(corner), plane.height_m(next));
        let crosses = height * next_height < 0.0;
        for (part, sign) in parts.iter_mut().zip([-1.0, 1.0]) {
            let (here, there) = (sign * height, sign * next_height);
            if here >= 0.0 {
                part.corners_m.push(corner);
                // Along the plane or out of it, the next edge is the cut.
                part.edges
                    .push(drawn && (here > 0.0 || there > 0.0 || next_height == 0.0));
            }
            if crosses {
                let crossing = corner.lerp(next, height / (height - next_height));
                part.corners_m.push(crossing);
                part.edges.push(drawn && there > 0.0);
            }
        }
    }
    parts
}

const CANDIDATES: usize = 8;
const SLACK_M: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::*;

    fn face(shape: usize, corners: [DVec3; 4]) -> Face {
        Face {
            shape,
            corners_m: corners.to_vec(),
            edges: vec![true; 4],
            footprints: Vec::new(),
        }
    }

    fn level(shape: usize, height: f64) -> Face {
        let corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)];
        face(shape, corners.map(|(x, y)| DVec3::new(x, y, height)))
    }

    /// Seen from straight above.
    fn from_above<'a>(tree: &'a Tree, rounds: &'a [Round]) -> Vec<Drawn<'a>> {
        tree.far_to_near(rounds.iter(), |plane| plane.normal.z, |at| -at.z)
    }

    fn shapes(drawn: &[Drawn<'_>]) -> Vec<usize> {
        let shape = |one: &Drawn<'_>| match one {
            Drawn::Face(face) => face.shape,
            Drawn::Round(round) => round.shape,
        };
        drawn.iter().map(shape).collect()
    }

    #[test]
    fn seen_from_above_higher_faces_are_painted_later_in_any_input_order() {
        for order in [[1, 2, 3], [3, 1, 2], [2, 3, 1], [3, 2, 1]] {
            let tree = Tree::new(
                order
                    .map(|height: u8| level(height.into(), height.into()))
                    .to_vec(),
            );
            assert_eq!(shapes(&from_above(&tree, &[])), [1, 2, 3]);
        }
    }

    /// Each overlaps the next and the last overlaps the first, so no order of whole faces is right.
    #[test]
    fn faces_that_overlap_in_a_circle_are_cut() {
        let bar = |shape, from: [f64; 3], to: [f64; 3], wide: [f64; 3]| {
            let [a, b, w] = [from, to, wide].map(DVec3::from_array);
            face(shape, [a - w, b - w, b + w, a + w])
        };
        let tree = Tree::new(vec![
            bar(1, [0.0, 1.0, 1.0], [4.0, 1.0, 2.0], [0.0, 0.3, 0.0]),
            bar(2, [3.0, 0.0, 1.0], [3.0, 4.0, 2.0], [0.3, 0.0, 0.0]),
            bar(3, [4.0, 3.0, 1.0], [0.0, 3.0, 2.0], [0.0, 0.3, 0.0]),
            bar(4, [1.0, 4.0, 1.0], [1.0, 0.0, 2.0], [0.3, 0.0, 0.0]),
        ]);
        let ordered = from_above(&tree, &[]);
        assert!(ordered.len() > 4);
        // The face painted last at a crossing must be the highest bar there.
        for (x, y) in [(1.0, 1.0), (3.0, 1.0), (3.0, 3.0), (1.0, 3.0)] {
            let height = |face: &Face| {
                let plane = Plane::of_face(&face.corners_m).unwrap();
                -plane.height_m(DVec3::new(x, y, 0.0)) / plane.normal.z
            };
            let there = ordered.iter().filter_map(|drawn| match drawn {
                Drawn::Face(face) if covers(face, x, y) => Some(height(face)),
                _ => None,
            });
            let heights: Vec<f64> = there.collect();
            assert!(heights.len() >= 2, "{heights:?}");
            let highest = heights.iter().copied().fold(f64::MIN, f64::max);
            assert_eq!(heights.last(), Some(&highest), "{heights:?} at {x}, {y}");
        }
    }

    fn covers(face: &Face, x: f64, y: f64) -> bool {
        let corners = &face.corners_m;
        let turn = |index: usize| {
            let (a, b) = (corners[index], corners[(index + 1) % corners.len()]);
            (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x)
        };
        (0..corners.len()).all(|index| turn(index) >= -1e-9)
            || (0..corners.len()).all(|index| turn(index) <= 1e-9)
    }

    #[test]
    fn ellipsoids_are_between_the_faces_around_their_centers() {
        let round = |shape, z: f64| Round {
            shape,
            center_m: DVec3::new(2.0, 2.0, z),
            axes_m: DMat3::IDENTITY,
            footprints: Vec::new(),
        };
        let mut downwards = level(1, 2.0);
        downwards.corners_m.reverse();
        for sheet in [level(1, 2.0), downwards] {
            let rounds = [round(9, 3.5), round(8, 1.0), round(7, 0.5), round(6, 2.1)];
            let tree = Tree::new(vec![level(3, 3.0), sheet]);
            assert_eq!(shapes(&from_above(&tree, &rounds)), [7, 8, 1, 6, 3, 9]);
            let alone = Tree::default();
            assert_eq!(shapes(&from_above(&alone, &rounds)), [7, 8, 6, 9]);
        }
    }

    #[test]
    fn cutting_keeps_the_area_and_draws_no_edge_along_the_cut() {
        let square = level(1, 1.0);
        let parts = cut(
            &square,
            &Plane {
                normal: DVec3::X,
                offset_m: 1.0,
            },
        );
        let area = |face: &Face| {
            let corners = &face.corners_m;
            let sum: f64 = (0..corners.len())
                .map(|index| corners[index].cross(corners[(index + 1) % corners.len()]).z)
                .sum();
            0.5 * sum
        };
        assert!((area(&parts[0]) - 4.0).abs() < 1e-12 && (area(&parts[1]) - 12.0).abs() < 1e-12);
        for part in parts {
            let hidden: Vec<usize> = (0..part.edges.len())
                .filter(|corner| !part.edges[*corner])
                .collect();
            assert_eq!(hidden.len(), 1, "{part:?}");
            for end in [hidden[0], (hidden[0] + 1) % part.corners_m.len()] {
                assert!((part.corners_m[end].x - 1.0).abs() < 1e-12);
            }
        }
    }
}
