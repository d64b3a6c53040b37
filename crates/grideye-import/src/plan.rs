//! Which column is what, told from names and from the first rows.

mod facts;
mod guess;
mod names;
mod pixels;
mod time;
mod unit;

pub(crate) use time::{Scale, Time};

use crate::cell::RawRow;
use crate::columns::{Columns, Role, Unit};
use crate::error::ImportError;
use guess::Guess;

/// Columns of this project's own NPZ and Parquet that are no labels.
const DERIVED: [&str; 6] = [
    "t_boot_ns",
    "t_utc_ns",
    "t_arrival_ns",
    "clock",
    "missing",
    "stream",
];

/// Which column is what.
#[derive(Debug)]
pub(crate) struct Plan {
    pub(crate) width: usize,
    pub(crate) pixels: Vec<usize>,
    pub(crate) unit: Unit,
    pub(crate) time: Option<Time>,
    pub(crate) thermistor: Option<usize>,
    pub(crate) number: Option<usize>,
    pub(crate) sensor: Option<usize>,
    pub(crate) device: Option<usize>,
    pub(crate) boot: Option<usize>,
    pub(crate) labels: Vec<usize>,
    /// Of all columns; those without one are called `columnN`.
    pub(crate) names: Vec<String>,
    pub(crate) has_names: bool,
    /// What was guessed and may be wrong, or what the file does not say as it should.
    pub(crate) notes: Vec<String>,
}

impl Plan {
    /// # Errors
    /// [`ImportError`] with what to say, frames of another size.
    pub(crate) fn of(
        names: Option<&[String]>,
        sample: &[RawRow],
        said: &Columns,
        known_unit: Option<Unit>,
    ) -> Result<Self, ImportError> {
        let mut guess = Guess::new(names, sample)?;
        guess.take_what_is_said(said)?;
        let pixels = guess.pixels()?;
        for column in &pixels {
            guess.roles[*column] = Some(Role::Pixels);
        }
        guess.take_what_names_say();
        let unit = guess.unit(&pixels, said.unit, known_unit)?;
        guess.take_what_values_say(&pixels, unit);
        let places = guess.take_places();
        let time = guess.time(said)?;
        let first = |role| guess.roles.iter().position(|found| *found == Some(role));
        let is_label = |column: &usize| {
            let facts = &guess.facts[*column];
            let is_caption = !guess.has_names && !facts.is_number && facts.is_constant;
            let is_ours = DERIVED.contains(&guess.names[*column].as_str());
            let is_free =
                matches!(guess.roles[*column], None | Some(Role::Label)) || places.contains(column);
            is_free && !is_caption && !is_ours
        };
        Ok(Self {
            width: guess.roles.len(),
            unit,
            time,
            thermistor: first(Role::Thermistor),
            number: first(Role::Number),
            sensor: first(Role::Sensor),
            device: first(Role::Device),
            boot: first(Role::Boot),
            labels: (0..guess.roles.len()).filter(is_label).collect(),
            pixels,
            has_names: guess.has_names,
            names: guess.names,
            notes: guess.notes,
        })
    }
}
