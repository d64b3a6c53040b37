//! Frames to look at before a dataset is made.

use crate::error::DatasetError;
use crate::frames::Frames;
use std::collections::{BTreeMap, BTreeSet};

/// Frames in a row of the preview.
const COLUMNS: u64 = 12;
/// Clips shown.
const CLIPS: u64 = 8;
/// Frames among which those of each class are sought, and further ones while a class is missing.
const SOUGHT: u64 = 1_000;
const SOUGHT_MAX: u64 = 20_000;
/// Clips among which those of each class are sought.
const CLIPS_SOUGHT: u64 = 100;

/// Where colors end: a cup of coffee would make people invisible.
const CUT_C: [f64; 2] = [-2.0, 4.0];

/// A frame to look at.
#[derive(Debug)]
pub struct Seen {
    /// How many agents count as in view.
    pub people: u64,
    /// What the first agent who is there does.
    pub doing: Option<&'static str>,
    /// What the sensor measures beyond the frame's median, °C, cut at -2 and 4.
    pub celsius: Vec<f64>,
}

/// The first frames of each class, a row for each number of people in view; or of each of the first clips, frames evenly
/// spread over it, and of the first further clips with what is done in no other. None is beyond `count`.
///
/// # Errors
/// As [`make`](crate::make), for these frames.
pub fn preview(frames: &Frames, count: u64) -> Result<Vec<Vec<Seen>>, DatasetError> {
    let mut maker = frames.maker();
    let mut seen = |index| {
        let labeled = maker.frame(index)?;
        let mut sorted = labeled.celsius.clone();
        sorted.sort_by(f64::total_cmp);
        let median_c = sorted[sorted.len() / 2];
        Ok::<_, DatasetError>(Seen {
            people: labeled.people(),
            doing: labeled
                .agents
                .iter()
                .flatten()
                .find_map(|label| label.doing),
            celsius: labeled
                .celsius
                .iter()
                .map(|celsius| (celsius - median_c).clamp(CUT_C[0], CUT_C[1]))
                .collect(),
        })
    };
    let clip = frames.subject.clip;
    if clip > 1 {
        let columns = COLUMNS.min(clip);
        let mut row = |number: u64| -> Result<Vec<Seen>, DatasetError> {
            let index = |column: u64| number * clip + column * (clip - 1) / (columns - 1).max(1);
            (0..columns).map(|column| seen(index(column))).collect()
        };
        let mut rows: Vec<Vec<Seen>> = Vec::new();
        let mut shown = BTreeSet::new();
        for number in 0..CLIPS_SOUGHT.min(count / clip) {
            let row: Vec<Seen> = row(number)?;
            let doings = row.iter().map(|seen| seen.doing);
            let has_more = doings.filter(|doing| shown.insert(*doing)).count() > 0;
            if has_more || number < CLIPS {
                rows.push(row);
            }
        }
        return Ok(rows);
    }
    let classes = frames.agents().len() + 1;
    let mut rows: BTreeMap<u64, Vec<Seen>> = BTreeMap::new();
    for index in 0..count.min(SOUGHT_MAX) {
        if index >= SOUGHT && rows.len() == classes {
            break;
        }
        let seen = seen(index)?;
        let row = rows.entry(seen.people).or_default();
        if u64::try_from(row.len()).unwrap_or(COLUMNS) < COLUMNS {
            row.push(seen);
        }
    }
    Ok(rows.into_values().collect())
}
