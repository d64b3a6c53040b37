//! A sensor that a driver of the kernel holds: Linux' `video-i2c` makes a camera of it, `v4l2:/dev/video0`.
//!
//! The driver reads the sensor by a timer of its own and does not follow the sensor's clock. So a record is a frame of
//! the driver, not of the sensor: where the two clocks differ, a sensor's frame comes twice or not at all, and nobody can
//! tell which. What can be told is: a frame whose transfer failed is missing with a reason, frames for which the driver
//! found no buffer are counted by the time that passed, and one that is the same as the frame before is counted as
//! [`UNCHANGED`]. The thermistor is read after the pixels, in a transfer of its own.

mod check;
#[cfg_attr(not(target_pointer_width = "64"), path = "camera/none.rs")]
mod v4l2;

pub use self::check::check_camera;
pub use v4l2::VideoDevice;

use crate::bus::by_errno;
use crate::check::hint;
use crate::clock::{Clock, Stamper};
use crate::config::BusConfig;
use crate::log::Log;
use crate::sampler::ROWS_PER_GAP_MAX;
use crate::worker::{REOPEN_PAUSE, REOPEN_PAUSE_MAX, SLEEP_MAX, Sink};
use grideye_frame::{NoData, RawFrame, Reading};
use grideye_recording::Record;
use std::io;
use std::sync::Arc;
use std::time::Duration;

/// By this name frames are counted that are the same as the one before: read twice by the driver, or a still scene
/// without noise.
pub const UNCHANGED: &str = "unchanged";
/// A frame that comes sooner behind the one before was held for a host that was late.
const HELD_PERIODS: f64 = 0.5;
/// Periods without a frame, good or bad, after which the camera is opened anew.
const SILENT_PERIODS: u32 = 20;

/// Opens a camera, and opens it again after it was gone.
pub trait OpenCamera {
    /// The open camera.
    type Camera: Camera;

    /// Opens the camera.
    ///
    /// # Errors
    /// [`CameraError`], with the reason and what to do about it.
    fn open(&mut self) -> Result<Self::Camera, CameraError>;

    /// The camera's name for the log.
    fn name(&self) -> String;
}

/// A camera that sends frames.
pub trait Camera {
    /// The next frame; `None` if none comes within this time.
    ///
    /// # Errors
    /// The reason why the driver has no frame where it should have one.
    fn frame(&mut self, longest: Duration) -> Result<Option<RawFrame>, NoData>;
}

/// Why a camera cannot be used, and what to do about it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// There is no such device file.
    #[error(
        "{path}: no such camera\nhint: the kernel's driver makes it: `sudo modprobe video-i2c`, then `echo amg88xx 0x69 | \
         sudo tee /sys/bus/i2c/devices/i2c-1/new_device`; without that driver read the sensor itself, path = \"/dev/i2c-1\""
    )]
    NoSuchCamera {
        /// The device file.
        path: String,
    },
    /// The user may not open the device file.
    #[error(
        "{path}: permission denied\nhint: add the user to the group with `sudo usermod -aG video $USER` and log in again"
    )]
    PermissionDenied {
        /// The device file.
        path: String,
    },
    /// It is a camera, but not of this sensor.
    #[error(
        "{path}: expected a camera of 8 x 8 pixels in Y12, found {found}\nhint: `v4l2-ctl --list-devices` names the cameras; \
         that of the sensor is video-i2c's"
    )]
    OtherCamera {
        /// The device file.
        path: String,
        /// What it is.
        found: String,
    },
    /// The driver shows no thermometer, and a frame without one is none.
    #[error(
        "{path}: the kernel's driver shows no thermometer\nhint: the kernel needs CONFIG_HWMON; without it read the sensor \
         itself, path = \"/dev/i2c-1\""
    )]
    NoThermometer {
        /// The device file.
        path: String,
    },
    /// This program was built for 32 bits.
    #[error(
        "{path}: on 32-bit systems this program reads no cameras\nhint: read the sensor itself, path = \"/dev/i2c-1\", or use \
         the 64-bit Raspberry Pi OS"
    )]
    Of32Bits {
        /// The device file.
        path: String,
    },
    /// The system refused it for another reason.
    #[error(
        "{path}: cannot be used as a camera: {source}\nhint: does another program use it? `sudo fuser {path}` names it"
    )]
    Unusable {
        /// The device file.
        path: String,
        /// What the system said.
        source: io::Error,
    },
}

