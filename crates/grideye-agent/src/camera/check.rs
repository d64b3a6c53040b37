//! The one-shot test of a camera, for `grideye-agent check`.

use super::{Camera, OpenCamera};
use crate::check::{Measured, Report, Trouble, hint};
use crate::clock::Clock;
use amg8833::{FrameRate, word};
use grideye_frame::{Celsius, NoData, RawFrame};
use std::collections::BTreeMap;
use std::time::Duration;

/// Frames that are looked at.
const FRAMES: u32 = 5;
/// So many periods are waited for these, and for the chip to wake.
const PERIODS_MAX: u32 = 4 * FRAMES;
/// How late the kernel's timer may be at either end of the time that the rate is reckoned from.
const JITTER_S: f64 = 0.02;

/// Opens the camera and takes a few frames.
pub fn check_camera(
    mut opener: impl OpenCamera,
    sensor: &str,
    rate: FrameRate,
    clock: &dyn Clock,
) -> Report {
    let mut report = Report {
        sensor: sensor.to_owned(),
        ok: false,
        measured: None,
        trouble: None,
        errors: BTreeMap::new(),
    };
    let mut camera = match opener.open() {
        Ok(camera) => camera,
        Err(error) => {
            report.trouble = Some(trouble(&error.to_string(), ""));
            return report;
        }
    };
    let mut frames: Vec<(RawFrame, Duration)> = Vec::new();
    let until = clock.boot() + PERIODS_MAX * rate.period();
    let mut reason = NoData::BusTimeout;
    while frames.len() < usize::try_from(FRAMES).unwrap_or(1) && clock.boot() < until {
        match camera.frame(rate.period()) {
            Ok(frame) => frames.extend(frame.map(|frame| (frame, clock.boot()))),
            Err(found) => {
                reason = found;
                *report.errors.entry(found.name().to_owned()).or_default() += 1;
            }
        }
    }
    report.measured = measured(&frames, rate);
    report.ok = report.measured.is_some();
    if !report.ok {
        report.trouble = Some(trouble(&format!("no frame comes: {reason}"), hint(reason)));
    }
    report
}

/// Words with their own hint, or with this one.
fn trouble(said: &str, hint: &str) -> Trouble {
    let (error, hint) = said.split_once("\nhint: ").unwrap_or((said, hint));
    Trouble {
        error: error.to_owned(),
        hint: hint.to_owned(),
    }
}

fn measured(frames: &[(RawFrame, Duration)], rate: FrameRate) -> Option<Measured> {
    let ((_, first_at), (last, last_at)) = (frames.first()?, frames.last()?);
    let intervals = f64::from(u32::try_from(frames.len()).ok()?) - 1.0;
    let seconds = last_at.saturating_sub(*first_at).as_secs_f64();
    let frame = word::frame(last);
    (intervals > 0.0 && seconds > 0.0).then(|| Measured {
        thermistor_c: frame.thermistor.get(),
        pixels_c: frame.pixels.map(Celsius::get).to_vec(),
        frames: frames.len(),
        missing: 0,
        rate_hz: intervals / seconds,
        rate_error_hz: intervals / seconds * JITTER_S / seconds,
        nominal_hz: rate.fps(),
    })
}
