//! What the values of one column have in common.

use crate::cell::Cell;
use crate::moment::{Moment, Order, parse};

/// A value from here on is no temperature, no count and no label.
const LARGE: f64 = 1e8;

#[derive(Debug, Clone, Copy)]
pub(super) struct Facts {
    /// Whether nearly all values are numbers, with some there.
    pub(super) is_number: bool,
    /// Whether there is no value at all.
    pub(super) is_nothing: bool,
    pub(super) is_integer: bool,
    /// Whether all are multiples of 0.25, and of 0.0625.
    pub(super) is_quarter: bool,
    pub(super) is_sixteenth: bool,
    /// Whether each is greater than the one before; of one value nothing is known.
    pub(super) rises: bool,
    /// Whether most are one more than the one before.
    pub(super) counts: bool,
    pub(super) is_large: bool,
    pub(super) median: f64,
    /// Whether all values are the same.
    pub(super) is_constant: bool,
    /// Whether nearly all are stamps of a day and a time, of a day, or of a time alone.
    pub(super) stamps: Option<Stamps>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stamps {
    Whole,
    Day,
    Clock,
}

impl Facts {
    pub(super) fn of<'c>(
        cells: impl Iterator<Item = &'c Cell> + Clone,
        order: Option<Order>,
    ) -> Self {
        let there = cells.filter(|cell| !cell.is_empty());
        let numbers: Vec<f64> = there.clone().filter_map(Cell::number).collect();
        let count = there.clone().count();
        let is_number = count > 0 && is_most(numbers.len(), count);
        let multiples =
            |steps: f64| is_number && numbers.iter().all(|number| (number * steps).fract() == 0.0);
        let pairs = || numbers.windows(2);
        let follow = pairs().filter(|pair| (pair[1] - pair[0] - 1.0).abs() < 1e-9);
        let is_integer = multiples(1.0);
        Self {
            is_number,
            is_nothing: count == 0,
            is_integer,
            is_quarter: multiples(4.0),
            is_sixteenth: multiples(16.0),
            rises: is_number && count > 1 && pairs().all(|pair| pair[1] > pair[0]),
            counts: is_integer && count > 1 && follow.count() * 10 >= 9 * (count - 1),
            median: median(&numbers),
            is_large: is_number && numbers.iter().all(|number| *number >= LARGE),
            is_constant: there
                .clone()
                .zip(there.clone().skip(1))
                .all(|(one, next)| one == next),
            stamps: stamps(there, order),
        }
    }
}

fn median(numbers: &[f64]) -> f64 {
    let mut sorted = numbers.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

/// A few damaged values do not change what a column is.
const fn is_most(found: usize, of: usize) -> bool {
    found * 4 >= of * 3
}

fn stamps<'c>(there: impl Iterator<Item = &'c Cell>, order: Option<Order>) -> Option<Stamps> {
    let (mut found, mut count) = ([0_usize; 3], 0);
    for cell in there {
        count += 1;
        match parse(&cell.text(), order) {
            Some(Moment::Utc(_) | Moment::Local(_)) => found[0] += 1,
            Some(Moment::Day(_)) => found[1] += 1,
            Some(Moment::Clock(_)) => found[2] += 1,
            Some(Moment::Number(_)) | None => {}
        }
    }
    let kinds = [Stamps::Whole, Stamps::Day, Stamps::Clock];
    let mut kinds = kinds.into_iter().zip(found);
    let kind = kinds.find(|(_, found)| *found > 0 && is_most(*found, count));
    kind.map(|(kind, _)| kind)
}
