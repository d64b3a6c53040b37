//! What a unit with a profile makes of a picture, and what is left of degrees in a sensor's steps.

use crate::geometry::count;
use crate::model::Sensor;
use crate::picture::Image;
use crate::profile::Profile;
use grideye_frame::{Celsius, TICK};
use std::time::Duration;

/// Ticks of the slowest frame: the sensor's own mean at 1 frame a second.
const TICKS_MAX: f64 = 10.0;

/// Puts the unit's pattern, drift and noise on a picture of 8 x 8 pixels; others have no profile.
pub(crate) fn measure(
    profile: &Profile,
    sensor: &Sensor,
    image: &mut Image,
    (time, seed): (Duration, u64),
) {
    // The thermistor is no part of a picture.
    let Some(seen) = image.to_frame(Celsius::new(0.0)) else {
        return;
    };
    // A nanosecond is what a frame's time may be rounded down by.
    let first = (time + Duration::from_nanos(1)).as_nanos() / TICK.as_nanos();
    let first = u64::try_from(first).unwrap_or(u64::MAX);
    let tick_hz = 1.0 / TICK.as_secs_f64();
    let ticks = (tick_hz / sensor.sampling_hz).round().clamp(1.0, TICKS_MAX);
    let mut sums = vec![0.0; image.celsius.len()];
    for tick in 0..count::floor(ticks) {
        let tick = u32::try_from(tick).unwrap_or(0);
        let at = time.saturating_add(TICK * tick);
        let measured = profile.apply(seed, first.saturating_add(tick.into()), at, seen);
        for (sum, celsius) in sums.iter_mut().zip(&measured.pixels) {
            *sum += f64::from(celsius.get());
        }
    }
    for (celsius, sum) in image.celsius.iter_mut().zip(sums) {
        *celsius = sum / ticks;
    }
}

pub(crate) fn quantize(celsius: &mut [f64], step_c: f64) {
    if step_c > 0.0 {
        for celsius in celsius {
            *celsius = (*celsius / step_c).round() * step_c;
        }
    }
}
