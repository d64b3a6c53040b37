//! What the caller says about a file's columns.

use crate::error::ImportError;
use crate::moment::offset_ns;
use core::str::FromStr;
use grideye_frame::ROWS;

/// Of several images of a row, this one is taken: a dataset's parts have it beside others.
pub(crate) const CELSIUS: &str = "celsius";

grideye_frame::named! {
    /// What a column is, in the words of the option.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
    pub(crate) enum Role {
        Time = "time";
        Pixels = "pixels";
        Thermistor = "thermistor";
        Number = "number";
        Sensor = "sensor";
        Device = "device";
        Boot = "boot";
        Label = "label";
    }
}

/// What the pixels' numbers are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// Degrees Celsius.
    Celsius,
    /// Degrees Fahrenheit.
    Fahrenheit,
    /// Kelvin.
    Kelvin,
    /// Tenths of a degree Celsius.
    Tenths,
    /// Hundredths of a degree Celsius.
    Hundredths,
    /// The sensor's raw words, 0.25 °C a step, in two's complement.
    Words,
    /// The same in sign and magnitude, as the thermistor has them: bit 11 is the sign.
    SignMagnitude,
}

/// What each unit is called in the option, then in other words.
const UNITS: [(&str, Unit); 9] = [
    ("celsius", Unit::Celsius),
    ("fahrenheit", Unit::Fahrenheit),
    ("kelvin", Unit::Kelvin),
    ("tenths", Unit::Tenths),
    ("hundredths", Unit::Hundredths),
    ("words", Unit::Words),
    ("words-sign-magnitude", Unit::SignMagnitude),
    ("degrees", Unit::Celsius),
    ("counts", Unit::Words),
];

impl Unit {
    /// As the option has it.
    pub(crate) fn name(self) -> &'static str {
        let found = UNITS.iter().find(|(_, unit)| *unit == self);
        found.map_or("celsius", |(name, _)| name)
    }

    /// Of what stands behind a number.
    pub(crate) fn behind(suffix: &str) -> Option<Self> {
        match suffix.chars().last()? {
            'C' => Some(Self::Celsius),
            'F' => Some(Self::Fahrenheit),
            'K' => Some(Self::Kelvin),
            _ => None,
        }
    }

    /// Whether a number is a raw word.
    pub(crate) const fn is_words(self) -> bool {
        matches!(self, Self::Words | Self::SignMagnitude)
    }

    /// Degrees Celsius of a number that is no raw word.
    pub(crate) fn celsius(self, value: f64) -> f64 {
        match self {
            Self::Fahrenheit => (value - 32.0) / 1.8,
            Self::Kelvin => value - 273.15,
            Self::Tenths => value / 10.0,
            Self::Hundredths => value / 100.0,
            Self::Celsius | Self::Words | Self::SignMagnitude => value,
        }
    }

    /// Its steps in a degree Celsius.
    pub(crate) const fn per_degree(self) -> f64 {
        match self {
            Self::Celsius | Self::Kelvin => 1.0,
            Self::Fahrenheit => 1.8,
            Self::Words | Self::SignMagnitude => 4.0,
            Self::Tenths => 10.0,
            Self::Hundredths => 100.0,
        }
    }
}

/// To which frame the lines between frames belong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Between {
    /// They stand before it.
    Before,
    /// They stand behind it.
    Behind,
}

/// What is said about a file's columns, instead of guessing: `time=1,pixels=2-65,thermistor=none,unit=words`.
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
    /// Of times without a zone, or with one of letters: nanoseconds east of UTC.
    pub(crate) zone_ns: Option<i64>,
    /// The row of a frame in the first line of eight numbers, from 0.
    pub(crate) first_row: Option<usize>,
    pub(crate) between: Option<Between>,
}

/// Where a column is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Place {
    Nowhere,
    /// From 0, with the last one.
    Range(usize, usize),
    Named(String),
}

const GRAMMAR: &str = "time, pixels, thermistor, number, sensor, device, boot or label = a column's number or name, or none; pixels=2-65 is a range; unit=celsius, fahrenheit, kelvin, tenths, hundredths, words or words-sign-magnitude; zone=UTC or +01:00; first-row=1 to 8; between=before or behind; sheet=a sheet's name or number";

impl FromStr for Columns {
    type Err = ImportError;

    fn from_str(text: &str) -> Result<Self, ImportError> {
        let refused = |part: &str| {
            ImportError::refused(format!("expected ROLE=COLUMN, found {part:?}"), GRAMMAR)
        };
        let mut columns = Self::default();
        for part in text.split(',') {
            let (role, place) = part.split_once('=').ok_or_else(|| refused(part))?;
            let (role, place) = (role.trim(), place.trim());
            if columns.setting(role, place).ok_or_else(|| refused(part))? {
                continue;
            }
            let role = Role::from_name(role).ok_or_else(|| refused(part))?;
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

impl Columns {
    /// What is said of all columns; `Some(false)` if it is said of one, `None` if it is wrong.
    fn setting(&mut self, key: &str, value: &str) -> Option<bool> {
        match key {
            "unit" => {
                let known = UNITS.iter().find(|(name, _)| *name == value);
                self.unit = Some(known?.1);
            }
            "sheet" => self.sheet = Some((!value.is_empty()).then(|| value.to_owned())?),
            "zone" => self.zone_ns = Some(offset_ns(value).flatten()?),
            "first-row" => {
                let row = value.parse::<usize>().ok()?.checked_sub(1);
                self.first_row = Some(row.filter(|row| *row < ROWS)?);
            }
            "between" => {
                self.between = Some(match value {
                    "before" => Between::Before,
                    "behind" => Between::Behind,
                    _ => return None,
                });
            }
            _ => return Some(false),
        }
        Some(true)
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
