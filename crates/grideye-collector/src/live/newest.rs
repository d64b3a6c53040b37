//! The newest frame of every sensor, for programs that look at all of them again and again.

use crate::live::feed::Live;
use grideye_recording::{Record, StreamId};
use std::sync::Arc;
use std::time::Duration;

/// The newest frame of every sensor, and how old it is.
///
/// Whoever looks takes nothing away and keeps nobody waiting for longer than it takes to copy a frame of each: at most
/// [`Limits::sensors_max`](crate::Limits::sensors_max) are held. After a restart these are the frames that the store
/// holds, with their age.
#[derive(Clone)]
pub struct NewestFrames(Arc<Live>);

/// A sensor's newest frame.
#[derive(Debug, Clone, PartialEq)]
pub struct NewestFrame {
    /// Whose it is.
    pub stream: StreamId,
    /// The record, which has pixels.
    pub record: Record,
    /// Since it was measured, by clocks that do not jump; at least so long where only its arrival is known.
    pub age: Duration,
}

impl NewestFrames {
    pub(crate) fn new(live: Arc<Live>) -> Self {
        Self(live)
    }

    /// One of each sensor that ever sent a frame, in the order of device and sensor.
    #[must_use]
    pub fn look(&self) -> Vec<NewestFrame> {
        let now_ns = self.0.now_ns();
        let sensors = self.0.sensors();
        let newest = sensors.values().filter_map(|sensor| {
            let measured = sensor.newest_frame?;
            let age_ns = (now_ns - measured.measured_ns).max(0);
            Some(NewestFrame {
                stream: StreamId::clone(&sensor.stream.id),
                record: measured.record,
                age: Duration::from_nanos(u64::try_from(age_ns).unwrap_or(u64::MAX)),
            })
        });
        newest.collect()
    }
}
