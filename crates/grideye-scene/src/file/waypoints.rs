//! Reads the waypoints of a trajectory from its CSV file.

use crate::model::Posture;
use crate::model::limits::{TIME_MAX_S, WAYPOINTS_MAX};
use crate::text::{NoUtc, Utc};
use csv::{Position, StringRecord};
use glam::DVec3;
use grideye_text::{Place, Refusal, excerpt};

pub(crate) struct Waypoint {
    pub(crate) position_mm: DVec3,
    pub(crate) time: Option<Time>,
    pub(crate) dwell_s: f64,
    pub(crate) posture: Option<Keeps>,
    pub(crate) place: Place,
}

/// What the column `posture` says.
#[derive(Clone, Copy)]
pub(crate) enum Keeps {
    Posture(Posture),
    /// Not in the room until it leaves this waypoint.
    Enter,
    /// Not in the room from here on.
    Leave,
    /// Either; the only word for both in older files.
    Away,
}

impl Keeps {
    pub(crate) const fn posture(self) -> Option<Posture> {
        match self {
            Self::Posture(posture) => Some(posture),
            Self::Enter | Self::Leave | Self::Away => None,
        }
    }
}

#[derive(Clone, Copy)]
pub(crate) enum Time {
    /// Seconds of the scene.
    Scene(f64),
    Utc(Utc),
}

impl Waypoint {
    pub(crate) fn utc(&self) -> Option<Utc> {
        match self.time {
            Some(Time::Utc(utc)) => Some(utc),
            _ => None,
        }
    }

    /// The second of the scene at which the agent arrives.
    pub(crate) fn time_s(&self, starts_utc: Option<Utc>) -> Option<f64> {
        match self.time? {
            Time::Scene(time_s) => Some(time_s),
            Time::Utc(utc) => Some(utc.since_s(starts_utc?)),
        }
    }

    pub(crate) fn refused(&self, found: &str, expected: &str) -> Refusal {
        row_refused(self.place.clone(), found, expected)
    }
}

fn row_refused(place: Place, found: &str, expected: &str) -> Refusal {
    let hint = "a trajectory has the columns x_mm, y_mm, and optionally z_mm, t_s or utc, dwell_s and posture, in any order, and one waypoint per row";
    place.refused(format!("found {found}, expected {expected}"), hint)
}

pub(crate) const TIME: &str = "t_s";
pub(crate) const UTC: &str = "utc";
const AXES: [&str; 3] = ["x_mm", "y_mm", "z_mm"];
/// Without `z_mm`, the agent is on the floor.
const REQUIRED: [&str; 2] = ["x_mm", "y_mm"];
const DWELL: &str = "dwell_s";
pub(crate) const POSTURE: &str = "posture";
const COLUMNS: [&str; 7] = ["x_mm", "y_mm", "z_mm", TIME, UTC, DWELL, POSTURE];

/// Reads the columns that the header names, in its order; `#` comments and empty lines are skipped. A column that is not
/// known is refused, because it may be a misspelled one.
pub(crate) fn read_waypoints(file: &str, text: &str) -> Result<Vec<Waypoint>, Refusal> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut table = Table {
        file,
        text,
        columns: Vec::new(),
    };
    let mut rows = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(text.as_bytes())
        .into_records();
    let header = rows
        .next()
        .ok_or_else(|| table.too_short("an empty file"))?;
    let header = table.readable(header)?;
    table.columns = table.columns_of(&header)?;
    let mut waypoints = Vec::new();
    for row in rows {
        let way_point = table.way_point(&table.readable(row)?)?;
        if waypoints.len() == WAYPOINTS_MAX {
            let found = WAYPOINTS_MAX + 1;
            let problem = format!("{found} waypoints, expected at most {WAYPOINTS_MAX}");
            let hint = "straight lines need no waypoints between their ends";
            return Err(way_point.place.refused(problem, hint));
        }
        waypoints.push(way_point);
    }
    if waypoints.is_empty() {
        return Err(table.too_short("a header and no row"));
    }
    Ok(waypoints)
}

