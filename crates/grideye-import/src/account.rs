//! What was taken for what, and what could not be read, for people.

use crate::columns::{Role, Unit};
use crate::plan::{Plan, Scale};
use core::fmt;
use grideye_recording::printable;

/// What was taken for what. Its [`Display`](fmt::Display) is one line for each of them.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Account {
    /// The layout of the file.
    pub container: String,
    /// What each thing was taken from, for example `("time", "column 1 (when): Unix time in seconds")`.
    pub taken: Vec<(&'static str, String)>,
}

/// What was counted while reading.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Tally {
    /// Frames read.
    pub frames: u64,
    /// Frames whose row is damaged: recorded as missing, with the reason `short-transfer`.
    pub damaged: u64,
    /// The line or row of the first of them.
    pub first_damaged: Option<u64>,
    /// Rows without any pixel: their numbers are left out.
    pub empty: u64,
    /// Lines that are neither frames nor facts about one.
    pub skipped: u64,
    /// Frames whose time could not be read; they follow the one before.
    pub untimed: u64,
    /// Frames that the beginning of the file cuts: left out.
    pub cut: u64,
    /// Pixels between two steps of the sensor, taken for the nearest one.
    pub between: u64,
    /// The farthest of them from its step, °C.
    pub farthest_c: f64,
}

impl Account {
    pub(crate) fn of(plan: &Plan, container: String, zone: &str) -> Self {
        let is_named =
            |column: usize| plan.has_names && plan.names[column] != format!("column{}", column + 1);
        let column = |column: usize| match is_named(column) {
            true => format!("column {} ({})", column + 1, plan.names[column]),
            false => format!("column {}", column + 1),
        };
        let one = |found: Option<usize>| found.map_or("none".to_owned(), column);
        let is_in_row = plan.pixels.windows(2).all(|pair| pair[1] == pair[0] + 1);
        let (first, last) = (
            plan.pixels.first().copied().unwrap_or(0),
            plan.pixels.last().copied().unwrap_or(0),
        );
        let unit = match plan.unit {
            Unit::Celsius => "°C",
            Unit::Fahrenheit => "°F",
            Unit::Kelvin => "kelvin",
            Unit::Tenths => "tenths of °C",
            Unit::Hundredths => "hundredths of °C",
            Unit::Words => "raw words of 0.25 °C",
            Unit::SignMagnitude => "raw words of 0.25 °C, sign and magnitude",
        };
        let place = match is_in_row {
            true => format!("{} to {}", column(first), last + 1),
            false => format!(
                "{} to {}, by their names",
                plan.names[first], plan.names[last]
            ),
        };
        let mut taken = vec![(Role::Pixels.name(), format!("{place}, {unit}"))];
        let time = plan.time.as_ref().map(|time| {
            let columns: Vec<String> = time.columns.iter().map(|found| column(*found)).collect();
            let kind = match time.scale {
                Some(Scale::Unix(unit)) => format!("Unix time in {}", named(unit)),
                Some(Scale::Since(unit)) => format!("{} since some start", named(unit)),
                Some(Scale::Ticks) => "ticks of .NET, in UTC".to_owned(),
                Some(Scale::Days) => "days as spreadsheets count them, in UTC".to_owned(),
                None => zone.to_owned(),
            };
            format!("{}: {kind}", columns.join(" and "))
        });
        let time = time.unwrap_or_else(|| "none: the frames' rate".to_owned());
        taken.push((Role::Time.name(), time));
        taken.push((Role::Thermistor.name(), one(plan.thermistor)));
        for (role, found) in [
            (Role::Number, plan.number),
            (Role::Sensor, plan.sensor),
            (Role::Device, plan.device),
            (Role::Boot, plan.boot),
        ] {
            taken.extend(found.map(|found| (role.name(), column(found))));
        }
        if !plan.labels.is_empty() {
            let labels: Vec<String> = plan.labels.iter().map(|found| column(*found)).collect();
            taken.push(("labels", labels.join(", ")));
        }
        taken.extend(plan.notes.iter().map(|note| ("note", note.clone())));
        Self { container, taken }
    }
}

fn named(unit: i32) -> &'static str {
    match unit {
        0 => "nanoseconds",
        3 => "microseconds",
        6 => "milliseconds",
        _ => "seconds",
    }
}

impl fmt::Display for Account {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "read as {}", printable(&self.container))?;
        for (name, from) in &self.taken {
            write!(formatter, "\n  {name:<11} {}", printable(from))?;
        }
        Ok(())
    }
}

impl Tally {
    /// Whether something in the file did not become a frame.
    #[must_use]
    pub const fn has_loss(&self) -> bool {
        self.damaged > 0
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} frames", self.frames)?;
        if let Some(first) = self.first_damaged {
            write!(
                formatter,
                "; {} damaged rows are missing frames (short-transfer), the first at {first}",
                self.damaged
            )?;
        }
        for (count, what) in [
            (self.empty, "rows without pixels were left out"),
            (self.skipped, "other lines were skipped"),
            (
                self.cut,
                "frames that the beginning of the file cuts were left out",
            ),
            (
                self.untimed,
                "frames without a readable time follow the one before",
            ),
        ] {
            if count > 0 {
                write!(formatter, "; {count} {what}")?;
            }
        }
        if self.between > 0 {
            write!(
                formatter,
                "; {} pixels lie between the sensor's steps and were taken for the nearest, at most {:.3} °C away",
                self.between, self.farthest_c
            )?;
        }
        Ok(())
    }
}
