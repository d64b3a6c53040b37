//! Which column is what, told from names and from the first rows.

mod facts;
mod names;

use crate::cell::{Cell, Field, RawRow};
use crate::columns::{Columns, Place, Role, Unit};
use crate::error::ImportError;
use crate::moment::{Decimal, Order, order_of};
use facts::{Facts, Stamps};
use grideye_frame::PIXELS;
use std::collections::BTreeMap;

/// As many columns besides the pixels may have no name.
const UNNAMED_MAX: usize = 32;

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
}

/// The columns of the time, and how to read them.
#[derive(Debug)]
pub(crate) struct Time {
    /// One, or those of the day and of the time of day.
    pub(crate) columns: Vec<usize>,
    pub(crate) order: Order,
    /// For numbers: the power of ten between their unit and nanoseconds, and whether they count from 1970.
    pub(crate) unit: Option<(i32, bool)>,
}

struct Guess {
    names: Vec<String>,
    has_names: bool,
    facts: Vec<Facts>,
    roles: Vec<Option<Role>>,
    /// Roles that are said to be nowhere.
    never: Vec<Role>,
    order: Result<Order, ()>,
    rows: Vec<Vec<Cell>>,
    /// Where lists begin, and their lengths.
    lists: Vec<(usize, usize)>,
}

impl Plan {
    /// # Errors
    /// [`ImportError::Unclear`] with what to say, [`ImportError::OtherSensor`].
    pub(crate) fn of(
        names: Option<&[String]>,
        sample: &[RawRow],
        said: &Columns,
    ) -> Result<Self, ImportError> {
        let mut guess = Guess::new(names, sample)?;
        guess.take_what_is_said(said)?;
        let pixels = guess.pixels(said)?;
        for column in &pixels {
            guess.roles[*column] = Some(Role::Pixels);
        }
        guess.take_what_names_say();
        guess.take_what_values_say(&pixels);
        let unit = match said.unit {
            Some(unit) => unit,
            None => guess.unit(&pixels)?,
        };
        let time = guess.time(said)?;
        let first = |role| guess.roles.iter().position(|found| *found == Some(role));
        let is_label = |column: &usize| {
            let facts = &guess.facts[*column];
            let is_caption = !guess.has_names && !facts.is_number && facts.is_constant;
            let is_ours = DERIVED.contains(&guess.names[*column].as_str());
            matches!(guess.roles[*column], None | Some(Role::Label)) && !is_caption && !is_ours
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
        })
    }
}

impl Guess {
    fn new(names: Option<&[String]>, sample: &[RawRow]) -> Result<Self, ImportError> {
        let width = most_common_width(sample).ok_or_else(|| ImportError::no_frame(0))?;
        let like: Vec<&RawRow> = sample.iter().filter(|row| row.width() == width).collect();
        let model = like.first().ok_or_else(|| ImportError::no_frame(0))?;
        let (mut flat_names, mut lists) = (Vec::new(), Vec::new());
        for (index, field) in model.fields.iter().enumerate() {
            let name = names
                .and_then(|names| names.get(index))
                .cloned()
                .unwrap_or_default();
            match field {
                Field::One(_) => flat_names.push(name),
                Field::Many(cells) => {
                    lists.push((flat_names.len(), cells.len()));
                    flat_names.extend((0..cells.len()).map(|cell| format!("{name}[{cell}]")));
                }
            }
        }
        let rows: Vec<Vec<Cell>> = like.iter().map(|row| row.flat()).collect();
        let texts: Vec<&str> = rows
            .iter()
            .flatten()
            .filter_map(|cell| match cell {
                Cell::Text(text) if text.len() >= 8 => Some(text.as_str()),
                _ => None,
            })
            .collect();
        let order = order_of(texts.into_iter());
        let facts = (0..width).map(|column| {
            Facts::of(
                rows.iter().map(|row| &row[column]),
                Some(order.unwrap_or(Order::DayFirst)),
            )
        });
        Ok(Self {
            facts: facts.collect(),
            has_names: names.is_some(),
            names: flat_names
                .into_iter()
                .enumerate()
                .map(|(column, name)| match name.as_str() {
                    "" => format!("column{}", column + 1),
                    _ => name,
                })
                .collect(),
            roles: vec![None; width],
            never: Vec::new(),
            order,
            rows,
            lists,
        })
    }