struct Table<'a> {
    file: &'a str,
    text: &'a str,
    /// Those of the header, in its order.
    columns: Vec<&'static str>,
}

impl Table<'_> {
    fn readable(&self, row: Result<StringRecord, csv::Error>) -> Result<StringRecord, Refusal> {
        row.map_err(|error| {
            let place = self.place(error.position(), 0);
            row_refused(place, &error.to_string(), "text")
        })
    }

    fn columns_of(&self, header: &StringRecord) -> Result<Vec<&'static str>, Refusal> {
        let mut columns = Vec::new();
        for (index, name) in header.iter().enumerate() {
            let refused = |found: &str, expected: &str| {
                let place = self.place(header.position(), characters_before(header, index));
                Err(row_refused(place, found, expected))
            };
            let Some(column) = COLUMNS.into_iter().find(|known| *known == name) else {
                let found = format!("the column `{}`", excerpt(name));
                return refused(&found, &format!("only {}", COLUMNS.join(", ")));
            };
            if columns.contains(&column) {
                return refused(&format!("the column `{column}` again"), "each column once");
            }
            columns.push(column);
            if columns.contains(&TIME) && columns.contains(&UTC) {
                return refused(&format!("both `{TIME}` and `{UTC}`"), "one of them");
            }
        }
        match REQUIRED.into_iter().find(|name| !columns.contains(name)) {
            None => Ok(columns),
            Some(missing) => {
                let found = format!("no column `{missing}`");
                let place = self.place(header.position(), 0);
                Err(row_refused(place, &found, "x_mm and y_mm"))
            }
        }
    }

    fn way_point(&self, row: &StringRecord) -> Result<Waypoint, Refusal> {
        let place = self.place(row.position(), 0);
        let (found, expected) = (row.len(), self.columns.len());
        if found != expected {
            let (found, expected) = (format!("{found} fields"), format!("{expected} fields"));
            return Err(row_refused(place, &found, &expected));
        }
        let mut coordinates = [0.0; AXES.len()];
        for (coordinate, column) in coordinates.iter_mut().zip(AXES) {
            *coordinate = self.number(row, column)?.unwrap_or_default();
        }
        Ok(Waypoint {
            position_mm: DVec3::from_array(coordinates),
            time: match self.utc(row)? {
                Some(utc) => Some(Time::Utc(utc)),
                None => self.number(row, TIME)?.map(Time::Scene),
            },
            dwell_s: self.number(row, DWELL)?.unwrap_or_default(),
            posture: self.posture(row)?,
            place,
        })
    }

    /// The number of a column, and its text in a row; `None` if the file does not have it.
    fn field<'r>(&self, row: &'r StringRecord, column: &str) -> Option<(usize, &'r str)> {
        let index = self.columns.iter().position(|known| *known == column)?;
        Some((index, row.get(index).unwrap_or_default()))
    }

    fn utc(&self, row: &StringRecord) -> Result<Option<Utc>, Refusal> {
        let Some((index, field)) = self.field(row, UTC) else {
            return Ok(None);
        };
        Utc::parse(field).map(Some).map_err(|why| {
            let (expected, hint) = match why {
                NoUtc::Local => (
                    "a time zone",
                    "a local time is ambiguous: append Z if it is UTC, or its offset, such as +01:00",
                ),
                NoUtc::Malformed => (
                    "a time stamp",
                    "write 2026-11-25T10:00:00.123Z, or seconds since 1970 such as 1795600800.123, from 1970 to 2199 (Unix: from 2001), with at most nine decimals",
                ),
            };
            let found = excerpt(field);
            let place = self.place(row.position(), characters_before(row, index));
            place.refused(format!("found `{found}` as {UTC}, expected {expected}"), hint)
        })
    }

    fn posture(&self, row: &StringRecord) -> Result<Option<Keeps>, Refusal> {
        let Some((index, field)) = self.field(row, POSTURE) else {
            return Ok(None);
        };
        match (Posture::from_name(field).map(Keeps::Posture), field) {
            (Some(posture), _) => Ok(Some(posture)),
            (None, "enter") => Ok(Some(Keeps::Enter)),
            (None, "leave") => Ok(Some(Keeps::Leave)),
            (None, "away") => Ok(Some(Keeps::Away)),
            (None, _) => {
                let place = self.place(row.position(), characters_before(row, index));
                let problem = format!(
                    "found `{}` as {POSTURE}, expected walk, stand, sit, lie, enter or leave",
                    excerpt(field)
                );
                let hint = "give every waypoint the posture that the person has when it arrives; enter: it comes in there; leave: it goes out there";
                Err(place.refused(problem, hint))
            }
        }
    }

    fn number(&self, row: &StringRecord, column: &str) -> Result<Option<f64>, Refusal> {
        let Some((index, field)) = self.field(row, column) else {
            return Ok(None);
        };
        let is_time = column == TIME || column == DWELL;
        let number = field.parse().ok().filter(|number: &f64| {
            number.is_finite() && (!is_time || (0.0..=TIME_MAX_S).contains(number))
        });
        number.map(Some).ok_or_else(|| {
            let expected = match is_time {
                true => format!("0 to {TIME_MAX_S} seconds"),
                false => "a finite number of millimeters".to_owned(),
            };
            let place = self.place(row.position(), characters_before(row, index));
            row_refused(
                place,
                &format!("`{}` as {column}", excerpt(field)),
                &expected,
            )
        })
    }

    /// The reader's position is where it started to look for the row, so skip empty lines and comments from there.
    fn place(&self, position: Option<&Position>, characters_before: usize) -> Place {
        let (line, byte) = position.map_or((1, 0), |position| (position.line(), position.byte()));
        let rest = usize::try_from(byte)
            .ok()
            .and_then(|byte| self.text.get(byte..));
        let lines = rest.unwrap_or_default().lines();
        let skipped = lines.take_while(|line| line.is_empty() || line.starts_with('#'));
        let line = usize::try_from(line).unwrap_or(usize::MAX);
        Place {
            file: self.file.into(),
            line: line.saturating_add(skipped.count()),
            column: characters_before + 1,
        }
    }

    fn too_short(&self, found: &str) -> Refusal {
        let place = Place::of_line(self.file, self.text.lines().count().max(1));
        let header = AXES.join(",");
        let expected = format!("the header `{header}` and at least one waypoint");
        row_refused(place, found, &expected)
    }
}

