//! The emulated sensor that the demonstration and `grideye emulate` show: a scene or a recording, behind registers.
//!
//! Here, and nowhere else, the simulator meets the emulator: as a function of time that yields a frame.

use crate::paced_clock::PacedClock;
use amg8833::word;
use amg8833_emulator::{Address, Bus, BusError, Clock, FrameSource};
use anyhow::{Result, anyhow};
use embedded_hal::i2c::{ErrorType, I2c, Operation};
use grideye_agent::bus::{OpenBus, OpenError};
use grideye_frame::{COLUMNS, Celsius, Frame, NoData, ROWS, TICK};
use grideye_recording::ClockState;
use grideye_scene::{Scene, Simulator};
use std::num::NonZeroU32;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// The bus's clock on a Raspberry Pi that was told `dtparam=i2c_arm_baudrate=400000`.
pub(crate) const SCL_HZ: Option<NonZeroU32> = NonZeroU32::new(400_000);

/// How much warmer than the room the emulated chip is: real ones sit 3.5 to 6 °C above the scene by self-heating.
const SELF_HEATING_C: f32 = 4.5;

/// What an emulated sensor sees.
pub(crate) type Source = Box<dyn FrameSource + Send>;

/// A scene as a source of frames: time counts from the sensor's first measurement, and the walk begins then.
struct SceneSource {
    simulator: Simulator,
    thermistor: Celsius,
    seed: u64,
    origin: Duration,
}

impl FrameSource for SceneSource {
    fn frame_at(&mut self, t: Duration) -> Frame {
        let image = self
            .simulator
            .noisy(t.saturating_sub(self.origin), self.seed);
        // `scene_source` has refused every sensor that is not 8 x 8.
        image
            .to_frame(self.thermistor)
            .unwrap_or(Frame::uniform(self.thermistor))
    }

    fn measuring_from(&mut self, t: Duration) {
        self.origin = t;
    }
}

/// What a sensor of the scene sees, with noise from `seed`.
pub(crate) fn scene_source(scene: &Scene, simulator: Simulator, seed: u64) -> Result<Source> {
    check_resolution(&simulator)?;
    Ok(Box::new(SceneSource {
        simulator,
        thermistor: self_heated(scene.ambient()),
        seed,
        origin: Duration::ZERO,
    }))
}

/// Refuses a sensor that no AMG8833 can stand for.
pub(crate) fn check_resolution(simulator: &Simulator) -> Result<()> {
    let sensor = simulator.sensor();
    if (sensor.columns, sensor.rows) == (COLUMNS, ROWS) {
        return Ok(());
    }
    Err(crate::exit::bad_input(anyhow!(
        "the sensor {} has {} x {} pixels, and an AMG8833 has {COLUMNS} x {ROWS}\nhint: choose another sensor, or give it `resolution = [8, 8]` in the scene",
        sensor.name,
        sensor.columns,
        sensor.rows
    )))
}

/// The temperature of a chip in a room.
pub(crate) fn self_heated(ambient: Celsius) -> Celsius {
    Celsius::new(ambient.get() + SELF_HEATING_C)
}

/// A recording as a source of frames: one a tick of the sensor from the first measurement on; the last one stays.
struct ReplaySource {
    frames: Vec<Frame>,
    origin: Duration,
}

impl FrameSource for ReplaySource {
    fn frame_at(&mut self, t: Duration) -> Frame {
        let since = t.saturating_sub(self.origin) + TICK / 2;
        let index = usize::try_from(since.as_nanos() / TICK.as_nanos()).unwrap_or(usize::MAX);
        let index = index.min(self.frames.len().saturating_sub(1));
        self.frames
            .get(index)
            .copied()
            .unwrap_or(Frame::uniform(Celsius::new(0.0)))
    }

    fn measuring_from(&mut self, t: Duration) {
        self.origin = t;
    }
}

/// The frames of a recording, in order, one each tick.
pub(crate) fn replay_source(frames: &[grideye_frame::RawFrame]) -> Source {
    let frames = frames.iter().map(word::frame).collect();
    Box::new(ReplaySource {
        frames,
        origin: Duration::ZERO,
    })
}

/// An emulated AMG8833 alone on its bus, powered on now; with a bus clock, transfers take their time.
pub(crate) fn bus<C: Clock>(
    clock: C,
    address: Address,
    source: Source,
    scl_hz: Option<NonZeroU32>,
) -> Bus<C, Source> {
    let bus = Bus::with_sensor(clock, address, source);
    match scl_hz {
        Some(scl_hz) => bus.with_scl_hz(scl_hz),
        None => bus,
    }
}

impl Clock for PacedClock {
    fn now(&self) -> Duration {
        PacedClock::now(self)
    }

    fn pass(&self, bus_time: Duration) {
        PacedClock::pass(self, bus_time);
    }
}

/// Emulated boot time; its wall clock started right when the program did, and is synchronised.
#[derive(Debug)]
pub(crate) struct AgentClock {
    paced: Arc<PacedClock>,
    started_utc: Duration,
}

impl AgentClock {
    /// A wall clock around emulated time.
    pub(crate) fn new(paced: Arc<PacedClock>) -> Self {
        let started_utc = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap_or_default();
        Self { paced, started_utc }
    }
}

impl grideye_agent::clock::Clock for AgentClock {
    fn boot(&self) -> Duration {
        self.paced.now()
    }

    fn utc(&self) -> (i64, ClockState) {
        let utc = self.started_utc + self.paced.now();
        (
            i64::try_from(utc.as_nanos()).unwrap_or(i64::MAX),
            ClockState::Synced,
        )
    }

    fn sleep_until(&self, boot: Duration) {
        self.paced.sleep_until(boot);
    }
}

/// The emulated bus as the agent's thread takes it: opened again and again, it stays the same bus.
#[derive(Clone)]
pub(crate) struct SharedBus(Arc<Mutex<Bus<Arc<PacedClock>, Source>>>);

impl SharedBus {
    /// Shares one bus.
    pub(crate) fn new(bus: Bus<Arc<PacedClock>, Source>) -> Self {
        Self(Arc::new(Mutex::new(bus)))
    }

    /// Looks at the bus, for its counters.
    pub(crate) fn with<T>(&self, look: impl FnOnce(&Bus<Arc<PacedClock>, Source>) -> T) -> T {
        look(&self.0.lock().unwrap_or_else(PoisonError::into_inner))
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
        self.0
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .transaction(address, operations)
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
            other => grideye_agent::bus::by_kind(embedded_hal::i2c::Error::kind(other)),
        }
    }
}