impl CameraError {
    fn reason(&self) -> NoData {
        match self {
            Self::NoSuchCamera { .. } => NoData::Unplugged,
            Self::Unusable { source, .. } => {
                source.raw_os_error().map_or(NoData::BusError, by_errno)
            }
            Self::PermissionDenied { .. } => NoData::BusError,
            Self::OtherCamera { .. } | Self::NoThermometer { .. } | Self::Of32Bits { .. } => {
                NoData::WrongConfiguration
            }
        }
    }
}

/// Reads one camera on this thread until the sink says that it is enough.
pub fn read_camera(
    opener: impl OpenCamera,
    (config, frames_limit): (&BusConfig, Option<u64>),
    clock: Arc<dyn Clock>,
    log: Log,
    sink: &impl Sink,
) {
    let Some(sensor) = config.sensors.first() else {
        return;
    };
    let reader = Reader {
        id: config.sensor_id(sensor),
        period: sensor.rate.period(),
        opener,
        clock,
        log,
        frames_limit,
        next_seq: 0,
        frames: 0,
        last: None,
        lag: 0.0,
        is_reopened: false,
        reason: NoData::HostStalled,
        is_failing: false,
        stamper: Stamper::default(),
        pause: REOPEN_PAUSE,
        said: None,
    };
    reader.run(sink);
}

struct Reader<O: OpenCamera> {
    id: String,
    period: Duration,
    opener: O,
    clock: Arc<dyn Clock>,
    log: Log,
    frames_limit: Option<u64>,
    next_seq: u64,
    frames: u64,
    /// The last frame and when it, or a fault in its place, came.
    last: Option<(RawFrame, Duration)>,
    /// Periods that have passed for which no frame has come yet.
    lag: f64,
    /// Whether it was closed since the last frame.
    is_reopened: bool,
    /// Why the frames are missing that are counted next.
    reason: NoData,
    is_failing: bool,
    stamper: Stamper,
    pause: Duration,
    /// Why the camera did not open when the log last said it.
    said: Option<String>,
}

impl<O: OpenCamera> Reader<O> {
    fn run(mut self, sink: &impl Sink) {
        while !sink.is_stopping() && !self.is_done() {
            match self.opener.open() {
                Ok(camera) => {
                    self.said = None;
                    self.pause = REOPEN_PAUSE;
                    self.is_reopened = true;
                    self.log.info(format!("{}: opened", self.opener.name()));
                    self.follow(camera, sink);
                }
                Err(error) => self.say_closed(&error),
            }
            self.rest(sink);
        }
    }

    fn is_done(&self) -> bool {
        self.frames_limit.is_some_and(|limit| self.frames >= limit)
    }

    /// Takes frames until the camera is gone or silent.
    fn follow(&mut self, mut camera: O::Camera, sink: &impl Sink) {
        let mut heard_at = self.clock.boot();
        while !sink.is_stopping() && !self.is_done() {
            let frame = camera.frame(SLEEP_MAX);
            let now = self.clock.boot();
            match frame {
                Ok(Some(frame)) => self.take(frame, now, sink),
                Ok(None) if now.saturating_sub(heard_at) < SILENT_PERIODS * self.period => continue,
                Ok(None) => {
                    self.fail(NoData::BusTimeout, sink);
                    return;
                }
                Err(NoData::Unplugged) => {
                    self.fail(NoData::Unplugged, sink);
                    return;
                }
                Err(reason) => {
                    self.fail(reason, sink);
                    self.miss_one(now, reason, sink);
                }
            }
            heard_at = now;
        }
    }

