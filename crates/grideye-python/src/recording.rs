//! Recordings as arrays.

use crate::errors::raised;
use crate::work::{is_stopped, work};
use grideye_count::Line;
use grideye_export::recording::{self, Row, Rows};
use grideye_frame::word;
use grideye_frame::{Celsius, NoData, PIXELS, Reading, RecordedFrame};
use grideye_import::{ImportError, Options};
use grideye_inputs::counting::{self, FrameCount};
use grideye_inputs::{InputError, hashed_text, open};
use grideye_recording::{ClockState, Record, Stamp, StreamId, check_name};
use grideye_validator::report::Input;
use grideye_validator::{Thinned, Thinning};
use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyBytes};
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::PathBuf;
use std::sync::Arc;

#[pyclass(frozen, module = "grideye_hil._native")]
pub(crate) struct Recording {
    pub(crate) path: PathBuf,
    /// Whether the file at `path` holds it, and nothing else.
    is_file: bool,
    pub(crate) stream: StreamId,
    pub(crate) records: Arc<Vec<Record>>,
    account: String,
    /// Where the file breaks off.
    broken: Option<String>,
    labels: Labels,
}

/// Names of further columns, and what each has for each record.
type Labels = Vec<(String, Vec<String>)>;

#[pymethods]
impl Recording {
    #[staticmethod]
    fn read(
        py: Python<'_>,
        path: PathBuf,
        sensor: Option<String>,
        columns: Option<&str>,
    ) -> PyResult<Self> {
        let mut options = Options::default();
        if let Some(columns) = columns {
            let refused = |error| raised(py, &InputError::new(error));
            options.columns = columns.parse().map_err(refused)?;
        }
        let read = work(py, move || read(path, sensor.as_deref(), &options))?;
        read.map_err(|error| raised(py, &error))
    }

    /// Of arrays: °C of all frames, not-a-number where one is missing; when they were read, nanoseconds since the first;
    /// the wall clock, if it is known; the thermistor; and labels.
    #[staticmethod]
    fn of_arrays(py: Python<'_>, given: Given) -> PyResult<Self> {
        py.detach(|| given.recording())
            .map_err(|error| raised(py, &error))
    }

    /// Every `step`-th frame of these, as a recording of its own with that name.
    fn slice(&self, name: PathBuf, start: usize, stop: usize, step: usize) -> Self {
        let taken = || (start..stop).step_by(step);
        let records = taken().filter_map(|index| self.records.get(index).copied());
        let column = |(name, texts): &(String, Vec<String>)| {
            let texts = taken().filter_map(|index| texts.get(index).cloned());
            (name.clone(), texts.collect())
        };
        Self {
            path: name,
            is_file: false,
            stream: self.stream.clone(),
            records: Arc::new(records.collect()),
            account: self.account.clone(),
            broken: None,
            labels: self.labels.iter().map(column).collect(),
        }
    }

