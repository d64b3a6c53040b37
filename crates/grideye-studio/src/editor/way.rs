//! Edits a trajectory's text row by row; comments and layout stay.

use super::fault::Fault;
use serde::Deserialize;
use std::ops::Range;

const POINTS_MAX: usize = 100;

/// One edit of a trajectory. Rows are waypoints, counted from 0; lengths are millimeters.
#[derive(Debug, Clone, Deserialize)]
#[serde(tag = "does", rename_all = "kebab-case", deny_unknown_fields)]
pub(super) enum WayEdit {
    /// Moves a waypoint.
    MoveWayPoint {
        file: String,
        row: usize,
        to_mm: [f64; 3],
    },
    /// Adds a waypoint after another.
    AddWayPoint {
        file: String,
        after: usize,
        at_mm: [f64; 3],
    },
    /// Deletes a waypoint; the last one stays.
    RemoveWayPoint { file: String, row: usize },
    /// Moves the whole trajectory.
    ShiftWay { file: String, by_mm: [f64; 3] },
    /// Creates a trajectory.
    NewWay {
        file: String,
        points_mm: Vec<[f64; 3]>,
    },
}

impl WayEdit {
    pub(super) fn file(&self) -> &str {
        match self {
            Self::MoveWayPoint { file, .. }
            | Self::AddWayPoint { file, .. }
            | Self::RemoveWayPoint { file, .. }
            | Self::ShiftWay { file, .. }
            | Self::NewWay { file, .. } => file,
        }
    }
}

/// The trajectory's text after the edit; `text` is the current one, if any.
///
/// # Errors
/// If there is no such row, or the text is not a trajectory.
pub(super) fn edited(text: Option<&str>, edit: &WayEdit) -> Result<String, Fault> {
    let file = edit.file();
    let known = || text.ok_or_else(|| Fault::of_file(file, 1, "this trajectory does not exist"));
    match edit {
        WayEdit::NewWay { points_mm, .. } => new_way(file, text, points_mm),
        WayEdit::MoveWayPoint { row, to_mm, .. } => {
            let rows = Rows::of(file, known()?)?;
            Ok(spliced(rows.text, rows.placed(*row, *to_mm)?))
        }
        WayEdit::ShiftWay { by_mm, .. } => {
            let rows = Rows::of(file, known()?)?;
            let mut splices = Vec::new();
            for row in 0..rows.lines.len() {
                let at_mm = rows.at_mm(row)?;
                let to_mm = [0, 1, 2].map(|axis| at_mm[axis] + by_mm[axis]);
                splices.extend(rows.placed(row, to_mm)?);
            }
            Ok(spliced(rows.text, splices))
        }
        WayEdit::AddWayPoint { after, at_mm, .. } => Rows::of(file, known()?)?.with(*after, *at_mm),
        WayEdit::RemoveWayPoint { row, .. } => Rows::of(file, known()?)?.without(*row),
    }
}

fn new_way(file: &str, text: Option<&str>, points_mm: &[[f64; 3]]) -> Result<String, Fault> {
    if text.is_some() {
        let what = "a trajectory with this name already exists";
        return Err(Fault::of_file(file, 1, what));
    }
    if points_mm.is_empty() || points_mm.len() > POINTS_MAX {
        let what = format!("{} waypoints, expected 1 to {POINTS_MAX}", points_mm.len());
        return Err(Fault::of_file(file, 1, &what));
    }
    let rows = points_mm
        .iter()
        .map(|point| point.map(length).join(",") + "\n");
    Ok(format!("x_mm,y_mm,z_mm\n{}", rows.collect::<String>()))
}

const AXES: [&str; 3] = ["x_mm", "y_mm", "z_mm"];
/// Without `z_mm`, every waypoint is on the floor.
const FLOOR: [&str; 2] = ["x_mm", "y_mm"];

