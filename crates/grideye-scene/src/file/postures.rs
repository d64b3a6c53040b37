//! Reads when a person changes its posture: the column `posture` of its trajectory.

use crate::file::document::AgentTable;
use crate::file::reader::{Read, Reader};
use crate::file::waypoints::{Keeps, POSTURE, Waypoint};
use crate::model::Keep;
use crate::text::Utc;
use glam::DVec3;
use toml::Spanned;

/// The posture at each waypoint; empty without that column.
pub(crate) fn keeps(
    reader: &Reader<'_>,
    table: &Spanned<AgentTable>,
    (waypoints, starts_utc): (&[Waypoint], Option<Utc>),
) -> Read<Vec<Keep>> {
    let keys = table.get_ref();
    let column = waypoints.iter().map(|point| point.posture);
    let Some(column) = column.collect::<Option<Vec<Keeps>>>() else {
        return Ok(Vec::new());
    };
    let title = format!("agent `{}`", keys.name.get_ref());
    let start = table.span().start;
    let Some(person) = &keys.person else {
        let hint = "its trajectory has a column posture: write person = {}, or delete the column";
        return Err(reader.missing(start, &title, "person", hint));
    };
    if let Some(posture) = &person.get_ref().posture {
        let hint = "the trajectory's column posture says it for every waypoint; remove the key or the column";
        let both = [POSTURE, "a column posture"];
        return Err(reader.conflict(posture.span().start, &title, both, hint));
    }
    let times = waypoints.iter().map(|point| point.time_s(starts_utc));
    let Some(times) = times.collect::<Option<Vec<f64>>>() else {
        let hint = "a change of posture takes the time between two waypoints: add a column t_s or utc to the trajectory";
        return Err(reader.missing(start, &title, "t_s", hint));
    };
    let mut from_mm = None;
    let keeps = waypoints.iter().zip(times).zip(column);
    let keeps = keeps.map(|((point, from_s), keeps)| {
        let came_mm = point.position_mm - from_mm.unwrap_or(point.position_mm);
        from_mm = Some(point.position_mm);
        let along = came_mm.with_z(0.0).try_normalize();
        Keep {
            from_s,
            until_s: from_s + point.dwell_s,
            posture: keeps.posture(),
            along: along.unwrap_or(DVec3::ZERO),
        }
    });
    Ok(keeps.collect())
}
