//! Reads when a person changes its posture: the column `posture` of its trajectory.

use crate::file::reader::Read;
use crate::file::waypoints::{Keeps, POSTURE, Waypoint};
use crate::model::{Keep, Stop};
use crate::text::Utc;
use grideye_text::Table;

/// The posture at each waypoint; empty without that column.
pub(crate) fn keeps(
    table: &Table<'_>,
    (waypoints, starts_utc): (&[Waypoint], Option<Utc>),
) -> Read<Vec<Keep>> {
    let column = waypoints.iter().map(|point| point.posture);
    let Some(column) = column.collect::<Option<Vec<Keeps>>>() else {
        return Ok(Vec::new());
    };
    let Some(person) = table.table("person") else {
        let hint = "its trajectory has a column posture: write person = {}, or delete the column";
        return Err(table.missing("person", hint).into());
    };
    if let Some(posture) = person.get("posture") {
        let hint = "the trajectory's column posture says it for every waypoint; remove the key or the column";
        let both = [POSTURE, "a column posture"];
        return Err(table.conflict(posture.span().start, both, hint).into());
    }
    let times = waypoints.iter().map(|point| point.time_s(starts_utc));
    let Some(times) = times.collect::<Option<Vec<f64>>>() else {
        let hint = "a change of posture takes the time between two waypoints: add a column t_s or utc to the trajectory";
        return Err(table.missing("t_s", hint).into());
    };
    check_ways_in(waypoints, &column)?;
    let stops = waypoints.iter().zip(times).zip(column);
    let stops = stops.map(|((point, from_s), keeps)| Stop {
        at_mm: point.position_mm,
        from_s,
        stays_s: point.dwell_s,
        posture: keeps.posture(),
    });
    Ok(Keep::all(&stops.collect::<Vec<_>>()))
}

/// Who enters is outside before and inside after; who leaves is inside before and outside after.
fn check_ways_in(waypoints: &[Waypoint], column: &[Keeps]) -> Read<()> {
    use Keeps::{Away, Enter, Leave, Posture};
    for (index, (point, keeps)) in waypoints.iter().zip(column).enumerate() {
        let before = index.checked_sub(1).and_then(|before| column.get(before));
        let after = column.get(index + 1);
        let (problem, hint) = match (before, keeps, after) {
            (Some(Posture(_) | Enter), Enter, _) => (
                "`enter`, but the person is in the room already",
                "`enter` marks only the waypoint where it comes in: give the next one walk, stand, sit or lie",
            ),
            (_, Enter, Some(Posture(_))) | (Some(Posture(_)), Leave, None | Some(Enter | Away)) => {
                continue;
            }
            (_, Enter, _) => (
                "`enter`, but no waypoint in the room after it",
                "add one with walk, stand, sit or lie, also on a straight way from `enter` to `leave`",
            ),
            (Some(Posture(_)), Leave, _) => (
                "`leave`, but the person goes on in the room",
                "`leave` marks only the waypoint where it goes out; where it comes in again, write `enter`",
            ),
            (_, Leave, _) => (
                "`leave`, but the person is not in the room",
                "`leave` marks only the waypoint where it goes out: give the one before walk, stand, sit or lie",
            ),
            (_, Posture(_) | Away, _) => continue,
        };
        let found = format!("found {problem}");
        return Err(point.place.clone().refused(found, hint).into());
    }
    Ok(())
}
