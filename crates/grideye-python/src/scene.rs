//! Scenes, and frames simulated of them.

use crate::errors::raised;
use crate::work::{goes_on, work_shown};
use grideye_dataset::{Part, Table};
use grideye_inputs::{Beside, InputError, LoadedScene, SceneText, sensor_name};
use grideye_plan::drawing::{Drawing, perspective};
use grideye_scene::{Sensor, Simulator};
use grideye_validator::STATIC_FRAMES;
use pyo3::prelude::*;
use pyo3::types::PyByteArray;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

#[pyclass(frozen, module = "grideye_hil._native")]
pub(crate) struct Scene {
    pub(crate) loaded: Arc<LoadedScene>,
    #[pyo3(get)]
    pub(crate) name: String,
}

/// Degrees of all frames as 32-bit floats, frame after frame and row after row, and the shape.
type Frames = (Vec<u8>, [usize; 3]);

/// Bytes of the frames of one call: four million of a Grid-EYE.
const FRAMES_BYTES_MAX: usize = 1 << 30;

#[pymethods]
impl Scene {
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let name = path.display().to_string();
        let loaded = py.detach(|| grideye_inputs::scene(None, &path));
        Self::new(py, loaded, name)
    }

    #[staticmethod]
    fn parse(py: Python<'_>, text: String, name: String, folder: PathBuf) -> PyResult<Self> {
        let read = SceneText {
            text,
            origin: name.clone(),
            files: Beside::of_folder(&folder),
        };
        Self::new(py, py.detach(|| read.parse(None)), name)
    }

    fn sensors(&self) -> Vec<String> {
        let sensors = self.loaded.scene.sensors().iter();
        sensors.map(|sensor| sensor.name.clone()).collect()
    }

    fn warnings(&self) -> Vec<String> {
        self.loaded.warnings.clone()
    }

    fn files(&self) -> Vec<PathBuf> {
        self.loaded.files.clone()
    }

    fn duration_s(&self) -> f64 {
        self.loaded.scene.duration().as_secs_f64()
    }

    /// Without words, as SVG.
    fn svg(&self, time_s: f64) -> String {
        let time = Duration::try_from_secs_f64(time_s).unwrap_or_default();
        let drawing = Drawing {
            time,
            ..Drawing::new("")
        };
        perspective(&self.loaded.scene, &drawing)
    }

    /// The frames with labels, as the bytes of an `.npy` file.
    fn labeled<'py>(
        &self,
        py: Python<'py>,
        frames: Option<u32>,
        seed: u64,
        sensor: Option<String>,
        show: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyByteArray>> {
        let loaded = Arc::clone(&self.loaded);
        let frames = work_shown(py, show, move || {
            labeled(&loaded, sensor.as_deref(), (frames, seed))
        })?;
        let bytes = frames.map_err(|error| raised(py, &error))?;
        Ok(PyByteArray::new(py, &bytes))
    }

    /// The frames as 32-bit floats, and their shape.
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        frames: Option<u32>,
        seed: u64,
        sensor: Option<String>,
        show: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Bound<'py, PyByteArray>, [usize; 3])> {
        let loaded = Arc::clone(&self.loaded);
        let frames = work_shown(py, show, move || {
            simulated(&loaded, sensor.as_deref(), (frames, seed))
        })?;
        let (bytes, shape) = frames.map_err(|error| raised(py, &error))?;
        Ok((PyByteArray::new(py, &bytes), shape))
    }
}

/// Frames with labels as numpy's records.
fn labeled(
    loaded: &LoadedScene,
    sensor: Option<&str>,
    (frames, seed): (Option<u32>, u64),
) -> Result<Vec<u8>, InputError> {
    let scene = &loaded.scene;
    let sensor = sensor_name(scene, sensor)?;
    let frames = checked_count(scene, scene.sensor(&sensor)?, frames)?;
    let part = Part::of_scene(scene, &sensor, (frames, seed), &goes_on);
    let mut bytes = Vec::new();
    grideye_export::dataset::write(
        &part.map_err(InputError::new)?,
        Table::Npy,
        "{}",
        &mut bytes,
    )
    .map_err(InputError::new)?;
    Ok(bytes)
}

impl Scene {
    fn new(
        py: Python<'_>,
        loaded: Result<LoadedScene, InputError>,
        name: String,
    ) -> PyResult<Self> {
        let loaded = Arc::new(loaded.map_err(|error| raised(py, &error))?);
        Ok(Self { loaded, name })
    }
}

fn simulated(
    loaded: &LoadedScene,
    sensor: Option<&str>,
    (frames, seed): (Option<u32>, u64),
) -> Result<Frames, InputError> {
    let scene = &loaded.scene;
    let simulator = Simulator::new(scene, &sensor_name(scene, sensor)?)?;
    let sensor = simulator.sensor();
    let frames = checked_count(scene, sensor, frames)?;
    let shape = [
        frames.try_into().unwrap_or(usize::MAX),
        sensor.rows,
        sensor.columns,
    ];
    let mut celsius = Vec::with_capacity(shape.iter().product::<usize>() * size_of::<f32>());
    for index in (0..frames).take_while(|_| goes_on()) {
        let image = simulator.noisy(sensor.frame_time(index), seed).celsius;
        celsius.extend(image.iter().flat_map(|c| single(*c).to_ne_bytes()));
    }
    Ok((celsius, shape))
}

/// As many frames as asked for, or of the whole scene, if they fit in memory.
fn checked_count(
    scene: &grideye_scene::Scene,
    sensor: &Sensor,
    frames: Option<u32>,
) -> Result<u32, InputError> {
    let frames = frames.unwrap_or_else(|| {
        let number = match scene.is_static() {
            true => u32::try_from(STATIC_FRAMES).ok(),
            false => u32::try_from(scene.frame_count(sensor)).ok(),
        };
        number.unwrap_or(u32::MAX)
    });
    let pixels = sensor.rows * sensor.columns;
    let bytes = usize::try_from(frames)
        .unwrap_or(usize::MAX)
        .saturating_mul(pixels)
        .saturating_mul(size_of::<f32>());
    if bytes > FRAMES_BYTES_MAX {
        return Err(InputError::new(format!(
            "{frames} frames of {} x {} pixels have {bytes} bytes, expected at most {FRAMES_BYTES_MAX}\nhint: say how many with frames=; grideye simulate writes any number into a file",
            sensor.columns, sensor.rows
        )));
    }
    Ok(frames)
}

#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    reason = "rounded to the nearest, as numpy does"
)]
fn single(celsius: f64) -> f32 {
    celsius as f32
}
