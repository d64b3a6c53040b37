//! What the caller says about a file's columns.

use crate::error::ImportError;
use core::str::FromStr;

/// What a column is, in the words of the option.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Role {
    Time,
    Pixels,
    Thermistor,
    Number,
    Sensor,
    Device,
    Boot,
    Label,
}

const ROLES: [(&str, Role); 8] = [
    ("time", Role::Time),
    ("pixels", Role::Pixels),
    ("thermistor", Role::Thermistor),
    ("number", Role::Number),
    ("sensor", Role::Sensor),
    ("device", Role::Device),
    ("boot", Role::Boot),
    ("label", Role::Label),
];

impl Role {
    pub(crate) fn name(self) -> &'static str {
        let found = ROLES.iter().find(|(_, role)| *role == self);
        found.map_or("label", |(name, _)| name)
    }
}

/// What the pixels' numbers are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// Degrees Celsius.
    Degrees,
    /// The sensor's raw words, 0.25 °C a step.
    Counts,
}

/// What is said about a file's columns, instead of guessing: `time=1,pixels=2-65,thermistor=none,unit=counts`.
///
/// ```
/// use grideye_import::Columns;
/// let columns: Columns = "time=when,pixels=2-65".parse()?;
/// assert!("pixels=2-64".parse::<Columns>().is_err());
/// # Ok::<(), grideye_import::ImportError>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Columns {
    pub(crate) said: Vec<(Role, Place)>,
    pub(crate) unit: Option<Unit>,
    /// A sheet's name, or its number from 1.
    pub(crate) sheet: Option<String>,
}

/// Where a column is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Place {
    Nowhere,
    /// From 0, with the last one.
    Range(usize, usize),
    Named(String),
}

const GRAMMAR: &str = "time, pixels, thermistor, number, sensor, device, boot or label = a column's number or name, or none; pixels=2-65 is a range; unit=degrees or unit=counts; sheet=a sheet's name or number";

impl FromStr for Columns {
    type Err = ImportError;

    fn from_str(text: &str) -> Result<Self, ImportError> {
        let refused = |part: &str| {
            ImportError::unclear(format!("expected ROLE=COLUMN, found {part:?}"), GRAMMAR)
        };
        let mut columns = Self::default();
        for part in text.split(',') {
            let (role, place) = part.split_once('=').ok_or_else(|| refused(part))?;
            let (role, place) = (role.trim(), place.trim());
            if role == "unit" {
                columns.unit = Some(match place {
                    "degrees" => Unit::Degrees,
                    "counts" => Unit::Counts,
                    _ => return Err(refused(part)),
                });
                continue;
            }
            if role == "sheet" && !place.is_empty() {
                columns.sheet = Some(place.to_owned());
                continue;
            }
            let known = ROLES.iter().find(|(name, _)| *name == role);
            let (_, role) = *known.ok_or_else(|| refused(part))?;
            let place = Place::of(place).ok_or_else(|| refused(part))?;
            let fits = match place {
                Place::Nowhere => false,
                Place::Named(_) => true,
                Place::Range(first, last) => last - first == 63,
            };
            if role == Role::Pixels && !fits {
                return Err(refused(part));
            }
            columns.said.push((role, place));
        }
        Ok(columns)
    }
}

impl Place {
    fn of(text: &str) -> Option<Self> {
        let index = |text: &str| text.parse::<usize>().ok()?.checked_sub(1);
        if text == "none" {
            return Some(Self::Nowhere);
        }
        if let Some((first, last)) = text.split_once('-') {
            if let (Some(first), Some(last)) = (index(first), index(last)) {
                return (first <= last).then_some(Self::Range(first, last));
            }
        }
        match index(text) {
            Some(index) => Some(Self::Range(index, index)),
            None if text.is_empty() || text == "0" => None,
            None => Some(Self::Named(text.to_owned())),
        }
    }
}