    fn take_what_is_said(&mut self, said: &Columns) -> Result<(), ImportError> {
        for (role, place) in &said.said {
            let columns = match place {
                Place::Nowhere => {
                    self.never.push(*role);
                    continue;
                }
                Place::Range(first, last) => *first..last + 1,
                Place::Named(name) => {
                    let found = self
                        .names
                        .iter()
                        .position(|known| known == name || known == &format!("{name}[0]"));
                    let found = found.ok_or_else(|| self.no_such(name))?;
                    match role {
                        Role::Pixels => found..found + PIXELS,
                        _ => found..found + 1,
                    }
                }
            };
            if columns.end > self.roles.len() {
                return Err(self.no_such(&columns.end.to_string()));
            }
            columns.for_each(|column| self.roles[column] = Some(*role));
        }
        Ok(())
    }

    fn no_such(&self, name: &str) -> ImportError {
        let known: Vec<&str> = self.names.iter().take(8).map(String::as_str).collect();
        let what = format!("there is no column {name}");
        ImportError::unclear(
            what,
            format!(
                "the {} columns begin with {}",
                self.names.len(),
                known.join(" ")
            ),
        )
    }

    fn pixels(&self, said: &Columns) -> Result<Vec<usize>, ImportError> {
        let is_said = |column: &usize| self.roles[*column] == Some(Role::Pixels);
        let said_pixels: Vec<usize> = (0..self.roles.len()).filter(is_said).collect();
        if said_pixels.len() == PIXELS {
            return Ok(said_pixels);
        }
        if self.has_names && said.said.iter().all(|(role, _)| *role != Role::Pixels) {
            match names::pixels(&self.names) {
                Ok(Some(pixels)) if pixels.iter().all(|column| self.may_be_pixel(*column)) => {
                    return Ok(pixels);
                }
                Err(found) => return Err(ImportError::OtherSensor { found }),
                Ok(_) => {}
            }
        }
        let of_64: Vec<usize> = self
            .lists
            .iter()
            .filter(|(_, length)| *length == PIXELS)
            .map(|(from, _)| *from)
            .collect();
        if let [from] = of_64[..] {
            return Ok((from..from + PIXELS).collect());
        }
        self.pixels_by_values()
    }

    fn may_be_pixel(&self, column: usize) -> bool {
        let facts = &self.facts[column];
        self.roles[column].is_none() && (facts.is_number || facts.is_nothing)
    }

    /// The only 64 columns of numbers in a row that leave nothing but other things beside them.
    fn pixels_by_values(&self) -> Result<Vec<usize>, ImportError> {
        let mut runs: Vec<(usize, usize)> = Vec::new();
        for column in 0..self.roles.len() {
            let is_named_otherwise = self.has_names && names::role(&self.names[column]).is_some();
            if !self.may_be_pixel(column) || is_named_otherwise {
                continue;
            }
            match runs.last_mut() {
                Some((_, end)) if *end == column => *end += 1,
                _ => runs.push((column, column + 1)),
            }
        }
        let longest = runs.iter().map(|(from, end)| end - from).max().unwrap_or(0);
        if longest < PIXELS {
            return Err(ImportError::no_frame(longest));
        }
        if longest > PIXELS + UNNAMED_MAX {
            return Err(ImportError::OtherSensor { found: longest });
        }
        let mut fitting = Vec::new();
        for (from, end) in runs {
            for first in from..(end + 1).saturating_sub(PIXELS) {
                let block = first..first + PIXELS;
                let mut beside = (from..end).filter(|column| !block.contains(column));
                let is_alone = beside.all(|column| self.is_no_pixel(column, first));
                if is_alone && !block.clone().any(|column| self.facts[column].is_large) {
                    // By chance a pixel rises too, in a few rows.
                    fitting.push((
                        block.filter(|column| self.facts[*column].rises).count(),
                        first,
                    ));
                }
            }
        }
        fitting.sort_unstable();
        match fitting[..] {
            [(_, first)] => Ok((first..first + PIXELS).collect()),
            [(rising, first), (more, _), ..] if rising < more => {
                Ok((first..first + PIXELS).collect())
            }
            _ => Err(ImportError::unclear(
                format!("which 64 of {longest} columns of numbers are the pixels is not clear"),
                format!(
                    "name them, and what else is known: --columns pixels=2-65,time=1, or --columns pixels=1-64,label={longest}"
                ),
            )),
        }
    }

