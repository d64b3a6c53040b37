//! How the agent uses the sensor's driver: its settings, its waits, and what its errors mean.

use super::open::OpenBus;
use crate::clock::Clock;
use crate::config::SensorConfig;
use amg8833::{Amg8833, Error, MovingAverage, Settings};
use embedded_hal::delay::DelayNs;
use embedded_hal::i2c::{ErrorType, I2c};
use grideye_frame::NoData;
use std::time::Duration;

/// What a released line reads as.
const ONES: u8 = u8::MAX;

/// The registers' settings for a sensor, as the configuration asks for them. The interrupt levels are ones that no
/// pixel passes and that a reset sensor does not have, so that a silent reset is found by reading them back.
pub(crate) fn settings(config: &SensorConfig) -> Settings {
    Settings {
        frame_rate: config.rate,
        moving_average: if config.moving_average {
            MovingAverage::Twice
        } else {
            MovingAverage::Off
        },
        ..Settings::default()
    }
}

/// Waits of the driver on the agent's clock.
pub(crate) struct Delay<'a>(pub(crate) &'a dyn Clock);

impl DelayNs for Delay<'_> {
    fn delay_ns(&mut self, ns: u32) {
        self.0
            .sleep_until(self.0.boot() + Duration::from_nanos(u64::from(ns)));
    }
}

pub(super) fn has_its_settings<B: I2c>(
    driver: &mut Amg8833<B>,
    settings: &Settings,
) -> Result<bool, Error<B::Error>> {
    match driver.configuration() {
        Ok(found) => Ok(found.deviation(settings).is_none()),
        // A line that is stuck high is no sensor with wrong settings.
        Err(Error::UndefinedPowerMode(mode)) if mode.found != ONES => Ok(false),
        Err(error) => Err(error),
    }
}

/// What an error of the driver means for the frame.
pub(crate) fn reason<O: OpenBus>(
    opener: &O,
    error: &Error<<O::Bus as ErrorType>::Error>,
) -> NoData {
    match error {
        Error::Bus(error) => opener.classify(error),
        Error::ShortRead { .. } => NoData::ShortTransfer,
        Error::UndefinedPowerMode(mode) if mode.found == ONES => NoData::StuckHigh,
        Error::UndefinedPowerMode(_) => NoData::WrongConfiguration,
    }
}
