//! Opens a file of any layout.

use crate::account::{Account, Tally};
use crate::allowance::{Allowance, ROW_VALUES_MAX, too_wide};
use crate::arrays::{NPY_MAGIC, npy, npz};
use crate::columns::Columns;
use crate::container::{self, Unpacked, held};
use crate::error::ImportError;
use crate::frames::{Assumed, Frames, name_of};
use crate::moment::{Moment, NS_PER_DAY, Order, parse};
use crate::plan::Plan;
use crate::source::Rows;
use crate::text::TextRows;
use crate::{json, tables};
use core::time::Duration;
use grideye_frame::PIXELS;
use grideye_recording::{Row, StreamId, csv, is_recording};
use std::collections::VecDeque;
use std::io::{Cursor, Read};

/// Rows by which the columns are told.
const SAMPLE_ROWS: usize = 256;
/// How a session of the LINAIGE data set begins (Xie, Daghero et al., arXiv 2304.06059).
const LINAIGE: &[u8] = b"timestamp,thermistor,pixel0,";

/// What is said about a file, instead of guessing.
#[derive(Debug, Clone)]
pub struct Options {
    /// Its columns.
    pub columns: Columns,
    /// Time from frame to frame, where the file has no times.
    pub period: Duration,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            columns: Columns::default(),
            period: grideye_frame::TICK,
        }
    }
}

/// The rows of a file, as an iterator that ends with the first error.
pub struct Import {
    rows: Source,
    account: Account,
    labels: Vec<String>,
    ended: bool,
}

enum Source {
    /// A recording of this project.
    Known(Box<dyn Iterator<Item = Result<Row, ImportError>> + Send>),
    Told(Box<Told>),
}

struct Told {
    sample: VecDeque<crate::cell::RawRow>,
    rows: Box<dyn Rows + Send>,
    frames: Frames,
    /// Why the sample ended early.
    broken: Option<ImportError>,
}

/// Opens a recording of any layout: this project's CSV, and what the crate's page lists. `name` is the file's
/// name; a day in it completes times of day, and it names the rows.
///
/// # Errors
/// [`ImportError`], with what to say in [`Options::columns`] where the columns are not clear.
pub fn open(
    input: impl Read + Send + 'static,
    name: &str,
    options: &Options,
) -> Result<Import, ImportError> {
    let allowance = Allowance::default();
    let Unpacked {
        head,
        rest,
        name,
        arrays,
        is_workbook,
    } = container::unpack(input, name, &allowance)?;
    let is_session = head.starts_with(LINAIGE);
    let is_known = is_session || is_recording(&head);
    if let Some(found) = other_resolution(&head).filter(|_| is_known) {
        return Err(ImportError::other_sensor(found));
    }
    let said = &options.columns;
    let sheet = said.sheet.as_deref();
    if let (Some(sheet), false) = (sheet, is_workbook) {
        return Err(ImportError::refused(
            format!("there is no sheet {sheet}"),
            "only a workbook (.xlsx) has sheets: leave sheet= out",
        ));
    }
    if is_known && !is_session {
        return recording(Cursor::new(head).chain(rest));
    }
    let is_array = head.starts_with(NPY_MAGIC);
    let is_parquet = head.starts_with(tables::MAGIC);
    let text = String::from_utf8_lossy(&head).into_owned();
    let input = Cursor::new(head).chain(rest);
    let rows: Box<dyn Rows + Send> = match arrays {
        Some(arrays) => Box::new(npz(arrays, said, &allowance)?),
        _ if is_workbook => workbook(held(input)?, said, &allowance)?,
        _ if is_array => Box::new(npy(held(input)?, &allowance)?),
        _ if is_parquet => Box::new(tables::rows(held(input)?, &allowance)?),
        _ if json::is_json(&text) => {
            let bytes = held(input)?;
            match json::rows(&String::from_utf8_lossy(&bytes), &allowance)? {
                Some(rows) => Box::new(rows),
                None => Box::new(TextRows::new(Cursor::new(bytes), said)?),
            }
        }
        _ => Box::new(TextRows::new(input, said)?),
    };
    told(rows, &name, options, is_session)
}

/// The number of pixels in a recording's header, if it is not a Grid-EYE's.
fn other_resolution(head: &[u8]) -> Option<usize> {
    let line = head.split(|&byte| byte == b'\n').next().unwrap_or_default();
    let is_whole = line.len() < head.len();
    let is_pixel = |name: &&[u8]| {
        let digits = name.trim_ascii().strip_prefix(b"pixel").unwrap_or_default();
        !digits.is_empty() && digits.iter().all(u8::is_ascii_digit)
    };
    let pixels = line.split(|&byte| byte == b',').filter(is_pixel).count();
    // A header that lacks only a few columns is faulty, and its reader names the fault.
    let is_other = pixels > PIXELS || (is_whole && pixels > 0 && pixels <= PIXELS / 2);
    is_other.then_some(pixels)
}

#[cfg(feature = "xlsx")]
fn workbook(
    bytes: Vec<u8>,
    said: &Columns,
    allowance: &Allowance,
) -> Result<Box<dyn Rows + Send>, ImportError> {
    Ok(Box::new(crate::sheets::rows(bytes, said, allowance)?))
}