    /// Whether a column of numbers beside pixels is something else: it rises, has another step, or is a label of integers
    /// beside fractions.
    fn is_no_pixel(&self, column: usize, pixel: usize) -> bool {
        let (facts, pixels) = (&self.facts[column], &self.facts[pixel..pixel + PIXELS]);
        let quarters = pixels.iter().all(|pixel| pixel.is_quarter);
        let some_fractions = pixels.iter().filter(|pixel| !pixel.is_integer).count() > PIXELS / 2;
        let is_finer = quarters && facts.is_sixteenth && !facts.is_quarter;
        let is_label = facts.is_integer && some_fractions && self.rows.len() > 2;
        facts.is_large || facts.rises && self.rows.len() > 1 || facts.counts || is_finer || is_label
    }

    fn take_what_names_say(&mut self) {
        if !self.has_names {
            return;
        }
        for column in 0..self.roles.len() {
            if self.roles[column].is_some() {
                continue;
            }
            let found = names::role(&self.names[column]).filter(|role| !self.never.contains(role));
            let facts = &self.facts[column];
            let fits = match found {
                Some(Role::Time) => facts.is_number || facts.stamps.is_some(),
                Some(Role::Number) => facts.is_integer,
                Some(Role::Thermistor) => {
                    facts.is_number && !self.roles.contains(&Some(Role::Thermistor))
                }
                _ => true,
            };
            self.roles[column] = found.filter(|_| fits);
        }
    }

    /// Roles of columns without a name that says one.
    fn take_what_values_say(&mut self, pixels: &[usize]) {
        let is_quarter = pixels.iter().all(|column| self.facts[*column].is_quarter);
        for column in 0..self.roles.len() {
            let facts = &self.facts[column];
            let is_named = self.has_names && !self.names[column].starts_with("column");
            if self.roles[column].is_some()
                || (is_named && facts.stamps.is_none() && !(facts.is_large && facts.rises))
            {
                continue;
            }
            let has = |role: Role| self.roles.contains(&Some(role));
            let role = match facts {
                _ if facts.stamps.is_some() => Some(Role::Time),
                _ if facts.is_large => Some(Role::Time),
                _ if facts.counts && !has(Role::Number) => Some(Role::Number),
                _ if facts.rises && self.rows.len() > 1 && !has(Role::Time) => Some(Role::Time),
                _ if is_quarter
                    && facts.is_sixteenth
                    && !facts.is_quarter
                    && !has(Role::Thermistor) =>
                {
                    Some(Role::Thermistor)
                }
                _ => None,
            };
            self.roles[column] = role.filter(|role| !self.never.contains(role));
        }
    }

    /// Rooms above 13.75 °C have raw words of 55 and more; no room has 45 °C.
    fn unit(&self, pixels: &[usize]) -> Result<Unit, ImportError> {
        if !pixels.iter().all(|column| self.facts[*column].is_integer) {
            return Ok(Unit::Degrees);
        }
        let mut values: Vec<f64> = pixels
            .iter()
            .flat_map(|column| {
                self.rows
                    .iter()
                    .filter_map(move |row| row[*column].number())
            })
            .collect();
        values.sort_by(f64::total_cmp);
        match values.get(values.len() / 2) {
            Some(median) if *median >= 55.0 => Ok(Unit::Counts),
            Some(median) if *median >= 45.0 => Err(ImportError::unclear(
                format!(
                    "whether pixels of {median} are {median} °C or raw words of {} °C is not clear",
                    median / 4.0
                ),
                "say which: --columns unit=degrees or --columns unit=counts",
            )),
            _ => Ok(Unit::Degrees),
        }
    }