    /// The bytes of a file of this format, by its extension.
    fn written<'py>(&self, py: Python<'py>, end: &str) -> PyResult<Bound<'py, PyBytes>> {
        let written = py.detach(|| self.bytes_as(end));
        let bytes = written.map_err(|error| raised(py, &error))?;
        Ok(PyBytes::new(py, &bytes))
    }

    fn path(&self) -> PathBuf {
        self.path.clone()
    }

    fn account(&self) -> &str {
        &self.account
    }

    fn broken(&self) -> Option<&str> {
        self.broken.as_deref()
    }

    fn labels(&self) -> Labels {
        self.labels.clone()
    }

    /// Device, sensor and boot.
    fn stream(&self) -> [String; 3] {
        let StreamId {
            device,
            sensor,
            boot,
        } = self.stream.clone();
        [device, sensor, boot]
    }

    /// Pixels in °C as 32-bit floats; not-a-number where a frame is missing.
    fn celsius<'py>(&self, py: Python<'py>) -> Bound<'py, PyByteArray> {
        let frames = self.frames().map(|frame| match frame {
            Some(frame) => word::pixels(&frame.pixels).map(Celsius::get),
            None => [f32::NAN; PIXELS],
        });
        bytes(py, frames.flatten().flat_map(f32::to_ne_bytes))
    }

    /// Pixels as the sensor's words, 16-bit; 0 where a frame is missing.
    fn raw<'py>(&self, py: Python<'py>) -> Bound<'py, PyByteArray> {
        let frames = self.frames().map(|frame| match frame {
            Some(frame) => frame.pixels.map(|word| word.0),
            None => [0; PIXELS],
        });
        bytes(py, frames.flatten().flat_map(u16::to_ne_bytes))
    }

    /// In °C as 32-bit floats; not-a-number where it was not read.
    fn thermistor<'py>(&self, py: Python<'py>) -> Bound<'py, PyByteArray> {
        let celsius = self.frames().map(|frame| {
            let thermistor = frame.and_then(|frame| frame.thermistor);
            thermistor.map_or(f32::NAN, |word| word::thermistor_celsius(word).get())
        });
        bytes(py, celsius.flat_map(f32::to_ne_bytes))
    }

    /// Wall clock in nanoseconds since 1970 as 64-bit integers.
    fn t_utc_ns<'py>(&self, py: Python<'py>) -> Bound<'py, PyByteArray> {
        let times = self.records.iter().map(|record| record.stamp.t_utc_ns);
        bytes(py, times.flat_map(i64::to_ne_bytes))
    }

    /// Nanoseconds since the device booted as unsigned 64-bit integers.
    fn t_boot_ns<'py>(&self, py: Python<'py>) -> Bound<'py, PyByteArray> {
        let times = self.records.iter().map(|record| record.stamp.t_boot_ns);
        bytes(py, times.flat_map(u64::to_ne_bytes))
    }

    /// How many people each frame shows (signed, 8-bit; -1 where it is not known), the chance of each number (four 32-bit
    /// floats), and how many entered and left so far (two unsigned 32-bit integers).
    fn people<'py>(
        &self,
        py: Python<'py>,
        profile: Option<PathBuf>,
        live: bool,
        weights: Option<PathBuf>,
        line: Option<&str>,
    ) -> PyResult<[Bound<'py, PyByteArray>; 3]> {
        let line = line.map(|line| line.parse::<Line>().map_err(InputError::new));
        let line = line.transpose().map_err(|error| raised(py, &error))?;
        let records = Arc::clone(&self.records);
        let counted = work(py, move || {
            let weights = weights.as_deref().map(counting::weights).transpose()?;
            let network = counting::network(weights.as_deref());
            let counter = counting::counter(&records, profile.as_deref(), live)?;
            Ok(counting::count(&records, network, counter, line).collect::<Vec<_>>())
        })?;
        let counted = counted.map_err(|error| raised(py, &error))?;
        let people = |frame: &FrameCount| {
            let people = frame
                .count
                .and_then(|count| i8::try_from(count.people).ok());
            people.unwrap_or(-1).to_ne_bytes()
        };
        let chances = |frame: &FrameCount| frame.count.map_or([f32::NAN; 4], |count| count.chances);
        let crossed = |frame: &FrameCount| frame.crossed.unwrap_or_default();
        let crossed = counted.iter().flat_map(crossed);
        let crossed = crossed.map(|number| u32::try_from(number).unwrap_or(u32::MAX));
        Ok([
            bytes(py, counted.iter().flat_map(people)),
            bytes(
                py,
                counted.iter().flat_map(chances).flat_map(f32::to_ne_bytes),
            ),
            bytes(py, crossed.flat_map(u32::to_ne_bytes)),
        ])
    }

    /// Why each frame is missing; empty where it is not.
    fn reasons(&self) -> Vec<&'static str> {
        let reason = |record: &Record| match record.reading {
            Reading::NoData(why) => why.name(),
            Reading::Frame(_) => "",
        };
        self.records.iter().map(reason).collect()
    }
}

/// A recording as arrays.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Given {
    celsius: Vec<u8>,
    t_boot_ns: Vec<u64>,
    t_utc_ns: Option<Vec<i64>>,
    thermistor: Option<Vec<f32>>,
    reasons: Vec<String>,
    labels: Labels,
    device: String,
    sensor: String,
}

impl Given {
    fn recording(&self) -> Result<Recording, InputError> {
        let stream = StreamId {
            device: self.device.clone(),
            sensor: self.sensor.clone(),
            boot: "array".to_owned(),
        };
        for name in [&stream.device, &stream.sensor] {
            check_name(name).map_err(InputError::new)?;
        }
        let numbers = self.celsius.chunks_exact(size_of::<f32>());
        let number = |bytes: &[u8]| bytes.try_into().map_or(f32::NAN, f32::from_ne_bytes);
        let celsius: Vec<f32> = numbers.map(number).collect();
        let mut records = Vec::with_capacity(self.t_boot_ns.len());
        for (index, (pixels, t_boot_ns)) in celsius.chunks(PIXELS).zip(&self.t_boot_ns).enumerate()
        {
            let t_utc_ns = self.t_utc_ns.as_ref().and_then(|times| times.get(index));
            let thermistor = self.thermistor.as_ref().and_then(|all| all.get(index));
            let reason = self.reasons.get(index).and_then(|name| name.parse().ok());
            let row = Row {
                stream: stream.clone(),
                seq: u64::try_from(index).unwrap_or(u64::MAX),
                stamp: Stamp {
                    t_boot_ns: *t_boot_ns,
                    t_utc_ns: t_utc_ns.copied().unwrap_or(0),
                    clock: match t_utc_ns {
                        Some(_) => ClockState::Synced,
                        None => ClockState::Unsynced,
                    },
                },
                t_arrival_ns: None,
                labels: Vec::new(),
                thermistor_c: thermistor.copied().filter(|celsius| !celsius.is_nan()),
                pixels_c: match pixels.iter().any(|pixel| pixel.is_nan()) {
                    true => Err(reason.unwrap_or(NoData::ShortTransfer)),
                    false => Ok(pixels.to_vec()),
                },
            };
            let row = grideye_recording::Row::try_from(row);
            let row = row.map_err(|error| InputError::new(format!("frame {index}: {error}")))?;
            records.push(row.record);
        }
        Ok(Recording {
            path: "array".into(),
            is_file: false,
            stream,
            records: Arc::new(records),
            account: "arrays".to_owned(),
            broken: None,
            labels: self.labels.clone(),
        })
    }
}

