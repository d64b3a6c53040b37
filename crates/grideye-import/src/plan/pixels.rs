//! Which columns are the pixels, and in which unit.

use super::guess::{Guess, unnamed};
use super::names;
use super::unit::Sample;
use crate::cell::Cell;
use crate::columns::{CELSIUS, Unit};
use crate::error::ImportError;
use grideye_frame::PIXELS;
use grideye_recording::is_known_size;
use std::collections::BTreeMap;

/// As many columns besides the pixels may have no name.
const UNNAMED_MAX: usize = 32;
/// As many of one kind with the pixels are asked about.
const BESIDE_MAX: usize = 4;

impl Guess {
    pub(super) fn pixels(&self) -> Result<Vec<usize>, ImportError> {
        if let Some(said) = &self.said_pixels {
            return Ok(said.clone());
        }
        if self.has_names {
            let mut families = match names::families(&self.own_names()) {
                // Of two sensors, which is asked.
                Err(found) if found == 2 * PIXELS => Vec::new(),
                found => found.map_err(ImportError::other_sensor)?,
            };
            families.retain(|family| family.iter().all(|column| self.may_be_pixel(*column)));
            if let Some(family) = self.only(families)? {
                return Ok(family);
            }
        }
        let of_64 = self.lists.iter().filter(|(_, length)| *length == PIXELS);
        let lists = of_64
            .map(|(from, _)| (*from..from + PIXELS).collect())
            .collect();
        if let Some(list) = self.only(lists)? {
            return Ok(list);
        }
        self.pixels_by_values()
    }

    /// Nothing for columns without a name.
    pub(super) fn own_names(&self) -> Vec<String> {
        let names = self.names.iter().enumerate();
        names
            .map(|(column, name)| {
                if *name == unnamed(column) {
                    String::new()
                } else {
                    name.clone()
                }
            })
            .collect()
    }

    /// The only family of 64 columns, if there is one.
    pub(super) fn only(
        &self,
        mut families: Vec<Vec<usize>>,
    ) -> Result<Option<Vec<usize>>, ImportError> {
        if families.len() < 2 {
            return Ok(families.pop());
        }
        let first = |family: &Vec<usize>| self.names[family[0]].trim_end_matches("[0]").to_owned();
        if let Some(own) = families.iter().position(|family| first(family) == CELSIUS) {
            return Ok(Some(families.swap_remove(own)));
        }
        let choices: Vec<String> = families
            .iter()
            .map(|family| format!("--columns pixels={}", first(family)))
            .collect();
        Err(ImportError::refused(
            format!(
                "{} times 64 columns may be the pixels: those of {}",
                families.len(),
                families.iter().map(first).collect::<Vec<_>>().join(" and ")
            ),
            format!(
                "say which; of two sensors convert one after the other: {}",
                choices.join(" or ")
            ),
        ))
    }

    pub(super) fn may_be_pixel(&self, column: usize) -> bool {
        let facts = &self.facts[column];
        self.roles[column].is_none() && (facts.is_number || facts.is_nothing)
    }

    /// Columns of numbers side by side: where each run begins and ends.
    fn runs(&self) -> Vec<(usize, usize)> {
        let mut runs: Vec<(usize, usize)> = Vec::new();
        // Where some columns have no name, those with one are something else.
        let is_unnamed = |column: usize| self.names[column] == unnamed(column);
        let only_unnamed = (0..self.roles.len())
            .filter(|column| is_unnamed(*column))
            .count()
            >= PIXELS;
        for column in 0..self.roles.len() {
            let is_named_otherwise = self.has_names
                && (names::role(&self.names[column]).is_some()
                    || only_unnamed && !is_unnamed(column));
            if !self.may_be_pixel(column) || is_named_otherwise {
                continue;
            }
            match runs.last_mut() {
                Some((_, end)) if *end == column => *end += 1,
                _ => runs.push((column, column + 1)),
            }
        }
        runs
    }

