//! Reads the waypoints of a trajectory from its CSV file.

use crate::model::limits::{TIME_MAX_S, WAYPOINTS_MAX};
use crate::text::{Place, Refusal, excerpt};
use csv::{Position, StringRecord};
use glam::DVec3;

pub(crate) struct Waypoint {
    pub(crate) position_mm: DVec3,
    pub(crate) time_s: Option<f64>,
    pub(crate) dwell_s: f64,
    pub(crate) place: Place,
}

impl Waypoint {
    pub(crate) fn refused(&self, found: &str, expected: &str) -> Refusal {
        row_refused(self.place.clone(), found, expected)
    }
}

fn row_refused(place: Place, found: &str, expected: &str) -> Refusal {
    let hint = "a trajectory has the columns x_mm,y_mm,z_mm and one waypoint per row";
    place.refused(format!("found {found}, expected {expected}"), hint)
}

const TIME: &str = "t_s";
const COLUMNS: [&str; 3] = ["x_mm", "y_mm", "z_mm"];
const DWELL: &str = "dwell_s";

/// Reads `x_mm,y_mm,z_mm` with optional `t_s` before and `dwell_s` after; `#` comments and empty lines are skipped.
pub(crate) fn read_waypoints(file: &str, text: &str) -> Result<Vec<Waypoint>, Refusal> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let columns = COLUMNS.to_vec();
    let mut table = Table {
        file,
        text,
        columns,
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
    table.check_header(&header)?;
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
    /// The required columns, then those of the header.
    columns: Vec<&'static str>,
}

impl Table<'_> {
    fn readable(&self, row: Result<StringRecord, csv::Error>) -> Result<StringRecord, Refusal> {
        row.map_err(|error| {
            let place = self.place(error.position(), 0);
            row_refused(place, &error.to_string(), "text")
        })
    }

    fn check_header(&mut self, header: &StringRecord) -> Result<(), Refusal> {
        if header.get(0) == Some(TIME) {
            self.columns.insert(0, TIME);
        }
        if header.len() > self.columns.len() && header.iter().next_back() == Some(DWELL) {
            self.columns.push(DWELL);
        }
        let columns = &self.columns;
        if header.iter().eq(columns.iter().copied()) {
            return Ok(());
        }
        let mut indices = 0..columns.len();
        let wrong = indices.find(|index| header.get(*index) != Some(columns[*index]));
        let before = characters_before(header, wrong.unwrap_or(columns.len()));
        let found = header.iter().collect::<Vec<_>>().join(",");
        let expected = format!("the header `{}`", columns.join(","));
        let place = self.place(header.position(), before);
        Err(row_refused(
            place,
            &format!("the header `{found}`"),
            &expected,
        ))
    }

    fn way_point(&self, row: &StringRecord) -> Result<Waypoint, Refusal> {
        let place = self.place(row.position(), 0);
        let (found, expected) = (row.len(), self.columns.len());
        if found != expected {
            let (found, expected) = (format!("{found} fields"), format!("{expected} fields"));
            return Err(row_refused(place, &found, &expected));
        }
        let mut coordinates = [0.0; COLUMNS.len()];
        for (coordinate, column) in coordinates.iter_mut().zip(COLUMNS) {
            *coordinate = self.number(row, column)?.unwrap_or_default();
        }
        Ok(Waypoint {
            position_mm: DVec3::from_array(coordinates),
            time_s: self.number(row, TIME)?,
            dwell_s: self.number(row, DWELL)?.unwrap_or_default(),
            place,
        })
    }

    fn number(&self, row: &StringRecord, column: &str) -> Result<Option<f64>, Refusal> {
        let Some(index) = self.columns.iter().position(|known| *known == column) else {
            return Ok(None);
        };
        let is_time = column == TIME || column == DWELL;
        let field = row.get(index).unwrap_or_default();
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
        let header = COLUMNS.join(",");
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
