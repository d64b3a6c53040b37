//! One emulated sensor alone on its bus: its view of a scene or recording, and the agent's access to the bus.

use crate::clock::PacedClock;
use crate::error::RigError;
use crate::show::{AtEnd, Pictures, Show, Timeline, evenly};
use amg8833_emulator::{Bus, BusError, Clock, FrameSource};
use embedded_hal::i2c::{ErrorType, I2c, Operation};
use grideye_agent::bus::{OpenBus, OpenError, by_kind};
use grideye_frame::word;
use grideye_frame::{COLUMNS, Celsius, Frame, NoData, ROWS, RecordedFrame};
use grideye_recording::ClockState;
use grideye_scene::{Scene, Simulator};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// How much warmer the emulated chip is than the room: real ones are 3.5 to 6 °C above the scene by self-heating.
pub const SELF_HEATING_C: f32 = 4.5;

/// What an emulated sensor sees.
pub type Source = Box<dyn FrameSource + Send>;

/// A scene's sensor with noise from `seed`; the walk starts with the sensor's first measurement, and again at its end.
/// # Errors
/// If the sensor does not have 8 x 8 pixels.
pub fn scene_source(scene: &Scene, simulator: Simulator, seed: u64) -> Result<Source, RigError> {
    check_resolution(&simulator)?;
    let pictures = Pictures::Scene {
        simulator: Box::new(simulator),
        thermistor: self_heated(scene.ambient()),
        noise_seed: Some(seed),
    };
    Ok(Box::new(Show {
        timeline: Timeline::new(scene.duration(), AtEnd::Loop),
        ..Show::alone(pictures)
    }))
}

/// Rejects a sensor that an AMG8833 cannot represent.
pub(crate) fn check_resolution(simulator: &Simulator) -> Result<(), RigError> {
    let sensor = simulator.sensor();
    if (sensor.columns, sensor.rows) == (COLUMNS, ROWS) {
        return Ok(());
    }
    let name = sensor.name.clone();
    Err(RigError::Resolution(name, sensor.columns, sensor.rows))
}

/// The temperature of a chip in a room.
pub(crate) fn self_heated(ambient: Celsius) -> Celsius {
    Celsius::new(ambient.get() + SELF_HEATING_C)
}

/// What a replay shows of a frame. A frame without a thermistor shows the mean of its pixels as its room, self-heated.
pub(crate) fn shown(frame: &RecordedFrame) -> Frame {
    let pixels = word::pixels(&frame.pixels);
    let sum: f32 = pixels.iter().copied().map(Celsius::get).sum();
    let thermistor = frame.thermistor.map(word::thermistor_celsius);
    Frame {
        thermistor: thermistor.unwrap_or_else(|| self_heated(Celsius::new(sum / 64.0))),
        pixels,
    }
}

/// The frames of a recording, one per sensor period from the first measurement on; the last one stays.
#[must_use]
pub fn replay_source(frames: &[RecordedFrame]) -> Source {
    let frames = evenly(frames.iter().map(shown));
    Box::new(Show::alone(Pictures::timed(frames)))
}

/// Emulated boot time; its synchronized wall clock starts at the program's start time.
#[derive(Debug)]
pub struct AgentClock {
    paced: Arc<PacedClock>,
    started_utc: Duration,
}

impl AgentClock {
    /// A wall clock based on emulated time.
    #[must_use]
    pub fn new(paced: Arc<PacedClock>) -> Self {
        let started_utc = SystemTime::now().duration_since(UNIX_EPOCH);
        Self {
            paced,
            started_utc: started_utc.unwrap_or_default(),
        }
    }
}

impl grideye_agent::clock::Clock for AgentClock {
    fn boot(&self) -> Duration {
        self.paced.now()
    }

    fn utc(&self) -> (i64, ClockState) {
        let utc = self.started_utc + self.paced.now();
        let utc_ns = i64::try_from(utc.as_nanos()).unwrap_or(i64::MAX);
        (utc_ns, ClockState::Synced)
    }

    fn sleep_until(&self, boot: Duration) {
        self.paced.sleep_until(boot);
    }
}

/// The emulated bus for the agent's thread: opening it again gives the same bus.
#[derive(Clone)]
pub struct SharedBus(Arc<Mutex<Bus<Arc<PacedClock>, Source>>>);

impl SharedBus {
    /// Shares a bus between the agent and whoever counts its traffic.
    #[must_use]
    pub fn new(bus: Bus<Arc<PacedClock>, Source>) -> Self {
        Self(Arc::new(Mutex::new(bus)))
    }

    /// Accesses the bus, for its counters.
    pub fn with<T>(&self, look: impl FnOnce(&mut Bus<Arc<PacedClock>, Source>) -> T) -> T {
        look(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl ErrorType for SharedBus {
    type Error = BusError;
}

impl I2c for SharedBus {
    fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), BusError> {
        self.with(|bus| bus.transaction(address, operations))
    }
}

impl OpenBus for SharedBus {
    type Bus = Self;

    fn open(&mut self) -> Result<Self, OpenError> {
        Ok(self.clone())
    }

    fn classify(&self, error: &BusError) -> NoData {
        match error {
            BusError::Timeout => NoData::BusTimeout,
            BusError::Gone => NoData::Unplugged,
            other => by_kind(embedded_hal::i2c::Error::kind(other)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use grideye_frame::{PIXELS, PixelWord, ThermistorWord};

    #[test]
    fn a_frame_without_a_thermistor_shows_its_mean_self_heated() {
        let mut frame = RecordedFrame {
            thermistor: None,
            pixels: [PixelWord(80); PIXELS],
        };
        frame.pixels[0] = PixelWord(80 + 64);
        assert_eq!(shown(&frame).thermistor.get(), 20.25 + 4.5);
        frame.thermistor = Some(ThermistorWord(400));
        assert_eq!(shown(&frame).thermistor.get(), 25.0);
    }
}
