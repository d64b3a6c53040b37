//! A recording compared with a scene.

use crate::errors::raised;
use crate::recording::Recording;
use crate::scene::Scene;
use crate::work::work;
use grideye_inputs::{Compared, InputError, Sides, compare};
use grideye_validator::report::{self, Context};
use grideye_validator::{AlignOptions, Options, THREADS_MAX, TimeAlignment};
use pyo3::prelude::*;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

#[pyclass(frozen, module = "grideye_hil._native")]
pub(crate) struct Comparison(Compared);

/// What a comparison may be told.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Asked {
    sensor: Option<String>,
    profile: Option<PathBuf>,
    thresholds: Option<PathBuf>,
    start_s: Option<f64>,
    seed: u64,
    align: Vec<String>,
    command: String,
}

#[pymethods]
impl Comparison {
    #[staticmethod]
    fn of(py: Python<'_>, scene: &Scene, recording: &Recording, asked: Asked) -> PyResult<Self> {
        let how = how(&asked).map_err(|error| raised(py, &error))?;
        let (loaded, name) = (Arc::clone(&scene.loaded), scene.name.clone());
        let (path, records) = (recording.path.clone(), Arc::clone(&recording.records));
        let compared = work(py, move |_| {
            let sides = Sides {
                loaded: &loaded,
                scene: &name,
                sensor: asked.sensor.as_deref(),
                recording: &path,
                profile: asked.profile.as_deref(),
                thresholds: asked.thresholds.as_deref(),
            };
            let context = Context {
                command: asked.command.clone(),
                program: concat!("grideye ", env!("CARGO_PKG_VERSION")).to_owned(),
                ..Context::default()
            };
            compare(&sides, &Recording::thinned_of(&records), how, context)
        })?;
        compared.map(Self).map_err(|error| raised(py, &error))
    }

    /// As `grideye compare --json` prints it.
    fn json(&self) -> String {
        report::json(&self.0.comparison, &self.0.context)
    }

    /// As `grideye compare --report` writes it.
    fn html(&self) -> String {
        report::html(&self.0.comparison, &self.0.context)
    }

    /// As `grideye compare` prints it.
    fn text(&self) -> String {
        let table = report::table(&self.0.comparison, self.0.context.experiment);
        format!("{}{table}", self.0.comparison.judgment)
    }
}

fn how(asked: &Asked) -> Result<Options, InputError> {
    let start = asked.start_s.map(Duration::try_from_secs_f64).transpose();
    let start = start.map_err(|error| InputError::new(format!("start: {error}")))?;
    let mut align = AlignOptions::default();
    for name in &asked.align {
        match name.as_str() {
            "orientation" => align.orientation = true,
            "pose" => align.pose = true,
            time => align.time = time_alignment(time)?,
        }
    }
    let cores = thread::available_parallelism().map_or(1, NonZeroUsize::get);
    Ok(Options {
        seed: asked.seed,
        start,
        align,
        threads: cores.min(THREADS_MAX),
        advises: true,
        ..Options::default()
    })
}

fn time_alignment(name: &str) -> Result<TimeAlignment, InputError> {
    Ok(match name {
        "none" => TimeAlignment::None,
        "shift" => TimeAlignment::Shift,
        "rate" => TimeAlignment::Rate,
        "warp" => TimeAlignment::Warp,
        "law" => TimeAlignment::Law,
        other => {
            return Err(InputError::new(format!(
                "unknown alignment {other:?}\nhint: one of none, shift, rate, warp and law, and orientation or pose"
            )));
        }
    })
}
