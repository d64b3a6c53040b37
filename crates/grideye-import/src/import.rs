//! Opens a file of any layout.

use crate::account::{Account, Tally};
use crate::arrays::{NPY_MAGIC, npy, npz};
use crate::columns::Columns;
use crate::container::{self, Unpacked, held};
use crate::error::ImportError;
use crate::frames::{Assumed, Frames};
use crate::plan::Plan;
use crate::source::Rows;
use crate::text::TextRows;
use crate::{json, tables};
use core::time::Duration;
use grideye_frame::PIXELS;
use grideye_recording::{Layout, Row, StreamId, csv, linaige, sniff};
use std::collections::VecDeque;
use std::io::{Cursor, Read};

/// Rows by which the columns are told.
const SAMPLE_ROWS: usize = 256;

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

type Known = Box<dyn Iterator<Item = Result<Row, ImportError>> + Send>;

enum Source {
    /// A layout that says what its columns are.
    Known(Known),
    Told(Box<Told>),
}

struct Told {
    sample: VecDeque<crate::cell::RawRow>,
    rows: Box<dyn Rows + Send>,
    frames: Frames,
    /// Why the sample ended early.
    broken: Option<ImportError>,
}

/// Opens a recording of any layout: this project's CSV, LINAIGE, and what the crate's page lists. `name` is the file's
/// name; a day in it completes times of day, and it names the rows.
///
/// # Errors
/// [`ImportError`], with what to say in [`Options::columns`] where the columns are not clear.
pub fn open(
    input: impl Read + Send + 'static,
    name: &str,
    options: &Options,
) -> Result<Import, ImportError> {
    let Unpacked {
        head,
        rest,
        name,
        arrays,
        is_workbook,
    } = container::unpack(Box::new(input), name)?;
    let layout = sniff(&head);
    if let Some(found) = layout.and_then(|_| other_resolution(&head)) {
        return Err(ImportError::OtherSensor { found });
    }
    let said = &options.columns;
    let sheet = said.sheet.as_deref();
    if let (Some(sheet), false) = (sheet, is_workbook) {
        return Err(ImportError::unclear(
            format!("there is no sheet {sheet}"),
            "only a workbook (.xlsx) has sheets: leave sheet= out",
        ));
    }
    let is_array = head.starts_with(NPY_MAGIC);
    let is_parquet = head.starts_with(tables::MAGIC);
    let text = String::from_utf8_lossy(&head).into_owned();
    let input = Cursor::new(head).chain(rest);
    let rows: Box<dyn Rows + Send> = match (layout, arrays) {
        (Some(Layout::Recording), _) => return recording(input),
        (Some(Layout::Linaige), _) => return session(input, &name),
        (None, Some(arrays)) => Box::new(npz(&arrays, said)?),
        _ if is_workbook => workbook(held(input)?, said)?,
        _ if is_array => Box::new(npy(&held(input)?)?),
        _ if is_parquet => Box::new(tables::rows(held(input)?)?),
        _ if json::is_json(&text) => {
            let bytes = held(input)?;
            match json::rows(&String::from_utf8_lossy(&bytes)) {
                Some(rows) => Box::new(rows),
                None => Box::new(TextRows::new(Cursor::new(bytes), said)?),
            }
        }
        _ => Box::new(TextRows::new(input, said)?),
    };
    told(rows, &name, options)
}

/// The number of pixels in a known layout's header, if it is not a Grid-EYE's.
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
fn workbook(bytes: Vec<u8>, said: &Columns) -> Result<Box<dyn Rows + Send>, ImportError> {
    Ok(Box::new(crate::sheets::rows(bytes, said)?))
}

#[cfg(not(feature = "xlsx"))]
fn workbook(_bytes: Vec<u8>, _said: &Columns) -> Result<Box<dyn Rows + Send>, ImportError> {
    Err(ImportError::Container {
        expected: "a file that this build reads".to_owned(),
        found: "a workbook".to_owned(),
        hint: "save the sheet as CSV",
    })
}

fn recording(input: impl Read + Send + 'static) -> Result<Import, ImportError> {
    let reader = csv::Reader::new(input)?;
    let labels = reader.labels().to_vec();
    let rows: Known = Box::new(reader.map(|row| row.map_err(ImportError::from)));
    Ok(known(rows, "a recording of this project", labels))
}

fn session(input: impl Read + Send + 'static, name: &str) -> Result<Import, ImportError> {
    let date = linaige::Date::from_file_name(name)?;
    let reader = linaige::Reader::new(input, date, linaige::stream_from_file_name(name))?;
    let rows: Known = Box::new(reader.map(|row| {
        row.map(linaige::LinaigeRow::labeled)
            .map_err(ImportError::from)
    }));
    let labels = linaige::LABELS.map(str::to_owned).to_vec();
    Ok(known(rows, "a session of the LINAIGE data set", labels))
}

fn known(rows: Known, container: &str, labels: Vec<String>) -> Import {
    Import {
        rows: Source::Known(rows),
        account: Account {
            container: container.to_owned(),
            taken: Vec::new(),
        },
        labels,
        ended: false,
    }
}

fn told(
    mut rows: Box<dyn Rows + Send>,
    name: &str,
    options: &Options,
) -> Result<Import, ImportError> {
    let (mut sample, mut broken) = (Vec::new(), None);
    while sample.len() < SAMPLE_ROWS && broken.is_none() {
        match rows.next() {
            Ok(None) => break,
            Ok(Some(row)) => sample.push(row),
            Err(error) if sample.is_empty() => return Err(error),
            Err(error) => broken = Some(error),
        }
    }
    let plan = Plan::of(rows.names(), &sample, &options.columns, rows.unit())?;
    let midnight_ns = linaige::Date::from_file_name(name)
        .ok()
        .map(linaige::Date::midnight_utc_ns);
    let zone = match midnight_ns {
        Some(_) => {
            "time stamps, in UTC unless they say otherwise; the day of the file's name where they have none"
        }
        None => "time stamps, in UTC unless they say otherwise",
    };
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let assumed = Assumed {
        stream: StreamId {
            device: "imported".to_owned(),
            sensor: "grid-eye".to_owned(),
            // Only characters that a boot's name may have.
            boot: linaige::stream_from_file_name(stem).boot,
        },
        period_ns: u64::try_from(options.period.as_nanos()).unwrap_or(u64::MAX),
        midnight_ns,
    };
    Ok(Import {
        account: Account::of(&plan, rows.container(), Some(zone.to_owned())),
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

    /// What was counted so far; `None` for layouts that are read strictly.
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