impl Recording {
    /// A hash that stands for it in a report, if no file holds it.
    pub(crate) fn held(&self) -> Option<Input> {
        let csv = || self.bytes_as("csv").unwrap_or_default();
        let name = self.path.display().to_string();
        (!self.is_file).then(|| hashed_text(&name, csv()))
    }

    fn bytes_as(&self, end: &str) -> Result<Vec<u8>, InputError> {
        let format = recording::format(end).ok_or_else(|| {
            InputError::new(format!(
                "no format is called {end}\nhint: {}",
                recording::ENDS
            ))
        })?;
        let names: Vec<String> = self.labels.iter().map(|(name, _)| name.clone()).collect();
        let mut rows = self.records.iter().enumerate().map(|(index, record)| {
            let labels = self.labels.iter().map(|(_, texts)| texts[index].clone());
            Ok(Row::from(grideye_recording::Row {
                stream: self.stream.clone(),
                record: *record,
                t_arrival_ns: None,
                labels: labels.collect(),
            }))
        });
        let mut file = Cursor::new(Vec::new());
        let written = format(Rows::of_recording(&names, &mut rows), &mut file);
        written.map_err(|error| InputError::new(format!("{}: {error}", self.path.display())))?;
        Ok(file.into_inner())
    }

    fn frames(&self) -> impl Iterator<Item = Option<&RecordedFrame>> {
        self.records.iter().map(|record| record.reading.frame())
    }

    /// As `grideye compare` thins it.
    pub(crate) fn thinned_of(records: &[Record]) -> Thinned {
        let mut thinning = Thinning::default();
        thinning.extend(records.iter().copied());
        thinning.finish()
    }

    pub(crate) fn streams(&self) -> BTreeMap<StreamId, Vec<Record>> {
        BTreeMap::from([(self.stream.clone(), self.records.to_vec())])
    }
}

fn bytes(py: Python<'_>, bytes: impl Iterator<Item = u8>) -> Bound<'_, PyByteArray> {
    PyByteArray::new(py, &bytes.collect::<Vec<u8>>())
}

fn read(path: PathBuf, sensor: Option<&str>, options: &Options) -> Result<Recording, InputError> {
    let refused = |error: &ImportError| InputError::of_recording(&path, error);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut import =
        grideye_import::open(open(&path)?, &name, options).map_err(|error| refused(&error))?;
    let mut streams: BTreeMap<StreamId, (Vec<Record>, Vec<Vec<String>>)> = BTreeMap::new();
    let mut broken = None;
    while let Some(row) = import.next().filter(|_| !is_stopped()) {
        match row {
            Err(error) if error.is_break() && !streams.is_empty() => {
                broken = Some(refused(&error).to_string());
            }
            Err(error) => return Err(refused(&error)),
            Ok(row) => {
                let named = format!("{}/{}", row.stream.device, row.stream.sensor);
                if sensor.is_none_or(|asked| asked == row.stream.sensor || asked == named) {
                    let (records, labels) = streams.entry(row.stream).or_default();
                    records.push(row.record);
                    labels.push(row.labels);
                }
            }
        }
    }
    let account = import.account().to_string();
    let names = import.labels().to_vec();
    let shown = path.display();
    let count = streams.len();
    match (streams.pop_first(), count) {
        (Some((stream, (records, labels))), 1) => Ok(Recording {
            labels: by_column(names, &labels),
            path,
            is_file: true,
            stream,
            records: Arc::new(records),
            account,
            broken,
        }),
        (None, _) => Err(InputError::new(format!(
            "{shown} holds no row of this sensor\nhint: leave out sensor= to see which there are"
        ))
        .of(&path)),
        (Some((first, _)), _) => {
            let others = streams.keys().map(|stream| stream.sensor.as_str());
            let sensors: Vec<&str> = std::iter::once(first.sensor.as_str())
                .chain(others)
                .collect();
            Err(InputError::new(format!(
                "{shown} holds {count} streams, and one is taken at a time\nhint: choose one with sensor=: {}",
                sensors.join(", ")
            ))
            .of(&path))
        }
    }
}

fn by_column(names: Vec<String>, rows: &[Vec<String>]) -> Labels {
    let cell = |row: &Vec<String>, column: usize| row.get(column).cloned().unwrap_or_default();
    let columns = names.into_iter().enumerate();
    columns
        .map(|(column, name)| (name, rows.iter().map(|row| cell(row, column)).collect()))
        .collect()
}
