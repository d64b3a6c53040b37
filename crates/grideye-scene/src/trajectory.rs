use crate::error::{Place, SceneError};
use crate::motion::Schedule;
use crate::scene::limits;
use crate::source::excerpt;
use glam::DVec3;
use std::time::Duration;

/// A polyline and when the walker is where on it; at its end the walker stands still.
///
/// By default it is walked at constant speed by arc length: after `t` the walker is `speed * t` along it (PeerJ CS
/// 11:e3124, "Sensor sampling frequency"). With other kinds of motion, time stamps or stops, a schedule says how far
/// the walker is.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    way_points_m: Vec<DVec3>,
    /// Arc length from the start to each way-point; as many as way-points.
    lengths_m: Vec<f64>,
    pace: Pace,
}

#[derive(Debug, Clone, PartialEq)]
enum Pace {
    Constant { speed_m_per_s: f64 },
    Schedule(Schedule),
}

/// A straight part of a way, or a stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Leg {
    pub(crate) start_s: f64,
    pub(crate) end_s: f64,
    /// The speed that is nowhere exceeded on it; 0 at a stop.
    pub(crate) speed_max_m_per_s: f64,
}

/// A time at which the walker does not move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stay {
    pub(crate) from_s: f64,
    /// Infinite at the end of the way.
    pub(crate) until_s: f64,
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

    /// Speed, metres a second: the mean over the whole duration, if it is not constant.
    #[must_use]
    pub fn speed_m_per_s(&self) -> f64 {
        match &self.pace {
            Pace::Constant { speed_m_per_s } => *speed_m_per_s,
            Pace::Schedule(schedule) => self.length_m() / schedule.end_s,
        }
    }

    /// Time from the start of the scene to the last way-point, and to the end of the stay there if it has one.
    #[must_use]
    pub fn duration(&self) -> Duration {
        // Parsing has refused what takes longer than the limit, so the fallback is never taken.
        Duration::try_from_secs_f64(self.end_s()).unwrap_or(Duration::MAX)
    }

    /// Where the walker is after `time`, metres.
    #[must_use]
    pub fn position_m(&self, time: Duration) -> DVec3 {
        self.at_s(time.as_secs_f64())
    }

    pub(crate) fn new(way_points_m: Vec<DVec3>, speed_m_per_s: f64) -> Self {
        Self {
            lengths_m: lengths_m(&way_points_m),
            way_points_m,
            pace: Pace::Constant { speed_m_per_s },
        }
    }

    /// A way by its way-points' [`lengths_m`] and the schedule that was made of them.
    pub(crate) fn scheduled(
        way_points_m: Vec<DVec3>,
        lengths_m: Vec<f64>,
        schedule: Schedule,
    ) -> Self {
        Self {
            way_points_m,
            lengths_m,
            pace: Pace::Schedule(schedule),
        }
    }

    pub(crate) fn end_s(&self) -> f64 {
        match &self.pace {
            Pace::Constant { speed_m_per_s } => self.length_m() / speed_m_per_s,
            Pace::Schedule(schedule) => schedule.end_s,
        }
    }

    /// Where the walker is at a time in seconds, metres.
    pub(crate) fn at_s(&self, time_s: f64) -> DVec3 {
        self.at_length_m(self.length_at_s(time_s))
    }

    /// The way-point that the walker is on its way to, or has just reached, at a time in seconds.
    pub(crate) fn heads_for(&self, time_s: f64) -> usize {
        let length_m = self.length_at_s(time_s);
        let last = self.way_points_m.len().saturating_sub(1);
        self.lengths_m
            .partition_point(|reached| *reached < length_m)
            .clamp(last.min(1), last)
    }

    /// The straight parts and the stops between them, one after the other from the start of the scene to the end of
    /// the way.
    pub(crate) fn legs(&self) -> Vec<Leg> {
        let mut legs = Vec::new();
        let mut end_s = 0.0;
        let mut push = |until_s: f64, speed_max_m_per_s: f64| {
            if until_s > end_s {
                legs.push(Leg {
                    start_s: end_s,
                    end_s: until_s,
                    speed_max_m_per_s,
                });
                end_s = until_s;
            }
        };
        match &self.pace {
            Pace::Constant { speed_m_per_s } => {
                for length_m in &self.lengths_m {
                    push(length_m / speed_m_per_s, *speed_m_per_s);
                }
            }
            Pace::Schedule(schedule) => {
                for stretch in &schedule.stretches {
                    push(stretch.start_s, 0.0);
                    let (from_m, to_m) = (stretch.from_m, stretch.from_m + stretch.length_m);
                    let first = self.lengths_m.partition_point(|length| *length <= from_m);
                    let inner = self.lengths_m[first..].iter();
                    for length_m in inner.take_while(|length_m| **length_m < to_m) {
                        push(stretch.time_at(*length_m), stretch.speed_max_m_per_s());
                    }
                    push(stretch.end_s(), stretch.speed_max_m_per_s());
                }
                push(schedule.end_s, 0.0);
            }
        }
        legs
    }

    /// The times at which the walker stands: before it sets off, at its stops, and for ever at the end.
    pub(crate) fn stays(&self) -> Vec<Stay> {
        let mut stays: Vec<Stay> = Vec::new();
        let mut still_since_s = 0.0;
        for leg in self.legs() {
            if leg.speed_max_m_per_s > 0.0 {
                if leg.start_s > still_since_s {
                    stays.push(Stay {
                        from_s: still_since_s,
                        until_s: leg.start_s,
                    });
                }
                still_since_s = leg.end_s;
            }
        }
        stays.push(Stay {
            from_s: still_since_s,
            until_s: f64::INFINITY,
        });
        stays
    }

    fn length_at_s(&self, time_s: f64) -> f64 {
        match &self.pace {
            Pace::Constant { speed_m_per_s } => speed_m_per_s * time_s,
            Pace::Schedule(schedule) => schedule.length_m(time_s),
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

/// Arc length from the first way-point to each.
pub(crate) fn lengths_m(way_points_m: &[DVec3]) -> Vec<f64> {
    let mut lengths_m = Vec::with_capacity(way_points_m.len());
    let mut length_m = 0.0;
    let mut previous = way_points_m.first().copied().unwrap_or(DVec3::ZERO);
    for point in way_points_m {
        length_m += previous.distance(*point);
        lengths_m.push(length_m);
        previous = *point;
    }
    lengths_m
}

/// A way-point and the place of its row.
pub(crate) struct WayPoint {
    pub(crate) position_mm: DVec3,
    /// When it is reached, if the trajectory has the column for it.
    pub(crate) time_s: Option<f64>,
    /// How long it is stood at.
    pub(crate) dwell_s: f64,
    pub(crate) place: Place,
}

impl WayPoint {
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
pub(crate) fn read_way_points(file: &str, text: &str) -> Result<Vec<WayPoint>, SceneError> {
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

    fn way_point(&self, row: &csv::StringRecord) -> Result<WayPoint, SceneError> {
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
        Ok(WayPoint {
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

/// The latest time stamp and the longest stop, seconds.
pub(crate) const TIME_MAX_S: f64 = 86_400.0 * 366.0;

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
    fn the_latest_time_is_the_longest_walk() {
        let longest = Duration::from_secs(86_400 * limits::WALK_DAYS_MAX);
        assert_eq!(Duration::from_secs_f64(TIME_MAX_S), longest);
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
