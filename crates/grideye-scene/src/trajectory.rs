use crate::error::{Place, SceneError};
use crate::scene::limits;
use crate::source::excerpt;
use glam::DVec3;
use std::time::Duration;

/// A polyline walked at constant speed by arc length: after `t` the walker is `speed * t` along it, and stands still
/// at its end (PeerJ CS 11:e3124, "Sensor sampling frequency").
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    way_points_m: Vec<DVec3>,
    /// Arc length from the start to each way-point; as many as way-points.
    lengths_m: Vec<f64>,
    speed_m_per_s: f64,
}

impl Trajectory {
    /// The points that the polyline joins, metres.
    #[must_use]
    pub fn way_points_m(&self) -> &[DVec3] {
        &self.way_points_m
    }

    /// Length of the whole polyline, metres.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.lengths_m.last().copied().unwrap_or(0.0)
    }

    /// Speed, metres a second.
    #[must_use]
    pub const fn speed_m_per_s(&self) -> f64 {
        self.speed_m_per_s
    }

    /// Time from the first way-point to the last.
    #[must_use]
    pub fn duration(&self) -> Duration {
        // Parsing has refused what takes longer than the limit, so the fallback is never taken.
        Duration::try_from_secs_f64(self.length_m() / self.speed_m_per_s).unwrap_or(Duration::MAX)
    }

    /// Where the walker is after `time`, metres.
    #[must_use]
    pub fn position_m(&self, time: Duration) -> DVec3 {
        self.at_length_m(self.speed_m_per_s * time.as_secs_f64())
    }

    pub(crate) fn new(way_points_m: Vec<DVec3>, speed_m_per_s: f64) -> Self {
        let mut lengths_m = Vec::with_capacity(way_points_m.len());
        let mut length_m = 0.0;
        let mut previous = way_points_m.first().copied().unwrap_or(DVec3::ZERO);
        for point in &way_points_m {
            length_m += previous.distance(*point);
            lengths_m.push(length_m);
            previous = *point;
        }
        Self {
            way_points_m,
            lengths_m,
            speed_m_per_s,
        }
    }

    fn at_length_m(&self, length_m: f64) -> DVec3 {
        let last = self.way_points_m.len().saturating_sub(1);
        let next = self
            .lengths_m
            .partition_point(|reached| *reached <= length_m)
            .min(last);
        let before = next.saturating_sub(1);
        let leg_m = self.lengths_m[next] - self.lengths_m[before];
        let share = ((length_m - self.lengths_m[before]) / leg_m).clamp(0.0, 1.0);
        if leg_m > 0.0 && share < 1.0 {
            self.way_points_m[before].lerp(self.way_points_m[next], share)
        } else {
            self.way_points_m[next]
        }
    }
}

/// A way-point and the place of its row.
pub(crate) struct WayPoint {
    pub(crate) position_mm: DVec3,
    pub(crate) place: Place,
}

const COLUMNS: [&str; 3] = ["x_mm", "y_mm", "z_mm"];

/// Reads a trajectory: a header `x_mm,y_mm,z_mm`, then one way-point a row; lines that begin with `#` and empty lines
/// are skipped.
pub(crate) fn read_way_points(file: &str, text: &str) -> Result<Vec<WayPoint>, SceneError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let table = Table { file, text };
    let mut rows = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(text.as_bytes())
        .into_records();
    match rows.next() {
        Some(header) => table.check_header(&table.readable(header)?)?,
        None => return Err(table.too_short("an empty file")),
    }
    let mut way_points = Vec::new();
    for row in rows {
        let way_point = table.way_point(&table.readable(row)?)?;
        if way_points.len() == limits::WAY_POINTS_MAX {
            return Err(SceneError::TooMany {
                place: way_point.place,
                what: "way-points",
                found: limits::WAY_POINTS_MAX + 1,
                limit: limits::WAY_POINTS_MAX,
                hint: "straight stretches need no way-points between their ends",
            });
        }
        way_points.push(way_point);
    }
    if way_points.is_empty() {
        return Err(table.too_short("a header and no row"));
    }
    Ok(way_points)
}