/// The positions of header and waypoints in a trajectory's text.
struct Rows<'a> {
    file: &'a str,
    text: &'a str,
    header: Vec<&'a str>,
    /// The bytes of each row, without line ending.
    lines: Vec<Range<usize>>,
}

impl<'a> Rows<'a> {
    fn of(file: &'a str, text: &'a str) -> Result<Self, Fault> {
        let mut lines = Vec::new();
        let mut at = 0;
        for line in text.split_inclusive('\n') {
            let range = at..at + line.trim_end().len();
            at += line.len();
            let is_row = !line.trim().is_empty() && !line.starts_with('#');
            if is_row {
                lines.push(range);
            }
        }
        let unusual = || {
            Fault::of_file(
                file,
                1,
                "the layout of this trajectory does not allow edits here",
            )
        };
        if lines.is_empty() || text.contains('"') {
            return Err(unusual());
        }
        let header = text.get(lines.remove(0)).unwrap_or_default();
        let header = header.trim_start_matches('\u{feff}').split(',');
        let header: Vec<&str> = header.map(str::trim).collect();
        if !FLOOR.iter().all(|name| header.contains(name)) {
            return Err(unusual());
        }
        Ok(Self {
            file,
            text,
            header,
            lines,
        })
    }

    fn column(&self, name: &str) -> Option<usize> {
        self.header.iter().position(|known| *known == name)
    }

    /// The bytes of a field, trimmed.
    fn field(&self, row: usize, name: &str) -> Option<Range<usize>> {
        let column = self.column(name)?;
        let line = self.lines.get(row)?.clone();
        let text = self.text.get(line.clone())?;
        let before = text.split(',').take(column);
        let before: usize = before.map(|field| field.len() + 1).sum();
        let field = text.split(',').nth(column)?;
        let start = line.start + before + (field.len() - field.trim_start().len());
        Some(start..start + field.trim().len())
    }

    fn number(&self, row: usize, name: &str) -> Option<f64> {
        self.text.get(self.field(row, name)?)?.parse().ok()
    }

    fn at_mm(&self, row: usize) -> Result<[f64; 3], Fault> {
        let [x, y, z] = AXES.map(|name| match self.column(name) {
            Some(_) => self.number(row, name),
            None => Some(0.0),
        });
        match (x, y, z) {
            (Some(x), Some(y), Some(z)) => Ok([x, y, z]),
            _ => Err(self.no_row(row)),
        }
    }

    fn no_row(&self, row: usize) -> Fault {
        let what = format!("there is no waypoint {} with three numbers", row + 1);
        Fault::of_file(self.file, self.line(row), &what)
    }

    /// The replacements that move a row.
    fn placed(&self, row: usize, to_mm: [f64; 3]) -> Result<Vec<(Range<usize>, String)>, Fault> {
        let at_mm = self.at_mm(row)?;
        let axes = AXES.into_iter().zip(at_mm.into_iter().zip(to_mm));
        let moved = axes.filter(|(_, (is, wanted))| length(*is) != length(*wanted));
        self.check_height(row, to_mm)?;
        let fields = moved.map(|(name, (_, to))| Some((self.field(row, name)?, length(to))));
        let fields: Option<_> = fields.collect();
        fields.ok_or_else(|| self.no_row(row))
    }

    fn check_height(&self, row: usize, to_mm: [f64; 3]) -> Result<(), Fault> {
        if self.column("z_mm").is_some() || length(to_mm[2]) == "0" {
            return Ok(());
        }
        let what = "this trajectory has no column z_mm, so its waypoints stay on the floor";
        Err(Fault::of_file(self.file, self.line(row), what))
    }

    fn line(&self, row: usize) -> usize {
        let before = self
            .lines
            .get(row)
            .and_then(|line| self.text.get(..line.start));
        1 + before.unwrap_or_default().matches('\n').count()
    }

