//! Scenes, and frames simulated of them.

use crate::errors::raised;
use crate::work::{is_stopped, work};
use grideye_inputs::{Beside, InputError, LoadedScene, SceneText, sensor_name};
use grideye_scene::Simulator;
use grideye_validator::STATIC_FRAMES;
use pyo3::prelude::*;
use pyo3::types::PyByteArray;
use std::path::PathBuf;
use std::sync::Arc;

#[pyclass(frozen, module = "grideye_hil._native")]
pub(crate) struct Scene {
    pub(crate) loaded: Arc<LoadedScene>,
    #[pyo3(get)]
    pub(crate) name: String,
}

/// Degrees of all frames, frame after frame and row after row, and the shape.
type Frames = (Vec<f64>, [usize; 3]);

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

    /// The frames as 64-bit floats, and their shape.
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        frames: Option<u32>,
        seed: u64,
        sensor: Option<String>,
    ) -> PyResult<(Bound<'py, PyByteArray>, [usize; 3])> {
        let loaded = Arc::clone(&self.loaded);
        let frames = work(py, move || {
            simulated(&loaded, sensor.as_deref(), (frames, seed))
        })?;
        let (celsius, shape) = frames.map_err(|error| raised(py, &error))?;
        let bytes: Vec<u8> = celsius.iter().flat_map(|c| c.to_ne_bytes()).collect();
        Ok((PyByteArray::new(py, &bytes), shape))
    }
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
    let frames = frames.unwrap_or_else(|| {
        let number = match scene.is_static() {
            true => u32::try_from(STATIC_FRAMES).ok(),
            false => u32::try_from(scene.frame_count(sensor)).ok(),
        };
        number.unwrap_or(u32::MAX)
    });
    let mut celsius = Vec::new();
    for index in (0..frames).take_while(|_| !is_stopped()) {
        celsius.extend(simulator.noisy(sensor.frame_time(index), seed).celsius);
    }
    let number = celsius.len() / (sensor.rows * sensor.columns);
    Ok((celsius, [number, sensor.rows, sensor.columns]))
}