    /// The time of the columns that may have it: a stamp with its day before all, then a day beside a time of day, then
    /// numbers since 1970, then others. The rest become labels.
    fn time(&mut self, said: &Columns) -> Result<Option<Time>, ImportError> {
        let is_time = |column: &usize| self.roles[*column] == Some(Role::Time);
        let all: Vec<usize> = (0..self.roles.len()).filter(is_time).collect();
        let of = |stamps: Stamps| {
            all.iter()
                .copied()
                .find(|column| self.facts[*column].stamps == Some(stamps))
        };
        let units = all
            .iter()
            .filter_map(|column| Some((*column, self.time_unit(*column)?)));
        let units: Vec<(usize, (i32, bool))> = units.collect();
        let since_1970 = units.iter().find(|(_, (_, is_utc))| *is_utc);
        let (columns, unit) = match (of(Stamps::Whole), of(Stamps::Day), of(Stamps::Clock)) {
            (Some(whole), ..) => (vec![whole], None),
            (None, Some(day), Some(clock)) => (vec![day, clock], None),
            (None, _, Some(clock)) if since_1970.is_none() => (vec![clock], None),
            _ => match since_1970.or(units.first()) {
                Some((column, unit)) => (vec![*column], Some(*unit)),
                None => (Vec::new(), None),
            },
        };
        for column in all {
            if !columns.contains(&column) {
                self.roles[column] = Some(Role::Label);
            }
        }
        if columns.is_empty() {
            return match said
                .said
                .iter()
                .find(|(role, place)| *role == Role::Time && *place != Place::Nowhere)
            {
                None => Ok(None),
                Some(_) => Err(ImportError::unclear(
                    "the column of the time holds no times",
                    "a time is Unix time, ISO 8601 or a time of day; --columns time=none takes the frames' rate",
                )),
            };
        }
        let order = self.order.map_err(|()| {
            ImportError::unclear(
                "whether the day or the month comes first in the dates is not clear",
                "write them as 2021-07-01, or take the frames' rate: --columns time=none",
            )
        });
        Ok(Some(Time {
            columns,
            order: order?,
            unit,
        }))
    }

    /// The unit of a column of numbers, and whether they count from 1970.
    fn time_unit(&self, column: usize) -> Option<(i32, bool)> {
        let texts = self.rows.iter().map(|row| row[column].text());
        let numbers: Vec<Decimal> = texts.filter_map(|text| Decimal::parse(&text)).collect();
        let first = numbers.first()?.scaled(0)?;
        // Times since 1973, in the unit that makes it so.
        let since_1970 = [
            (100_000_000_000_000_000, 0),
            (100_000_000_000_000, 3),
            (100_000_000_000, 6),
            (100_000_000, 9),
        ];
        let absolute = since_1970.into_iter().find(|(least, _)| first >= *least);
        if let Some((_, unit)) = absolute {
            return Some((unit, true));
        }
        if let Some(unit) = names::unit(&self.names[column]) {
            return Some((unit, false));
        }
        if !numbers.iter().all(|number| number.is_integer()) {
            return Some((9, false));
        }
        let mut steps: Vec<i64> = numbers
            .windows(2)
            .filter_map(|pair| Some(pair[1].scaled(0)? - pair[0].scaled(0)?))
            .collect();
        steps.sort_unstable();
        // Frames come every tenth of a second to every ten.
        Some(match steps.get(steps.len() / 2) {
            Some(20_000_000..) => (0, false),
            Some(20_000..) => (3, false),
            Some(20..) => (6, false),
            _ => (9, false),
        })
    }
}

/// Of equally common ones the greatest: a torn row is shorter.
fn most_common_width(sample: &[RawRow]) -> Option<usize> {
    let mut counts = BTreeMap::<usize, usize>::new();
    for row in sample {
        *counts.entry(row.width()).or_default() += 1;
    }
    let most = counts.into_iter().max_by_key(|(_, count)| *count);
    most.map(|(width, _)| width)
}