    fn take(&mut self, frame: RawFrame, now: Duration, sink: &impl Sink) {
        self.count_missed(now, sink);
        if self
            .last
            .is_some_and(|(last, _)| last.pixels == frame.pixels)
        {
            sink.fault(0, UNCHANGED);
        }
        self.last = Some((frame, now));
        self.frames += 1;
        if std::mem::take(&mut self.is_failing) {
            let seq = self.next_seq;
            let said = format!("{}: reading again from frame {seq} on", self.id);
            self.log.info(said);
        }
        self.record(now, Reading::Frame(frame), sink);
    }

    /// What passed without a frame is missing, once the frames that the driver held for a late host have been taken: they
    /// come right behind each other, and were read before those that are missing.
    fn count_missed(&mut self, now: Duration, sink: &impl Sink) {
        let is_reopened = std::mem::take(&mut self.is_reopened);
        let Some((_, last_at)) = self.last else {
            return;
        };
        let periods = now.saturating_sub(last_at).as_secs_f64() / self.period.as_secs_f64();
        let waited = periods - 1.0;
        if is_reopened {
            // Nothing was held while it was closed.
            self.lag += waited;
            self.miss_what_passed(now, sink);
            self.lag = 0.0;
        } else if periods < HELD_PERIODS {
            self.lag += waited;
        } else {
            self.miss_what_passed(now, sink);
            let is_in_step = periods < 1.0 + HELD_PERIODS;
            self.lag = if is_in_step { 0.0 } else { self.lag + waited };
        }
    }

    fn miss_what_passed(&mut self, now: Duration, sink: &impl Sink) {
        let missed = self.lag.round();
        if missed >= 1.0 {
            self.lag -= missed;
            self.miss(missed, now, sink);
            self.reason = NoData::HostStalled;
        }
    }

    fn miss(&mut self, missed: f64, now: Duration, sink: &impl Sink) {
        #[expect(
            clippy::as_conversions,
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "whole, at least 1, and far below 2^53 periods"
        )]
        let missed = missed as u64;
        let listed = missed.min(ROWS_PER_GAP_MAX);
        // Beyond, the gap shows in the numbers alone.
        self.next_seq += missed - listed;
        for _ in 0..listed {
            self.record(now, Reading::NoData(self.reason), sink);
        }
    }

    /// A frame that the driver tried to read and could not; before the first one there is no number for it.
    fn miss_one(&mut self, now: Duration, reason: NoData, sink: &impl Sink) {
        if let Some((_, at)) = &mut self.last {
            *at = now;
            self.record(now, Reading::NoData(reason), sink);
        }
    }

    fn record(&mut self, now: Duration, reading: Reading<RawFrame>, sink: &impl Sink) {
        let stamp = self.stamper.stamp(now, self.clock.as_ref());
        let seq = self.next_seq;
        self.next_seq += 1;
        let record = Record {
            seq,
            stamp,
            reading,
        };
        sink.record(0, record);
    }

    fn fail(&mut self, reason: NoData, sink: &impl Sink) {
        sink.fault(0, reason.name());
        self.reason = reason;
        if !std::mem::replace(&mut self.is_failing, true) {
            let hint = hint(reason);
            self.log
                .error(format!("{}: {reason}\nhint: {hint}", self.id));
        }
    }

    fn say_closed(&mut self, error: &CameraError) {
        self.reason = error.reason();
        let why = error.to_string();
        if self.said.as_ref() != Some(&why) {
            self.log.error(&why);
            self.said = Some(why);
        }
    }

    /// Waits before the next attempt to open the camera.
    fn rest(&mut self, sink: &impl Sink) {
        let until = self.clock.boot() + self.pause;
        self.pause = (2 * self.pause).min(REOPEN_PAUSE_MAX);
        while !sink.is_stopping() && !self.is_done() {
            let now = self.clock.boot();
            if now >= until {
                return;
            }
            self.clock.sleep_until(until.min(now + SLEEP_MAX));
        }
    }
}

#[cfg(test)]
mod tests;
