//! What is known of each column so far, and the roles that names and values give.

use super::facts::Facts;
use super::names;
use crate::cell::{Cell, Field, RawRow, short};
use crate::columns::{Columns, Place, Role, Unit};
use crate::error::ImportError;
use crate::moment::{Order, order_of};
use grideye_frame::PIXELS;
use std::collections::{BTreeMap, BTreeSet};

pub(super) struct Guess {
    pub(super) names: Vec<String>,
    pub(super) has_names: bool,
    pub(super) facts: Vec<Facts>,
    pub(super) roles: Vec<Option<Role>>,
    /// Roles that are said to be nowhere.
    pub(super) never: Vec<Role>,
    pub(super) order: Result<Order, ()>,
    pub(super) rows: Vec<Vec<Cell>>,
    /// Where lists begin, and their lengths.
    pub(super) lists: Vec<(usize, usize)>,
    /// The columns of a family of names that were said to be the pixels.
    pub(super) said_pixels: Option<Vec<usize>>,
    pub(super) notes: Vec<String>,
}

impl Guess {
    pub(super) fn new(names: Option<&[String]>, sample: &[RawRow]) -> Result<Self, ImportError> {
        let whole = || sample.iter().filter(|row| !row.is_torn);
        let width = most_common_width(whole()).ok_or_else(|| ImportError::no_frame(0, 0))?;
        let like: Vec<&RawRow> = whole().filter(|row| row.width() == width).collect();
        let model = like.first().ok_or_else(|| ImportError::no_frame(0, 0))?;
        let (mut flat_names, mut lists) = (Vec::new(), Vec::new());
        for (index, field) in model.fields.iter().enumerate() {
            let name = names
                .and_then(|names| names.get(index))
                .map(|name| short(name).to_owned())
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
                    "" => unnamed(column),
                    _ => name,
                })
                .collect(),
            roles: vec![None; width],
            never: Vec::new(),
            order,
            rows,
            lists,
            said_pixels: None,
            notes: Vec::new(),
        })
    }

    pub(super) fn take_what_is_said(&mut self, said: &Columns) -> Result<(), ImportError> {
        for (role, place) in &said.said {
            let columns = match place {
                Place::Nowhere => {
                    self.never.push(*role);
                    continue;
                }
                Place::Range(first, last) => *first..last + 1,
                Place::Named(name) => {
                    let is_it = |known: &String| known == name || known == &format!("{name}[0]");
                    let found = self
                        .names
                        .iter()
                        .position(is_it)
                        .ok_or_else(|| self.no_such(name))?;
                    if *role == Role::Pixels {
                        let families = names::families(&self.own_names()).unwrap_or_default();
                        let family = families.into_iter().find(|family| family.contains(&found));
                        let family = family.unwrap_or_else(|| (found..found + PIXELS).collect());
                        if family.iter().any(|column| *column >= self.roles.len()) {
                            return Err(self.no_such(&format!("{name} with {PIXELS} columns")));
                        }
                        self.said_pixels = Some(family);
                        continue;
                    }
                    found..found + 1
                }
            };
            if columns.end > self.roles.len() {
                return Err(self.no_such(&columns.end.to_string()));
            }
            match role {
                Role::Pixels => self.said_pixels = Some(columns.collect()),
                _ => columns.for_each(|column| self.roles[column] = Some(*role)),
            }
        }
        Ok(())
    }

    pub(super) fn no_such(&self, name: &str) -> ImportError {
        let known: Vec<&str> = self.names.iter().take(8).map(String::as_str).collect();
        let what = format!("there is no column {name}");
        ImportError::refused(
            what,
            format!(
                "the {} columns begin with {}",
                self.names.len(),
                known.join(" ")
            ),
        )
    }

    pub(super) fn take_what_names_say(&mut self) {
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
                Some(Role::Number) => facts.is_integer && !facts.is_large,
                Some(Role::Thermistor) => {
                    facts.is_number && !self.roles.contains(&Some(Role::Thermistor))
                }
                _ => true,
            };
            self.roles[column] = found.filter(|_| fits);
            if found.is_none()
                && facts.rises
                && names::unit(&self.names[column]).is_some()
                && self.rows.len() > 2
            {
                self.roles[column] = Some(Role::Time);
            }
        }
    }

    /// Roles of columns without a name that says one.
    pub(super) fn take_what_values_say(&mut self, pixels: &[usize], unit: Unit) {
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
            let is_warmer =
                |column: &usize| (3.0..8.0).contains(&(facts.median / self.facts[*column].median));
            let role = match facts {
                _ if facts.stamps.is_some() => Some(Role::Time),
                _ if facts.is_large => Some(Role::Time),
                // The thermistor's words are four times as fine, and the chip is warmer than the scene.
                _ if unit == Unit::Words
                    && facts.is_integer
                    && !facts.rises
                    && !has(Role::Thermistor)
                    && pixels.iter().all(is_warmer) =>
                {
                    Some(Role::Thermistor)
                }
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

    /// Columns that say by their names, or by taking turns, of which sensor a row is: streams of their own, and labels.
    pub(super) fn take_places(&mut self) -> Vec<usize> {
        if self.roles.contains(&Some(Role::Sensor)) || self.never.contains(&Role::Sensor) {
            return Vec::new();
        }
        let is_place = |column: &usize| {
            let name = &self.names[*column];
            let is_called_so = self.has_names && names::is_place(name);
            let texts: Vec<_> = self.rows.iter().map(|row| row[*column].text()).collect();
            let distinct = texts.iter().collect::<BTreeSet<_>>().len();
            let changes = texts.windows(2).filter(|pair| pair[0] != pair[1]).count();
            // Labels change too, but in no order: after as many rows as there are sensors the first one is there again.
            let again = texts
                .iter()
                .zip(texts.iter().skip(distinct))
                .filter(|(one, next)| one == next)
                .count();
            let takes_turns = changes * 3 >= texts.len()
                && (is_called_so
                    || !self.facts[*column].is_number
                        && again * 5 >= 4 * texts.len().saturating_sub(distinct));
            let is_always_there = texts.iter().all(|text| !text.is_empty());
            self.roles[*column].is_none()
                && is_always_there
                && (2..=8).contains(&distinct)
                && distinct * 3 <= texts.len()
                && takes_turns
        };
        let found: Vec<usize> = (0..self.roles.len()).filter(is_place).take(1).collect();
        for column in &found {
            self.roles[*column] = Some(Role::Sensor);
            self.notes.push(format!(
                "{} takes turns: each of its values is a sensor of its own",
                self.names[*column]
            ));
        }
        found
    }

    /// The rows of the stream that the first row is of.
    pub(super) fn first_stream(&self) -> impl Iterator<Item = &Vec<Cell>> {
        let is_stream =
            |role: &Option<Role>| matches!(role, Some(Role::Sensor | Role::Device | Role::Boot));
        let columns: Vec<usize> = (0..self.roles.len())
            .filter(|column| is_stream(&self.roles[*column]))
            .collect();
        self.rows.iter().filter(move |row| {
            columns
                .iter()
                .all(|column| row[*column] == self.rows[0][*column])
        })
    }
}

/// What a column without a name is called.
pub(super) fn unnamed(column: usize) -> String {
    format!("column{}", column + 1)
}

/// Of equally common ones the greatest: a torn row is shorter.
fn most_common_width<'r>(sample: impl Iterator<Item = &'r RawRow>) -> Option<usize> {
    let mut counts = BTreeMap::<usize, usize>::new();
    for row in sample {
        *counts.entry(row.width()).or_default() += 1;
    }
    let most = counts.into_iter().max_by_key(|(_, count)| *count);
    most.map(|(width, _)| width)
}