/// Characters before a field, assuming nothing was trimmed or quoted: exact for plain files.
fn characters_before(row: &StringRecord, index: usize) -> usize {
    let before = row.iter().take(index);
    before.map(|field| field.chars().count() + 1).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_read_with_their_places() {
        let text = "\u{feff}# a walk\nx_mm,y_mm,z_mm\n300, 1340,0\n# half way\n\n2800,1340,0\n";
        let points = read_waypoints("walk.csv", text).unwrap();
        assert_eq!(points.len(), 2);
        assert_eq!(points[0].position_mm, DVec3::new(300.0, 1340.0, 0.0));
        assert_eq!(points[1].place.to_string(), "walk.csv:6:1");
    }

    #[test]
    fn more_waypoints_than_the_limit_are_refused() {
        let mut text = "x_mm,y_mm,z_mm\n".to_owned() + &"1,2,0\n".repeat(WAYPOINTS_MAX);
        let most = read_waypoints("w.csv", &text).unwrap().len();
        assert_eq!(most, WAYPOINTS_MAX);
        text.push_str("1,2,0\n");
        let refused = read_waypoints("w.csv", &text).err().unwrap().to_string();
        let expected = "w.csv:100002:1: 100001 waypoints, expected at most 100000\nhint: ";
        assert!(refused.starts_with(expected), "{refused}");
    }
}
