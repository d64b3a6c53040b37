//! Recordings as arrays.

use crate::errors::raised;
use crate::work::{is_stopped, work};
use grideye_frame::word;
use grideye_frame::{Celsius, PIXELS, Reading, RecordedFrame};
use grideye_import::{ImportError, Options};
use grideye_inputs::{InputError, open};
use grideye_recording::{Record, StreamId};
use grideye_validator::{Thinned, Thinning};
use pyo3::prelude::*;
use pyo3::types::PyByteArray;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

#[pyclass(frozen, module = "grideye_hil._native")]
pub(crate) struct Recording {
    pub(crate) path: PathBuf,
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

    /// Why each frame is missing; empty where it is not.
    fn reasons(&self) -> Vec<&'static str> {
        let reason = |record: &Record| match record.reading {
            Reading::NoData(why) => why.name(),
            Reading::Frame(_) => "",
        };
        self.records.iter().map(reason).collect()
    }
}

impl Recording {
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
