//! One emulated sensor: what it sees of a scene or a recording, and the bus on which it is alone.

use crate::error::RigError;
use amg8833::word;
use amg8833_emulator::{Address, Bus, Clock, FrameSource};
use grideye_frame::{COLUMNS, Celsius, Frame, ROWS, RawFrame, TICK};
use grideye_scene::{Scene, Simulator};
use std::num::NonZeroU32;
use std::time::Duration;

/// The bus's clock on a Raspberry Pi that was told `dtparam=i2c_arm_baudrate=400000`.
pub const SCL_HZ: Option<NonZeroU32> = NonZeroU32::new(400_000);

/// How much warmer than the room the emulated chip is: real ones sit 3.5 to 6 °C above the scene by self-heating.
const SELF_HEATING_C: f32 = 4.5;

/// What an emulated sensor sees.
pub type Source = Box<dyn FrameSource + Send>;

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
///
/// # Errors
/// Where the sensor has other than 8 x 8 pixels.
pub fn scene_source(scene: &Scene, simulator: Simulator, seed: u64) -> Result<Source, RigError> {
    check_resolution(&simulator)?;
    Ok(Box::new(SceneSource {
        simulator,
        thermistor: self_heated(scene.ambient()),
        seed,
        origin: Duration::ZERO,
    }))
}

/// Refuses a sensor that no AMG8833 can stand for.
pub(crate) fn check_resolution(simulator: &Simulator) -> Result<(), RigError> {
    let sensor = simulator.sensor();
    if (sensor.columns, sensor.rows) == (COLUMNS, ROWS) {
        return Ok(());
    }
    Err(RigError::Resolution {
        sensor: sensor.name.clone(),
        columns: sensor.columns,
        rows: sensor.rows,
    })
}

/// The temperature of a chip in a room.
pub(crate) fn self_heated(ambient: Celsius) -> Celsius {
    Celsius::new(ambient.get() + SELF_HEATING_C)
}

/// A recording as a source of frames: one a sensor period from the first measurement on; the last one stays.
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

/// The frames of a recording, in order, one each sensor period.
#[must_use]
pub fn replay_source(frames: &[RawFrame]) -> Source {
    let frames = frames.iter().map(word::frame).collect();
    Box::new(ReplaySource {
        frames,
        origin: Duration::ZERO,
    })
}

/// An emulated AMG8833 alone on its bus, powered on now; with a bus clock, transfers take their time.
pub fn bus<C: Clock>(
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
