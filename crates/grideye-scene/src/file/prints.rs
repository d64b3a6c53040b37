//! Finds the warm prints of a scene: places where a body's base rests on an object with a material.

use super::reader::Read;
use crate::geometry::{Mesh, area_vector, clipped, hull, range};
use crate::heat::Material;
use crate::model::{Agent, Body, Print, Scene, limits};
use crate::motion::Stay;
use glam::{DMat3, DVec3};
use grideye_text::Source;
use std::time::Duration;

pub(crate) fn prints(source: &Source<'_>, scene: &Scene) -> Read<Vec<Print>> {
    let mut prints = Vec::new();
    let hint = "give `material` only to objects that people sit or lie on";
    for (index, object) in scene.objects.iter().enumerate() {
        let Some(material) = object.thermal.material else {
            continue;
        };
        for agent in &scene.agents {
            for stay in stays(agent) {
                on_object(&mut prints, (index, object, material), agent, stay);
                source.check_count("warm prints", prints.len(), (limits::PRINTS_MAX, 0), hint)?;
            }
        }
    }
    Ok(prints)
}

fn stays(agent: &Agent) -> Vec<Stay> {
    let mut stays = match &agent.trajectory {
        Some(trajectory) => trajectory.stays(),
        None => vec![Stay {
            from_s: 0.0,
            until_s: f64::INFINITY,
        }],
    };
    let is_here = |stay: &Stay| {
        let middle_s = 0.5 * (stay.from_s + stay.until_s.min(limits::TIME_MAX_S));
        Duration::try_from_secs_f64(middle_s).is_ok_and(|middle| agent.is_here(middle))
    };
    stays.retain(is_here);
    stays
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
        let below = standing.vertices_m().iter().map(|at| at.truncate());
        let below = hull(below.collect());
        for (number, face) in object.mesh.faces().enumerate() {
            let corners: Vec<DVec3> = face.iter().map(|corner| vertices_m[*corner]).collect();
            let (bottom_m, top_m) = range(corners.iter().map(|corner| corner.z));
            let is_level =
                top_m - bottom_m < ABOVE_M && area_vector(corners.iter().copied()).z > 0.0;
            if !is_level || low.z > top_m + NEAR_M || high.z <= top_m {
                continue;
            }
            let sides = below.iter().zip(below.iter().cycle().skip(1));
            let print = sides.fold(corners, |rest, (from, to)| {
                let inside = |point: DVec3| (*to - *from).perp_dot(point.truncate() - *from);
                clipped(&rest, inside)
            });
            let offset_c = object.thermal.offsets_c.get(number).copied();
            let corners: Vec<i64> = (0..).take(print.len()).collect();
            let Ok(sheet) = Mesh::new(print, &[corners]) else {
                // No part of the body is above this face.
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

/// A body rests on a face if its base is at most this far above it, or below it, meters.
const NEAR_M: f64 = 0.02;

/// Height of a print above its face, meters: more than rounding of depths, less than anyone sees.
const ABOVE_M: f64 = 1e-5;
