//! Recordings as arrays.

use crate::errors::raised;
use crate::work::{Stop, work};
use amg8833::word;
use grideye_frame::{Celsius, PIXELS, RawFrame, Reading};
use grideye_inputs::{InputError, open};
use grideye_recording::{Layout, Record, RecordingError, Row, StreamId, csv, linaige, sniff};
use grideye_validator::{Thinned, Thinning};
use pyo3::prelude::*;
use pyo3::types::PyByteArray;
use std::collections::BTreeMap;
use std::io::BufRead as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

#[pyclass(frozen, module = "grideye_hil._native")]
pub(crate) struct Recording {
    pub(crate) path: PathBuf,
    pub(crate) stream: StreamId,
    pub(crate) records: Arc<Vec<Record>>,
}

#[pymethods]
impl Recording {
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf, sensor: Option<String>) -> PyResult<Self> {
        let read = work(py, move |stop| read(path, sensor.as_deref(), stop))?;
        read.map_err(|error| raised(py, &error))
    }

    fn path(&self) -> PathBuf {
        self.path.clone()
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
            Some(frame) => word::frame(frame).pixels.map(Celsius::get),
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
        let of = |frame| word::frame(frame).thermistor.get();
        let celsius = self.frames().map(|frame| frame.map_or(f32::NAN, of));
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
    fn frames(&self) -> impl Iterator<Item = Option<&RawFrame>> {
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

fn read(path: PathBuf, sensor: Option<&str>, stop: &Stop) -> Result<Recording, InputError> {
    let mut streams: BTreeMap<StreamId, Vec<Record>> = BTreeMap::new();
    for row in rows(&path)?.take_while(|_| !stop.is_set()) {
        let row = row.map_err(|error| InputError::of_recording(&path, &error))?;
        let named = format!("{}/{}", row.stream.device, row.stream.sensor);
        if sensor.is_none_or(|asked| asked == row.stream.sensor || asked == named) {
            streams.entry(row.stream).or_default().push(row.record);
        }
    }
    let shown = path.display();
    let count = streams.len();
    match (streams.pop_first(), count) {
        (Some((stream, records)), 1) => Ok(Recording {
            path,
            stream,
            records: Arc::new(records),
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

type Rows = Box<dyn Iterator<Item = Result<Row, RecordingError>>>;

/// The rows of any recording that is known here.
fn rows(path: &Path) -> Result<Rows, InputError> {
    let mut input = open(path)?;
    let refused = |error: RecordingError| InputError::of_recording(path, &error);
    let shown = path.display();
    let beginning = input.fill_buf();
    let layout = beginning.ok().and_then(sniff);
    match layout {
        Some(Layout::Recording) => Ok(Box::new(csv::Reader::new(input).map_err(refused)?)),
        Some(Layout::Linaige) => {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let date = linaige::Date::from_file_name(&name).map_err(refused)?;
            let stream = linaige::stream_from_file_name(&name);
            let reader = linaige::Reader::new(input, date, stream).map_err(refused)?;
            Ok(Box::new(reader.map(|row| row.map(|labeled| labeled.row))))
        }
        Some(Layout::Rows | Layout::Npy) => Err(InputError::new(format!(
            "{shown} holds temperatures and no thermistor\nhint: say what it read, and convert the file first: grideye convert {shown} recording.csv --thermistor 25"
        ))
        .of(path)),
        None => Err(InputError::new(format!(
            "{shown} is no recording that is known here: its first line is none of the headers\nhint: recordings/README.md describes the formats"
        ))
        .of(path)
        .at(Some(1))),
    }
}
