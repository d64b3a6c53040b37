//! Edits a trajectory's text row by row; comments and layout stay.

use super::fault::Fault;
use serde::Deserialize;

const POINTS_MAX: usize = 100;

/// One edit of a trajectory. Rows are waypoints, counted from 0; lengths are millimeters.
#[derive(Debug, Clone, Deserialize)]
#[serde(tag = "does", rename_all = "kebab-case", deny_unknown_fields)]
pub(super) enum TrajectoryEdit {
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

impl TrajectoryEdit {
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
pub(super) fn edited(text: Option<&str>, edit: &TrajectoryEdit) -> Result<String, Fault> {
    let fault = |what: &str| Fault::of_file(edit.file(), 1, what);
    if let TrajectoryEdit::NewWay { points_mm, .. } = edit {
        if text.is_some() {
            return Err(fault("a trajectory with this name already exists"));
        }
        if points_mm.is_empty() || points_mm.len() > POINTS_MAX {
            let found = points_mm.len();
            return Err(fault(&format!(
                "{found} waypoints, expected 1 to {POINTS_MAX}"
            )));
        }
        let rows = points_mm.iter();
        let rows = rows.map(|point| point.map(length).join(",") + "\n");
        return Ok(format!("x_mm,y_mm,z_mm\n{}", rows.collect::<String>()));
    }
    let text = text.ok_or_else(|| fault("this trajectory does not exist"))?;
    let mut table = Table::of(edit.file(), text)?;
    match edit {
        TrajectoryEdit::NewWay { .. } => {}
        TrajectoryEdit::MoveWayPoint { row, to_mm, .. } => table.place(*row, *to_mm)?,
        TrajectoryEdit::ShiftWay { by_mm, .. } => {
            for row in 0..table.rows.len() {
                let at_mm = table.at_mm(row)?;
                table.place(row, [0, 1, 2].map(|axis| at_mm[axis] + by_mm[axis]))?;
            }
        }
        TrajectoryEdit::AddWayPoint { after, at_mm, .. } => table.add(*after, *at_mm)?,
        TrajectoryEdit::RemoveWayPoint { row, .. } => table.remove(*row)?,
    }
    Ok(table.lines.concat())
}

const AXES: [&str; 3] = ["x_mm", "y_mm", "z_mm"];

/// The lines of a trajectory's text, and which of them are waypoints.
struct Table<'a> {
    file: &'a str,
    columns: Vec<&'a str>,
    lines: Vec<String>,
    rows: Vec<usize>,
}

impl<'a> Table<'a> {
    fn of(file: &'a str, text: &'a str) -> Result<Self, Fault> {
        let lines: Vec<&str> = text.split_inclusive('\n').collect();
        let is_row = |line: &str| !line.trim().is_empty() && !line.starts_with('#');
        let mut rows = (0..lines.len()).filter(|line| is_row(lines[*line]));
        let header = rows.next().map(|header| lines[header]).unwrap_or_default();
        let columns = header.trim_start_matches('\u{feff}').split(',');
        let columns: Vec<&str> = columns.map(str::trim).collect();
        // Without `z_mm`, every waypoint is on the floor.
        let is_usual = AXES[..2].iter().all(|axis| columns.contains(axis));
        if !is_usual || text.contains('"') {
            let what = "the layout of this trajectory does not allow edits here";
            return Err(Fault::of_file(file, 1, what));
        }
        Ok(Self {
            file,
            columns,
            rows: rows.collect(),
            lines: lines.iter().map(|line| (*line).to_owned()).collect(),
        })
    }

    fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|known| *known == name)
    }

    fn field(&self, row: usize, name: &str) -> Option<&str> {
        let line = self.lines.get(*self.rows.get(row)?)?;
        line.split(',').nth(self.column(name)?).map(str::trim)
    }

    fn number(&self, row: usize, name: &str) -> Option<f64> {
        self.field(row, name)?.parse().ok()
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

    fn fault(&self, row: usize, what: &str) -> Fault {
        let line = self.rows.get(row).map_or(1, |line| line + 1);
        Fault::of_file(self.file, line, what)
    }

    fn no_row(&self, row: usize) -> Fault {
        let what = format!("there is no waypoint {} with three numbers", row + 1);
        self.fault(row, &what)
    }

    /// Moves a row; numbers that stay equal keep their notation.
    fn place(&mut self, row: usize, to_mm: [f64; 3]) -> Result<(), Fault> {
        let at_mm = self.at_mm(row)?;
        self.check_height(row, to_mm)?;
        let line = &self.lines[self.rows[row]];
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        for (axis, name) in AXES.iter().enumerate() {
            let [is, to] = [at_mm[axis], to_mm[axis]].map(length);
            if let Some(column) = self.column(name).filter(|_| is != to) {
                let old = fields[column].trim().to_owned();
                fields[column] = fields[column].replacen(&old, &to, 1);
            }
        }
        self.lines[self.rows[row]] = fields.join(",");
        Ok(())
    }

    fn check_height(&self, row: usize, to_mm: [f64; 3]) -> Result<(), Fault> {
        if self.column("z_mm").is_some() || length(to_mm[2]) == "0" {
            return Ok(());
        }
        let what = "this trajectory has no column z_mm, so its waypoints stay on the floor";
        Err(self.fault(row, what))
    }

    /// Adds a waypoint. If waypoints have times, it gets the mean of its neighbors' times, or one second after the last.
    fn add(&mut self, after: usize, at_mm: [f64; 3]) -> Result<(), Fault> {
        let line = *self.rows.get(after).ok_or_else(|| self.no_row(after))?;
        self.check_height(after, at_mm)?;
        if self.column("utc").is_some() {
            let what = "the waypoints of this trajectory have stamps in UTC, which a new one would have to invent; add it in a text editor";
            return Err(self.fault(after, what));
        }
        let field = |name: &&str| match *name {
            "x_mm" => length(at_mm[0]),
            "y_mm" => length(at_mm[1]),
            "z_mm" => length(at_mm[2]),
            "t_s" => length(self.time_after(after)),
            "posture" => self.field(after, name).unwrap_or_default().to_owned(),
            _ => "0".to_owned(),
        };
        let fields = self.columns.iter().map(field).collect::<Vec<_>>().join(",");
        let newline = match self.lines[0].ends_with("\r\n") {
            true => "\r\n",
            false => "\n",
        };
        let end = self.lines[line].trim_end().len();
        self.lines[line].insert_str(end, &format!("{newline}{fields}"));
        Ok(())
    }

    fn time_after(&self, row: usize) -> f64 {
        let time = |row: usize| self.number(row, "t_s");
        let from = time(row).unwrap_or(0.0) + self.number(row, "dwell_s").unwrap_or(0.0);
        match time(row + 1) {
            Some(next) => f64::midpoint(from, next),
            None => from + 1.0,
        }
    }

    fn remove(&mut self, row: usize) -> Result<(), Fault> {
        let line = *self.rows.get(row).ok_or_else(|| self.no_row(row))?;
        if self.rows.len() == 1 {
            return Err(self.fault(row, "a trajectory needs at least one waypoint"));
        }
        self.lines.remove(line);
        Ok(())
    }
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
        let edit: TrajectoryEdit = serde_json::from_value(edit).unwrap();
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
