//! Emulated sensors in this process, with a clock of their own.

use crate::errors::{of_rig, raised};
use crate::recording::Recording;
use crate::scene::Scene;
use crate::work::{is_stopped, work};
use amg8833_emulator::script::Script;
use grideye_inputs::{InputError, faults_of, profile_or_built_in};
use grideye_rig::{
    AtEnd, Build, Machine as Rig, ON_BEFORE, Placed, Replay, SCL_HZ_RANGE, Shown, Timebase, Wiring,
    World, parts, planned, recorded,
};
use i2c_emulation::ioctl::AdapterMode;
use i2c_emulation::socket::Session;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::collections::BTreeMap;
use std::num::NonZeroU32;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

#[pyclass(frozen, module = "grideye_hil._native")]
pub(crate) struct Machine {
    rig: Arc<Rig>,
    session: Mutex<Session>,
    seed: u64,
}

/// Options for building the machine.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Asked {
    sensors: Vec<String>,
    profile: Option<PathBuf>,
    clock_error_ppm: Option<i32>,
    at_end: String,
    replay: String,
    adapter: String,
    scl_hz: Option<u32>,
    seed: u64,
    power_on: bool,
    faults: String,
}

/// Sensors between two looks at the signals take at most this much time of measurements.
const STEP: Duration = Duration::from_secs(1);

#[pymethods]
impl Machine {
    #[staticmethod]
    fn of_scene(py: Python<'_>, scene: &Scene, asked: Asked) -> PyResult<Self> {
        let shown = Shown::Scene(Box::new(scene.loaded.scene.clone()));
        Self::build(&shown, &asked).map_err(|error| raised(py, &error))
    }

    #[staticmethod]
    fn of_recording(py: Python<'_>, recording: &Recording, asked: Asked) -> PyResult<Self> {
        let replay = match asked.replay.as_str() {
            "times" => Ok(Replay::Times),
            "frames" => Ok(Replay::Frames),
            other => Err(InputError::new(format!(
                "unknown replay {other:?}\nhint: 'times' or 'frames'"
            ))),
        };
        let built = replay.and_then(|replay| {
            let sensors = recorded(recording.streams()).map_err(|error| {
                InputError::new(format!("{} {error}", recording.path.display())).of(&recording.path)
            })?;
            Self::build(&Shown::Recording { replay, sensors }, &asked)
        });
        built.map_err(|error| raised(py, &error))
    }

    #[staticmethod]
    fn of_constant(py: Python<'_>, celsius: f32, asked: Asked) -> PyResult<Self> {
        let built = Self::build(&Shown::Constant(celsius), &asked);
        built.map_err(|error| raised(py, &error))
    }

    /// One packet of `i2c-emulation`'s protocol and its answer, as over the socket.
    fn exchange<'py>(&self, py: Python<'py>, packet: &[u8]) -> Bound<'py, PyBytes> {
        let answer = py.detach(|| {
            let mut session = self.session.lock().unwrap_or_else(PoisonError::into_inner);
            session.exchange(packet)
        });
        PyBytes::new(py, &answer)
    }

    fn advance(&self, py: Python<'_>, seconds: f64) -> PyResult<()> {
        let by = Duration::try_from_secs_f64(seconds)
            .map_err(|error| InputError::new(format!("advance({seconds}): {error}")))
            .map_err(|error| raised(py, &error))?;
        if by <= STEP {
            py.detach(|| self.rig.advance(by));
            return Ok(());
        }
        let rig = Arc::clone(&self.rig);
        work(py, move || {
            let mut left = by;
            while !left.is_zero() && !is_stopped() {
                let step = left.min(STEP);
                rig.advance(step);
                left -= step;
            }
        })
    }

    fn now_s(&self) -> f64 {
        self.rig.now().as_secs_f64()
    }

    fn inject(&self, py: Python<'_>, faults: &str) -> PyResult<()> {
        let script = script(faults, self.seed);
        let injected = script.and_then(|script| self.rig.inject(&script).map_err(of_rig));
        injected.map_err(|error| raised(py, &error))
    }

    /// Transactions, bytes and NACKs; what was refused; and the faults injected.
    fn counts(&self) -> [BTreeMap<&'static str, u64>; 3] {
        let counts = self.rig.counts();
        let traffic = [
            ("transactions", counts.transactions),
            ("bytes", counts.bytes),
            ("nacks", counts.nacks),
        ];
        [traffic.into(), counts.refused, counts.faults]
    }
}

impl Machine {
    fn build(shown: &Shown, asked: &Asked) -> Result<Self, InputError> {
        let placed = asked.sensors.iter().map(|sensor| sensor.parse());
        let placed: Vec<Placed> = placed
            .collect::<Result<_, String>>()
            .map_err(InputError::new)?;
        let planned = planned(&placed, (None, None), shown.names().as_deref());
        let profile = asked
            .profile
            .as_deref()
            .map(profile_or_built_in)
            .transpose()?;
        let build = Build {
            seed: asked.seed,
            profile,
            clock_error_ppm: asked.clock_error_ppm,
            at_end: at_end(&asked.at_end)?,
        };
        let world = World::new();
        let parts = parts(shown, &world, planned.map_err(InputError::new)?, &build);
        let wiring = Wiring {
            scl_hz: asked.scl_hz.map(scl).transpose()?,
            script: Some(script(&asked.faults, asked.seed)?),
            trace: None,
        };
        let ahead = match asked.power_on {
            true => Duration::ZERO,
            false => ON_BEFORE,
        };
        let base = Timebase::by_hand(ahead);
        let rig = Rig::new(base, &world, parts.map_err(of_rig)?, &wiring).map_err(of_rig)?;
        rig.start();
        let mode: AdapterMode = asked.adapter.parse().map_err(InputError::new)?;
        let session = Mutex::new(Session::new(rig.rack(), mode));
        let (rig, seed) = (Arc::new(rig), asked.seed);
        Ok(Self { rig, session, seed })
    }
}

fn scl(hz: u32) -> Result<NonZeroU32, InputError> {
    let within = NonZeroU32::new(hz).filter(|hz| SCL_HZ_RANGE.contains(&hz.get()));
    within.ok_or_else(|| {
        let (least, most) = (SCL_HZ_RANGE.start(), SCL_HZ_RANGE.end());
        InputError::new(format!(
            "scl_hz is {hz}, expected {least} to {most}\nhint: None lets transfers take no time"
        ))
    })
}

fn at_end(name: &str) -> Result<AtEnd, InputError> {
    match name {
        "hold" => Ok(AtEnd::Hold),
        "loop" => Ok(AtEnd::Loop),
        "end" => Ok(AtEnd::End),
        other => Err(InputError::new(format!(
            "unknown end {other:?}\nhint: 'hold', 'loop' or 'end'"
        ))),
    }
}

/// No text is no faults.
fn script(faults: &str, seed: u64) -> Result<Script, InputError> {
    match faults.trim() {
        "" => Script::new(seed, Vec::new()).map_err(InputError::from),
        _ => faults_of(faults, "faults", seed),
    }
}