#[cfg(not(feature = "xlsx"))]
fn workbook(
    _bytes: Vec<u8>,
    _said: &Columns,
    _allowance: &Allowance,
) -> Result<Box<dyn Rows + Send>, ImportError> {
    let expected = "a file that this build reads";
    Err(ImportError::unlike(
        expected,
        "a workbook",
        "save the sheet as CSV",
    ))
}

fn recording(input: impl Read + Send + 'static) -> Result<Import, ImportError> {
    let reader = csv::Reader::new(input)?;
    Ok(Import {
        labels: reader.labels().to_vec(),
        rows: Source::Known(Box::new(reader.map(|row| row.map_err(ImportError::from)))),
        account: Account {
            container: "a recording of this project".to_owned(),
            taken: Vec::new(),
        },
        ended: false,
    })
}

fn told(
    mut rows: Box<dyn Rows + Send>,
    name: &str,
    options: &Options,
    is_session: bool,
) -> Result<Import, ImportError> {
    let (mut sample, mut broken) = (Vec::new(), None);
    while sample.len() < SAMPLE_ROWS && broken.is_none() {
        match rows.next() {
            Ok(None) => break,
            Ok(Some(row)) if row.width() > ROW_VALUES_MAX => {
                return Err(too_wide(row.width(), &format!("in row {}", row.number)));
            }
            Ok(Some(row)) => sample.push(row),
            Err(error) if sample.is_empty() => return Err(error),
            Err(error) => broken = Some(error),
        }
    }
    let plan = Plan::of(rows.names(), &sample, &options.columns, rows.unit())?;
    let midnight_ns = midnight_ns(name);
    if is_session && midnight_ns.is_none() {
        return Err(ImportError::refused(
            format!(
                "file name {name:?}: expected a date as in Session2_2021-07-01_RoomB_v2.csv, found none"
            ),
            "rows of this layout give only the time of day; the date comes from the name",
        ));
    }
    let zone = match midnight_ns {
        Some(_) => {
            "time stamps, in UTC unless they say otherwise; the day of the file's name where they have none"
        }
        None => "time stamps, in UTC unless they say otherwise",
    };
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let (device, container) = match is_session {
        true => ("linaige", "a session of the LINAIGE data set".to_owned()),
        false => ("imported", rows.container()),
    };
    let assumed = Assumed {
        stream: StreamId {
            device: device.to_owned(),
            sensor: "grid-eye".to_owned(),
            boot: name_of(stem, "session"),
        },
        period_ns: u64::try_from(options.period.as_nanos()).unwrap_or(u64::MAX),
        midnight_ns,
    };
    Ok(Import {
        account: Account::of(&plan, container, zone),
        labels: plan
            .labels
            .iter()
            .map(|column| plan.names[*column].clone())
            .collect(),
        rows: Source::Told(Box::new(Told {
            sample: sample.into(),
            rows,
            frames: Frames::new(plan, assumed),
            broken,
        })),
        ended: false,
    })
}

/// Midnight of the day in a file's name, as in `2021-07-01`, in nanoseconds since 1970.
fn midnight_ns(name: &str) -> Option<i64> {
    (0..name.len()).find_map(|at| {
        let day = name.get(at..at + "2021-07-01".len())?;
        let is_one = day.as_bytes()[4] == b'-' && day.as_bytes()[7] == b'-';
        match parse(day, Some(Order::DayFirst)).filter(|_| is_one)? {
            Moment::Day(day) => day.checked_mul(NS_PER_DAY),
            _ => None,
        }
    })
}

impl Import {
    /// What was taken for what.
    #[must_use]
    pub const fn account(&self) -> &Account {
        &self.account
    }

    /// The names of [`Row::labels`].
    #[must_use]
    pub fn labels(&self) -> &[String] {
        &self.labels
    }

    /// What was counted so far; `None` for this project's recordings, which are read strictly.
    #[must_use]
    pub fn tally(&self) -> Option<Tally> {
        match &self.rows {
            Source::Known(_) => None,
            Source::Told(told) => Some(Tally {
                skipped: told.rows.skipped(),
                cut: told.rows.cut(),
                ..told.frames.tally
            }),
        }
    }
}

impl Told {
    fn row(&mut self) -> Result<Option<Row>, ImportError> {
        loop {
            let next = match (self.sample.pop_front(), self.broken.take()) {
                (Some(row), broken) => {
                    self.broken = broken;
                    Some(row)
                }
                (None, Some(broken)) => return Err(broken),
                (None, None) => self.rows.next()?,
            };
            let Some(raw) = next else {
                return Ok(None);
            };
            if !raw.is_whole {
                let place = match raw.number {
                    0 => "at its end".to_owned(),
                    number => format!("line {number}"),
                };
                return Err(ImportError::cut_line(place));
            }
            if let Some(row) = self.frames.row(&raw) {
                return Ok(Some(row));
            }
        }
    }
}

impl Iterator for Import {
    type Item = Result<Row, ImportError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ended {
            return None;
        }
        let item = match &mut self.rows {
            Source::Known(rows) => rows.next(),
            Source::Told(told) => told.row().transpose(),
        };
        self.ended = !matches!(item, Some(Ok(_)));
        item
    }
}

impl std::iter::FusedIterator for Import {}
