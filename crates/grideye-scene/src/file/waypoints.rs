//! Reads the way-points of a trajectory from its CSV file.

use crate::model::error::SceneError;
use crate::model::limits;
use crate::model::limits::TIME_MAX_S;
use crate::text::place::Place;
use crate::text::refusal::excerpt;
use glam::DVec3;

/// A way-point and the place of its row.
pub(crate) struct Waypoint {
    pub(crate) position_mm: DVec3,
    /// When it is reached, if the trajectory has the column for it.
    pub(crate) time_s: Option<f64>,
    /// How long it is stood at.
    pub(crate) dwell_s: f64,
    pub(crate) place: Place,
}

impl Waypoint {
    /// A place that is stood on from the start.
    pub(crate) const fn standing(position_mm: DVec3, place: Place) -> Self {
        Self {
            position_mm,
            time_s: None,
            dwell_s: 0.0,
            place,
        }
    }
}

const TIME: &str = "t_s";

const COLUMNS: [&str; 3] = ["x_mm", "y_mm", "z_mm"];

const DWELL: &str = "dwell_s";

/// Reads a trajectory: a header `x_mm,y_mm,z_mm`, before it `t_s` and after it `dwell_s` if wanted, then one way-point
/// a row; lines that begin with `#` and empty lines are skipped.
pub(crate) fn read_waypoints(file: &str, text: &str) -> Result<Vec<Waypoint>, SceneError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut table = Table {
        file,
        text,
        columns: COLUMNS.to_vec(),
    };
    let mut rows = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(text.as_bytes())
        .into_records();
    match rows.next() {
        Some(header) => {
            let header = table.readable(header)?;
            table.check_header(&header)?;
        }
        None => return Err(table.too_short("an empty file")),
    }
    let mut waypoints = Vec::new();
    for row in rows {
        let way_point = table.way_point(&table.readable(row)?)?;
        if waypoints.len() == limits::WAYPOINTS_MAX {
            return Err(SceneError::TooMany {
                place: way_point.place,
                what: "way-points",
                found: limits::WAYPOINTS_MAX + 1,
                limit: limits::WAYPOINTS_MAX,
                hint: "straight stretches need no way-points between their ends",
            });
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
    /// The columns that the header has to have, or has.
    columns: Vec<&'static str>,
}

impl Table<'_> {
    fn readable(
        &self,
        row: Result<csv::StringRecord, csv::Error>,
    ) -> Result<csv::StringRecord, SceneError> {
        row.map_err(|error| SceneError::TrajectoryRow {
            place: self.place(error.position(), 0),
            found: error.to_string(),
            expected: "text".to_owned(),
        })
    }

    /// Finds out which of the columns that may be left out are there.
    fn check_header(&mut self, header: &csv::StringRecord) -> Result<(), SceneError> {
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
        let wrong = (0..columns.len())
            .find(|index| header.get(*index) != Some(columns[*index]))
            .unwrap_or(columns.len());
        Err(SceneError::TrajectoryRow {
            place: self.place(header.position(), characters_before(header, wrong)),
            found: format!(
                "the header `{}`",
                header.iter().collect::<Vec<_>>().join(",")
            ),
            expected: format!("the header `{}`", columns.join(",")),
        })
    }

    fn way_point(&self, row: &csv::StringRecord) -> Result<Waypoint, SceneError> {
        if row.len() != self.columns.len() {
            return Err(SceneError::TrajectoryRow {
                place: self.place(row.position(), 0),
                found: format!("{} fields", row.len()),
                expected: format!("{} fields", self.columns.len()),
            });
        }
        let mut coordinates = [0.0; COLUMNS.len()];
        for (coordinate, column) in coordinates.iter_mut().zip(COLUMNS) {
            *coordinate = self.number(row, column)?.unwrap_or_default();
        }
        Ok(Waypoint {
            position_mm: DVec3::from_array(coordinates),
            time_s: self.number(row, TIME)?,
            dwell_s: self.number(row, DWELL)?.unwrap_or_default(),
            place: self.place(row.position(), 0),
        })
    }

    /// The number that a row has in a column, if there is this column.
    fn number(
        &self,
        row: &csv::StringRecord,
        column: &'static str,
    ) -> Result<Option<f64>, SceneError> {
        let Some(index) = self.columns.iter().position(|known| *known == column) else {
            return Ok(None);
        };
        let is_time = column == TIME || column == DWELL;
        let field = row.get(index).unwrap_or_default();
        let number = field.parse().ok().filter(|number: &f64| {
            number.is_finite() && (!is_time || (0.0..=TIME_MAX_S).contains(number))
        });
        number.map(Some).ok_or_else(|| SceneError::TrajectoryRow {
            place: self.place(row.position(), characters_before(row, index)),
            found: format!("`{}` as {column}", excerpt(field)),
            expected: if is_time {
                format!("0 to {TIME_MAX_S} seconds")
            } else {
                "a finite number of millimetres".to_owned()
            },
        })
    }

    /// The reader's position is where it began to look for the row: skipped lines may come before it.
    fn place(&self, position: Option<&csv::Position>, characters_before: usize) -> Place {
        let (line, byte) = position.map_or((1, 0), |position| (position.line(), position.byte()));
        let rest = usize::try_from(byte)
            .ok()
            .and_then(|byte| self.text.get(byte..))
            .unwrap_or_default();
        let skipped = rest
            .lines()
            .take_while(|line| line.is_empty() || line.starts_with('#'))
            .count();
        Place {
            file: self.file.into(),
            line: usize::try_from(line).map_or(usize::MAX, |line| line.saturating_add(skipped)),
            column: characters_before + 1,
        }
    }

    fn too_short(&self, found: &str) -> SceneError {
        SceneError::TrajectoryRow {
            place: Place {
                file: self.file.into(),
                line: self.text.lines().count().max(1),
                column: 1,
            },
            found: found.to_owned(),
            expected: format!(
                "the header `{}` and at least one way-point",
                COLUMNS.join(",")
            ),
        }
    }
}

/// Characters before a field, as if nothing had been trimmed or quoted: exact for files that are written plainly.
fn characters_before(row: &csv::StringRecord, index: usize) -> usize {
    row.iter()
        .take(index)
        .map(|field| field.chars().count() + 1)
        .sum()
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
        let mut text = "x_mm,y_mm,z_mm\n".to_owned() + &"1,2,0\n".repeat(limits::WAYPOINTS_MAX);
        assert_eq!(
            read_waypoints("w.csv", &text)
                .map(|points| points.len())
                .ok(),
            Some(limits::WAYPOINTS_MAX)
        );
        text.push_str("1,2,0\n");
        let refused = read_waypoints("w.csv", &text).err().unwrap().to_string();
        assert!(
            refused
                .starts_with("w.csv:100002:1: 100001 way-points, expected at most 100000\nhint: "),
            "{refused}"
        );
    }
}
