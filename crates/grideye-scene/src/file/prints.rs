//! Finds the warm prints of a scene: where the underside of a body rests on an object that keeps them.

use super::source::Source;
use crate::geometry::mesh::Mesh;
use crate::geometry::polygon::clipped;
use crate::heat::transient::Material;
use crate::model::body::{Agent, Body};
use crate::model::error::SceneError;
use crate::model::limits;
use crate::model::print::Print;
use crate::model::scene::Scene;
use crate::motion::trajectory::Stay;
use glam::{DMat3, DVec3};

/// All prints of a scene.
pub(crate) fn prints(source: &Source<'_>, scene: &Scene) -> Result<Vec<Print>, SceneError> {
    let mut prints = Vec::new();
    for (index, object) in scene.objects.iter().enumerate() {
        let Some(material) = object.thermal.material else {
            continue;
        };
        for agent in &scene.agents {
            for stay in stays(agent) {
                on_object(&mut prints, (index, object, material), agent, stay);
                source.check_count(
                    "warm prints",
                    prints.len(),
                    limits::PRINTS_MAX,
                    0,
                    "give `material` only to what somebody really sits or lies on",
                )?;
            }
        }
    }
    Ok(prints)
}

fn stays(agent: &Agent) -> Vec<Stay> {
    match &agent.trajectory {
        Some(trajectory) => trajectory.stays(),
        None => vec![Stay {
            from_s: 0.0,
            until_s: f64::INFINITY,
        }],
    }
}

fn on_object(
    prints: &mut Vec<Print>,
    (index, object, material): (usize, &Body, Material),
    agent: &Agent,
    contact: Stay,
) {
    let vertices_m = object.mesh.vertices_m();
    for part in &agent.parts {
        let standing = agent.standing(&part.mesh, contact.from_s);
        let (low, high) = standing.bounds_m();
        let below = outline_from_above(standing.vertices_m());
        for (number, face) in object.mesh.faces().enumerate() {
            let corners: Vec<DVec3> = face.iter().map(|corner| vertices_m[*corner]).collect();
            let (bottom_m, top_m) = heights(&corners);
            let is_level = top_m - bottom_m < ABOVE_M && runs_left(&corners);
            if !is_level || low.z > top_m + NEAR_M || high.z <= top_m {
                continue;
            }
            let print = below
                .iter()
                .zip(below.iter().cycle().skip(1))
                .fold(corners, |rest, (from, to)| {
                    clipped(&rest, |point| (*to - *from).cross(point - *from).z)
                });
            let offset_c = object.thermal.offsets_c.get(number).copied();
            let corners: Vec<i64> = (0..).take(print.len()).collect();
            let Ok(sheet) = Mesh::new(print, &[corners]) else {
                // Nothing of the body is above this face.
                continue;
            };
            prints.push(Print {
                sheet: sheet.placed(DMat3::IDENTITY, DVec3::new(0.0, 0.0, ABOVE_M)),
                object: index,
                offset_c: offset_c.unwrap_or(0.0),
                contact_c: part.surface.celsius,
                contact,
                material,
            });
        }
    }
}

fn heights(corners: &[DVec3]) -> (f64, f64) {
    let heights = corners.iter().map(|corner| corner.z);
    heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), height| {
        (low.min(height), high.max(height))
    })
}

/// Whether a polygon's corners run counter-clockwise as seen from above: the face looks upwards.
fn runs_left(corners: &[DVec3]) -> bool {
    let Some(anchor) = corners.first() else {
        return false;
    };
    let pairs = corners.windows(2);
    pairs
        .map(|pair| (pair[0] - *anchor).cross(pair[1] - *anchor).z)
        .sum::<f64>()
        > 0.0
}

/// The convex outline of points as seen from above, counter-clockwise (Andrew 1979).
fn outline_from_above(points: &[DVec3]) -> Vec<DVec3> {
    let mut sorted: Vec<DVec3> = points.iter().map(|point| point.with_z(0.0)).collect();
    sorted.sort_by(|one, other| one.x.total_cmp(&other.x).then(one.y.total_cmp(&other.y)));
    let half = |points: &mut dyn Iterator<Item = DVec3>| {
        let mut chain: Vec<DVec3> = Vec::new();
        for point in points {
            while let [.., before, last] = chain.as_slice() {
                if (*last - *before).cross(point - *last).z > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut outline = half(&mut sorted.iter().copied());
    outline.extend(half(&mut sorted.iter().rev().copied()));
    outline
}

/// A body whose underside is this near to a face, or in it, is on it, metres.
const NEAR_M: f64 = 0.02;

/// How far a print lies above its face, metres: more than the rounding of depths, less than anybody sees.
const ABOVE_M: f64 = 1e-5;