    /// The text with one more waypoint. If waypoints have times, it gets the mean of its neighbors' times, or one
    /// second after the last.
    fn with(&self, after: usize, at_mm: [f64; 3]) -> Result<String, Fault> {
        let line = self.lines.get(after).ok_or_else(|| self.no_row(after))?;
        self.check_height(after, at_mm)?;
        if self.column("utc").is_some() {
            let what = "the waypoints of this trajectory have stamps in UTC, which a new one would have to invent; add it in a text editor";
            return Err(Fault::of_file(self.file, self.line(after), what));
        }
        let field = |name: &&str| match *name {
            "x_mm" => length(at_mm[0]),
            "y_mm" => length(at_mm[1]),
            "z_mm" => length(at_mm[2]),
            "t_s" => length(self.time_after(after)),
            "posture" => {
                let posture = self.field(after, "posture");
                let posture = posture.and_then(|range| self.text.get(range));
                posture.unwrap_or_default().to_owned()
            }
            _ => "0".to_owned(),
        };
        let fields: Vec<String> = self.header.iter().map(field).collect();
        let end = if self.text.contains("\r\n") {
            "\r\n"
        } else {
            "\n"
        };
        let added = format!("{end}{}", fields.join(","));
        Ok(spliced(self.text, vec![(line.end..line.end, added)]))
    }

    fn time_after(&self, row: usize) -> f64 {
        let time = |row: usize| self.number(row, "t_s");
        let from = time(row).unwrap_or(0.0) + self.number(row, "dwell_s").unwrap_or(0.0);
        match time(row + 1) {
            Some(next) => f64::midpoint(from, next),
            None => from + 1.0,
        }
    }

    fn without(&self, row: usize) -> Result<String, Fault> {
        let line = self.lines.get(row).ok_or_else(|| self.no_row(row))?;
        if self.lines.len() == 1 {
            let what = "a trajectory needs at least one waypoint";
            return Err(Fault::of_file(self.file, 1, what));
        }
        let rest = self.text.get(line.end..).unwrap_or_default();
        let end = rest.find('\n');
        let end = end.map_or(self.text.len(), |end| line.end + end + 1);
        Ok(spliced(self.text, vec![(line.start..end, String::new())]))
    }
}

fn spliced(text: &str, mut splices: Vec<(Range<usize>, String)>) -> String {
    splices.sort_by_key(|(range, _)| range.start);
    let mut made = text.to_owned();
    for (range, value) in splices.into_iter().rev() {
        made.replace_range(range, &value);
    }
    made
}

