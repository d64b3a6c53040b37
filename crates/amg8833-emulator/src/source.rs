//! The source of a sensor's frames.

use core::time::Duration;
use grideye_frame::Frame;

/// The scene before the sensor as a function of time: a closure `FnMut(Duration) -> Frame`, or a [`Frame`] that never
/// changes.
///
/// A room with a person who walks below the sensor is a scene, in a file or in the test:
///
/// ```rust
/// use amg8833_emulator::{Address, Bus, ManualClock};
/// use core::time::Duration;
/// use embedded_hal::i2c::I2c;
/// use grideye_frame::Celsius;
/// use grideye_scene::{Scene, Simulator};
///
/// const ROOM: &str = r#"
///     room = { size_mm = [4000, 4000, 2700], ambient_c = 20 }
///
///     [[agent]]
///     name = "person"
///     size_mm = [300, 500, 1750]
///     temperature_c = 28
///     trajectory = "across"
///     speed_mm_per_s = 500
///
///     [[sensor]]
///     name = "ceiling"
///     preset = "grid-eye"
///     position_mm = [2000, 2000, 2700]
///     elevation_deg = 90
///     azimuth_deg = 0
///     sampling_hz = 10
/// "#;
///
/// let across = |_: &str| Ok("x_mm,y_mm,z_mm\n300,2000,0\n3700,2000,0\n".to_owned());
/// let room = Scene::parse(ROOM, "room", &across)?.scene;
/// let simulator = Simulator::new(&room, "ceiling")?;
/// let person = move |t| simulator.noisy(t, 42).to_frame(Celsius::new(24.5)).unwrap();
/// let mut bus = Bus::with_sensor(ManualClock::new(), Address::High, person);
///
/// // The driver reads its frames here: nobody is below the sensor at first; after three seconds a person is.
/// let mut warmest = |seconds| {
///     bus.clock().set(Duration::from_secs(seconds));
///     let mut pixels = [0; 128];
///     bus.write_read(0x69, &[0x80], &mut pixels).unwrap();
///     pixels.chunks(2).map(|word| f32::from(word[0]) / 4.0).fold(0.0, f32::max)
/// };
/// assert!(warmest(1) < 22.0);
/// assert!(warmest(3) > 24.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait FrameSource {
    /// The array's measurement at `t`, the host time of a sensor tick. The sensor asks once per tick, in order.
    /// Temperatures beyond the register range saturate; not-a-number is a converter overflow.
    fn frame_at(&mut self, t: Duration) -> Frame;

    /// Called at power-on and reset (0x3F). `t` is the first tick with a frame that will reach the registers, unless
    /// the power mode changes first. A replay starts here.
    fn measuring_from(&mut self, t: Duration) {
        let _ = t;
    }
}

impl<F: FnMut(Duration) -> Frame> FrameSource for F {
    fn frame_at(&mut self, t: Duration) -> Frame {
        self(t)
    }
}

impl FrameSource for Frame {
    fn frame_at(&mut self, _t: Duration) -> Frame {
        *self
    }
}

#[cfg(feature = "alloc")]
macro_rules! boxed_sources {
    ($($source:ty),+) => {
        $(impl FrameSource for alloc::boxed::Box<$source> {
            fn frame_at(&mut self, t: Duration) -> Frame {
                (**self).frame_at(t)
            }

            fn measuring_from(&mut self, t: Duration) {
                (**self).measuring_from(t);
            }
        })+
    };
}

#[cfg(feature = "alloc")]
boxed_sources!(dyn FrameSource, dyn FrameSource + Send);

#[cfg(all(test, feature = "alloc"))]
mod tests {
    use super::*;
    use crate::{Address, Bus, Clock, ManualClock};
    use alloc::{boxed::Box, rc::Rc, sync::Arc};
    use embedded_hal::i2c::I2c;
    use grideye_frame::Celsius;

    /// 20 degrees at the first tick.
    struct Started(Duration);

    impl FrameSource for Started {
        fn frame_at(&mut self, t: Duration) -> Frame {
            Frame::uniform(Celsius::new(if t == self.0 { 20.0 } else { 0.0 }))
        }

        fn measuring_from(&mut self, t: Duration) {
            self.0 = t;
        }
    }

    #[test]
    fn boxed_sources_and_counted_clocks_pass_everything_on() {
        let clock = Arc::new(ManualClock::new());
        let boxed: Box<dyn FrameSource + Send> = Box::new(Started(Duration::ZERO));
        let bus = Bus::with_sensor(Arc::clone(&clock), Address::High, boxed);
        let mut bus = bus.with_instant_transactions();
        clock.advance(Duration::from_millis(100));
        let mut pixel = [0; 1];
        assert_eq!(bus.write_read(0x69, &[0x80], &mut pixel), Ok(()));
        assert_eq!(pixel, [80]);

        let counted: Rc<dyn Clock> = Rc::new(ManualClock::new());
        counted.pass(Duration::from_millis(1));
        assert_eq!(counted.now(), Duration::from_millis(1));
        clock.pass(Duration::from_millis(1));
        assert_eq!(clock.now(), Duration::from_millis(101));
    }
}