struct Table<'a> {
    file: &'a str,
    text: &'a str,
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

    fn check_header(&self, header: &csv::StringRecord) -> Result<(), SceneError> {
        if header.iter().eq(COLUMNS) {
            return Ok(());
        }
        let wrong = (0..COLUMNS.len())
            .find(|index| header.get(*index) != Some(COLUMNS[*index]))
            .unwrap_or(COLUMNS.len());
        Err(SceneError::TrajectoryRow {
            place: self.place(header.position(), characters_before(header, wrong)),
            found: format!(
                "the header `{}`",
                header.iter().collect::<Vec<_>>().join(",")
            ),
            expected: format!("the header `{}`", COLUMNS.join(",")),
        })
    }

    fn way_point(&self, row: &csv::StringRecord) -> Result<WayPoint, SceneError> {
        if row.len() != COLUMNS.len() {
            return Err(SceneError::TrajectoryRow {
                place: self.place(row.position(), 0),
                found: format!("{} fields", row.len()),
                expected: format!("{} fields", COLUMNS.len()),
            });
        }
        let mut coordinates = [0.0; COLUMNS.len()];
        for (index, coordinate) in coordinates.iter_mut().enumerate() {
            let field = row.get(index).unwrap_or_default();
            let number = field.parse().ok().filter(|number: &f64| number.is_finite());
            *coordinate = number.ok_or_else(|| SceneError::TrajectoryRow {
                place: self.place(row.position(), characters_before(row, index)),
                found: format!("`{}` as {}", excerpt(field), COLUMNS[index]),
                expected: "a finite number of millimetres".to_owned(),
            })?;
        }
        Ok(WayPoint {
            position_mm: DVec3::from_array(coordinates),
            place: self.place(row.position(), 0),
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

    fn corner() -> Trajectory {
        // 3 m along x, a point twice, 4 m along y, at 0.5 m/s: 14 s.
        let points = [
            [1.0, 1.0, 0.0],
            [4.0, 1.0, 0.0],
            [4.0, 1.0, 0.0],
            [4.0, 5.0, 0.0],
        ];
        Trajectory::new(points.map(DVec3::from_array).to_vec(), 0.5)
    }

    #[test]
    fn the_walker_is_where_arc_length_says() {
        let walk = corner();
        assert_eq!(walk.length_m(), 7.0);
        assert_eq!(walk.duration(), Duration::from_secs(14));
        for (seconds, expected) in [
            (0.0, [1.0, 1.0, 0.0]),
            (1.0, [1.5, 1.0, 0.0]),
            (6.0, [4.0, 1.0, 0.0]),
            (7.0, [4.0, 1.5, 0.0]),
            (14.0, [4.0, 5.0, 0.0]),
            (1e6, [4.0, 5.0, 0.0]),
        ] {
            let found = walk.position_m(Duration::from_secs_f64(seconds));
            assert!(
                (found - DVec3::from_array(expected)).length() < 1e-12,
                "{seconds}: {found}"
            );
        }
        assert_eq!(walk.position_m(Duration::MAX), DVec3::new(4.0, 5.0, 0.0));
    }

    #[test]
    fn a_single_point_is_stood_on() {
        let stand = Trajectory::new(vec![DVec3::ONE], 1.0);
        assert_eq!(stand.duration(), Duration::ZERO);
        assert_eq!(stand.position_m(Duration::from_secs(3)), DVec3::ONE);
        let twice = Trajectory::new(vec![DVec3::ONE, DVec3::ONE], 1.0);
        assert_eq!(twice.position_m(Duration::ZERO), DVec3::ONE);
    }

    #[test]
    fn rows_are_read_with_their_places() {
        let text = "\u{feff}# a walk\nx_mm,y_mm,z_mm\n300, 1340,0\n# half way\n\n2800,1340,0\n";
        let points = read_way_points("walk.csv", text).unwrap();
        assert_eq!(points.len(), 2);
        assert_eq!(points[0].position_mm, DVec3::new(300.0, 1340.0, 0.0));
        assert_eq!(points[1].place.to_string(), "walk.csv:6:1");
    }

    #[test]
    fn more_way_points_than_the_limit_are_refused() {
        let mut text = "x_mm,y_mm,z_mm\n".to_owned() + &"1,2,0\n".repeat(limits::WAY_POINTS_MAX);
        assert_eq!(
            read_way_points("w.csv", &text)
                .map(|points| points.len())
                .ok(),
            Some(limits::WAY_POINTS_MAX)
        );
        text.push_str("1,2,0\n");
        let refused = read_way_points("w.csv", &text).err().unwrap().to_string();
        assert!(
            refused
                .starts_with("w.csv:100002:1: 100001 way-points, expected at most 100000\nhint: "),
            "{refused}"
        );
    }
}