/// A length or a time with up to three decimals.
fn length(number: f64) -> String {
    let rounded = (number * 1000.0).round() / 1000.0;
    // Avoids negative zero.
    (rounded + 0.0).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    const WAY: &str = "# from the door\nx_mm,y_mm,z_mm\n300, 1340,0\n# to the bed\n2800,1340.5,0\n";
    const TIMED: &str = "t_s,x_mm,y_mm,z_mm,dwell_s\r\n0,300,1340,0,2\r\n8,2800,1340,0,10\r\n";

    fn made(text: &str, edit: Value) -> Result<String, Fault> {
        edited(Some(text), &serde_json::from_value(edit).unwrap())
    }

    #[test]
    fn a_way_point_is_moved_and_nothing_else() {
        let moved = |row: usize, to_mm: [i32; 3]| json!({ "does": "move-way-point", "file": "w.csv", "row": row, "to_mm": to_mm });
        let wanted = WAY.replace(" 1340,0", " 1500,0");
        assert_eq!(made(WAY, moved(0, [300, 1500, 0])).unwrap(), wanted);
        let wanted = TIMED.replace("8,2800,1340,0,10", "8,1,2,3,10");
        assert_eq!(made(TIMED, moved(1, [1, 2, 3])).unwrap(), wanted);
    }

    const STAMPED: &str =
        "y_mm,utc,x_mm\n1340,2026-11-25T10:00:00.123Z,300\n1340,1795600808.5,2800\n";

    #[test]
    fn stamps_and_the_order_of_columns_stay() {
        let shift = json!({ "does": "shift-way", "file": "w.csv", "by_mm": [100, 10, 0] });
        let wanted = "y_mm,utc,x_mm\n1350,2026-11-25T10:00:00.123Z,400\n1350,1795600808.5,2900\n";
        assert_eq!(made(STAMPED, shift).unwrap(), wanted);
        let remove = json!({ "does": "remove-way-point", "file": "w.csv", "row": 0 });
        let wanted = "y_mm,utc,x_mm\n1340,1795600808.5,2800\n";
        assert_eq!(made(STAMPED, remove).unwrap(), wanted);
    }

    #[test]
    fn a_way_is_shifted_as_a_whole() {
        let edit = json!({ "does": "shift-way", "file": "w.csv", "by_mm": [100, -0.5, 0] });
        let wanted = "# from the door\nx_mm,y_mm,z_mm\n400, 1339.5,0\n# to the bed\n2900,1340,0\n";
        assert_eq!(made(WAY, edit).unwrap(), wanted);
    }

    #[test]
    fn way_points_come_and_go_and_remarks_stay() {
        let add = |after: usize| json!({ "does": "add-way-point", "file": "w.csv", "after": after, "at_mm": [1, 2, 0] });
        let with = made(WAY, add(0)).unwrap();
        assert_eq!(with, WAY.replace("1340,0\n", "1340,0\n1,2,0\n"));
        let remove = json!({ "does": "remove-way-point", "file": "w.csv", "row": 1 });
        assert_eq!(made(&with, remove).unwrap(), WAY);
        // Between the end of the first stay, second 2, and second 8.
        let timed = made(TIMED, add(0)).unwrap();
        assert_eq!(timed, TIMED.replace("0,2\r\n", "0,2\r\n5,1,2,0,0\r\n"));
        let last = made(TIMED, add(1)).unwrap();
        assert!(last.ends_with("0,10\r\n19,1,2,0,0\r\n"));
        let sits = "x_mm,t_s,y_mm,posture\n3,0,4,walk\n5,2,6,sit\n";
        let wanted = sits.replace("walk\n", "walk\n1,1,2,walk\n");
        assert_eq!(made(sits, add(0)).unwrap(), wanted);
        let open = "x_mm,y_mm,z_mm\n3,4,5";
        assert_eq!(made(open, add(0)).unwrap(), format!("{open}\n1,2,0"));
    }

    #[test]
    fn a_new_way_is_made_once() {
        let edit =
            json!({ "does": "new-way", "file": "w.csv", "points_mm": [[0, 1, 2], [3.25, 4, 5]] });
        let edit: WayEdit = serde_json::from_value(edit).unwrap();
        assert_eq!(
            edited(None, &edit).unwrap(),
            "x_mm,y_mm,z_mm\n0,1,2\n3.25,4,5\n"
        );
        assert!(edited(Some(WAY), &edit).is_err());
    }

    #[test]
    fn invalid_rows_and_texts_are_rejected() {
        let shift = json!({ "does": "shift-way", "file": "w", "by_mm": [1, 1, 1] });
        let remove = |row: usize| json!({ "does": "remove-way-point", "file": "w", "row": row });
        let add = json!({ "does": "add-way-point", "file": "w", "after": 0, "at_mm": [1, 2, 0] });
        for (text, edit, why) in [
            (WAY, remove(2), "no waypoint 3"),
            ("x_mm,y_mm,z_mm\n1,2,3\n", remove(0), "one waypoint"),
            ("x_mm,y_mm,z_mm\n1,b,3\n", shift.clone(), "three numbers"),
            ("x_mm,y_mm\n1,2\n", shift.clone(), "no column z_mm"),
            (STAMPED, add, "stamps in UTC"),
            ("a,b\n1,2\n", shift.clone(), "does not allow"),
            ("", shift, "does not allow"),
        ] {
            let said = made(text, edit).unwrap_err().to_json().to_string();
            assert!(said.contains(why), "{said}");
        }
    }
}
