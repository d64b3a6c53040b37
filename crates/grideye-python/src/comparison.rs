//! A recording compared with a scene.

use crate::errors::raised;
use crate::recording::Recording;
use crate::scene::Scene;
use crate::work::{is_stopped, work};
use grideye_inputs::{Compared, InputError, Sides, compare};
use grideye_validator::report::{self, Context};
use grideye_validator::{AlignOptions, Options, TimeAlignment};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;
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
    max_shift_s: f64,
    max_rate_percent: f64,
    command: String,
}

#[pymethods]
impl Comparison {
    #[staticmethod]
    fn of(py: Python<'_>, scene: &Scene, recording: &Recording, asked: Asked) -> PyResult<Self> {
        let how = how(&asked).map_err(|error| raised(py, &error))?;
        let (loaded, name) = (Arc::clone(&scene.loaded), scene.name.clone());
        let (path, records) = (recording.path.clone(), Arc::clone(&recording.records));
        let held = recording.held();
        let compared = work(py, move || {
            let sides = Sides {
                loaded: &loaded,
                scene: &name,
                sensor: asked.sensor.as_deref(),
                recording: &path,
                held,
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

    /// As `grideye compare --junit` writes it.
    fn junit(&self) -> String {
        report::junit(&self.0.comparison, &self.0.context)
    }

    /// As `grideye compare` prints it.
    fn text(&self) -> String {
        let table = report::table(&self.0.comparison, self.0.context.experiment);
        format!("{}{table}", self.0.comparison.judgment)
    }
}

fn how(asked: &Asked) -> Result<Options, InputError> {
    let is_no_time = |start_s: &f64| Duration::try_from_secs_f64(start_s.abs()).is_err();
    if let Some(start_s) = asked.start_s.filter(is_no_time) {
        return Err(InputError::new(format!(
            "start is {start_s}, expected seconds, like 12.5 or -0.4"
        )));
    }
    let shift_max_s = within("max_shift", asked.max_shift_s, 60.0, "seconds")?;
    let mut align = AlignOptions {
        shift_max: Duration::from_secs_f64(shift_max_s),
        rate_max: within("max_rate", asked.max_rate_percent, 20.0, "%")? / 100.0,
        ..AlignOptions::default()
    };
    for name in &asked.align {
        match name.as_str() {
            "orientation" => align.orientation = true,
            "pose" => align.pose = true,
            time => align.time = time_alignment(time)?,
        }
    }
    Ok(Options {
        seed: asked.seed,
        start_s: asked.start_s,
        align,
        advises: true,
        is_stopped,
        ..Options::default()
    })
}

fn within(name: &str, value: f64, most: f64, unit: &str) -> Result<f64, InputError> {
    match (0.0..=most).contains(&value) {
        true => Ok(value),
        false => Err(InputError::new(format!(
            "{name} is {value}, expected 0 to {most} {unit}"
        ))),
    }
}

fn time_alignment(name: &str) -> Result<TimeAlignment, InputError> {
    Ok(match name {
        "none" => TimeAlignment::None,
        "shift" => TimeAlignment::Shift,
        "rate" => TimeAlignment::Rate,
        other => {
            return Err(InputError::new(format!(
                "unknown alignment {other:?}\nhint: one of none, shift and rate, and orientation or pose"
            )));
        }
    })
}