    /// The only 64 columns of numbers in a row that leave nothing but other things beside them.
    pub(super) fn pixels_by_values(&self) -> Result<Vec<usize>, ImportError> {
        let runs = self.runs();
        let longest = runs.iter().map(|(from, end)| end - from).max().unwrap_or(0);
        if longest < PIXELS {
            return Err(ImportError::no_frame(longest, self.rows.len()));
        }
        if longest / PIXELS == 2 && longest < 2 * PIXELS + 8 {
            let first = runs
                .iter()
                .find(|(from, end)| end - from == longest)
                .map_or(1, |(from, _)| from + 1);
            return Err(ImportError::refused(
                format!("{longest} numbers in a row: two frames, or the bytes of one"),
                format!(
                    "take one sensor after the other: --columns pixels={first}-{}, then --columns pixels={}-{}; bytes must be joined to words, the low one first",
                    first + 63,
                    first + 64,
                    first + 127
                ),
            ));
        }
        if longest > PIXELS + UNNAMED_MAX {
            // A few numbers may stand beside the pixels of another sensor.
            let known = (0..4)
                .map(|beside| longest - beside)
                .find(|pixels| is_known_size(*pixels));
            return Err(ImportError::other_sensor(known.unwrap_or(longest)));
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
            // Beside a few columns it is a question; more of the same kind are an image that was interpolated.
            [] if longest > PIXELS + BESIDE_MAX => Err(ImportError::refused(
                format!(
                    "{longest} numbers in a row, all of one kind, where a Grid-EYE has 64: as of an image that was interpolated"
                ),
                "these are rows of an image that was interpolated, of which the 8 x 8 pixels cannot be had: record what the sensor gave",
            )),
            _ => Err(self.which_64(longest)),
        }
    }

    pub(super) fn which_64(&self, longest: usize) -> ImportError {
        // A thermistor's words are four times as fine as those of the pixels, and the chip is warmer.
        let middle = |column: usize| self.facts[column].median;
        let of_all = middle(self.roles.len() / 2);
        let is_thermistor =
            |column: usize| (3.0..8.0).contains(&(middle(column) / of_all)) && of_all > 0.0;
        let example = match (is_thermistor(0), is_thermistor(longest - 1)) {
            (true, _) => "--columns thermistor=1,pixels=2-65".to_owned(),
            (_, true) => format!("--columns pixels=1-64,thermistor={longest}"),
            _ => format!(
                "--columns pixels=2-65 if the first is none, --columns pixels=1-64,label={longest} if the last is none"
            ),
        };
        ImportError::refused(
            format!("which 64 of {longest} columns of numbers are the pixels is not clear"),
            format!("name them, and what else is known: {example}"),
        )
    }

    /// Whether a column of numbers beside pixels is something else: it rises, has another step, or is a label of integers
    /// beside fractions.
    pub(super) fn is_no_pixel(&self, column: usize, pixel: usize) -> bool {
        let (facts, pixels) = (&self.facts[column], &self.facts[pixel..pixel + PIXELS]);
        let quarters = pixels.iter().all(|pixel| pixel.is_quarter);
        let some_fractions = pixels.iter().filter(|pixel| !pixel.is_integer).count() > PIXELS / 2;
        let is_finer = quarters && facts.is_sixteenth && !facts.is_quarter;
        let is_label = facts.is_integer && some_fractions && self.rows.len() > 2;
        facts.is_large || facts.rises && self.rows.len() > 1 || facts.counts || is_finer || is_label
    }

    /// What is said, what stands behind the numbers or in their names, else what they are.
    pub(super) fn unit(
        &mut self,
        pixels: &[usize],
        said: Option<Unit>,
        known: Option<Unit>,
    ) -> Result<Unit, ImportError> {
        if let Some(said) = said {
            return Ok(said);
        }
        let named = pixels
            .first()
            .and_then(|column| names::value_unit(self.names[*column].trim_end_matches("[0]")));
        let mut decimals = BTreeMap::<i32, usize>::new();
        let frames = self.rows.iter().map(|row| {
            let cells = pixels.iter().map(|column| &row[*column]);
            for cell in cells.clone() {
                *decimals.entry(decimals_of(&cell.text())).or_default() += 1;
            }
            cells.map(Cell::number).collect()
        });
        let frames: Vec<Vec<Option<f64>>> = frames.collect();
        // The most that a tenth of the values have: the others end in zeros.
        let count = frames.len() * PIXELS;
        let often = decimals
            .iter()
            .rev()
            .find(|(_, found)| **found * 10 >= count);
        let decimals = often.map_or(0, |(decimals, _)| *decimals);
        let (unit, note) = Sample { frames, decimals }.tell(known.or(named))?;
        self.notes
            .extend(note.map(|note| format!("the pixels were taken for {note}")));
        Ok(unit)
    }
}

fn decimals_of(text: &str) -> i32 {
    let decimals = text
        .split_once('.')
        .map_or(0, |(_, decimals)| decimals.len());
    i32::try_from(decimals).unwrap_or(0).min(9)
}
