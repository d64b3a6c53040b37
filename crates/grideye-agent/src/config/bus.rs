//! The sections `[[bus]]` and `[[bus.sensor]]`.

use super::error::ConfigError;
use super::place::Place;
use super::types::{BusConfig, SensorConfig};
use amg8833::{Address, FrameRate};
use serde::Deserialize;
use std::path::{Path, PathBuf};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawBus {
    path: toml::Spanned<PathBuf>,
    #[serde(default)]
    sensor: Vec<RawSensor>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSensor {
    address: toml::Spanned<u64>,
    rate_hz: Option<toml::Spanned<u64>>,
    #[serde(default)]
    moving_average: bool,
}

pub(super) fn check_bus(
    raw: RawBus,
    at: usize,
    place: &Place<'_>,
) -> Result<BusConfig, ConfigError> {
    if raw.path.get_ref().file_name().is_none() || !Path::new(raw.path.get_ref()).is_absolute() {
        let message = format!(
            "path: expected a device file, found {:?}",
            raw.path.get_ref()
        );
        return Err(place.refuse(
            raw.path.span().start,
            message,
            "on a Raspberry Pi it is /dev/i2c-1",
        ));
    }
    if raw.sensor.is_empty() {
        let hint = "add [[bus.sensor]] with address = 0x69 (or 0x68)";
        return Err(place.refuse(at, "expected at least one [[bus.sensor]]".to_owned(), hint));
    }
    let mut sensors: Vec<SensorConfig> = Vec::new();
    for raw_sensor in raw.sensor {
        let address_at = raw_sensor.address.span().start;
        let sensor = check_sensor(raw_sensor, place)?;
        if sensors.iter().any(|other| other.address == sensor.address) {
            let message = format!("address: {} is named twice on this bus", sensor.address);
            return Err(place.refuse(
                address_at,
                message,
                "two sensors on one bus are 0x68 and 0x69",
            ));
        }
        sensors.push(sensor);
    }
    Ok(BusConfig {
        path: raw.path.into_inner(),
        sensors,
    })
}

fn check_sensor(raw: RawSensor, place: &Place<'_>) -> Result<SensorConfig, ConfigError> {
    let found = *raw.address.get_ref();
    let address = u8::try_from(found)
        .ok()
        .and_then(|address| Address::try_from(address).ok());
    let Some(address) = address else {
        return Err(place.refuse(
            raw.address.span().start,
            format!("address: expected 0x68 or 0x69, found {found:#04x}"),
            if matches!(found, 68 | 69) {
                format!("write 0x{found}: without 0x it is a decimal number")
            } else {
                "give the 7-bit address: 0x69 on most breakout boards, 0x68 where AD_SELECT is at GND".to_owned()
            },
        ));
    };
    let rate = check_rate(raw.rate_hz, place)?;
    Ok(SensorConfig {
        address,
        rate,
        moving_average: raw.moving_average,
    })
}

fn check_rate(
    given: Option<toml::Spanned<u64>>,
    place: &Place<'_>,
) -> Result<FrameRate, ConfigError> {
    let found = given.as_ref().map_or(10, |rate| *rate.get_ref());
    let rate = u8::try_from(found).ok().and_then(FrameRate::from_fps);
    rate.ok_or_else(|| {
        place.refuse(
            given.map_or(0, |rate| rate.span().start),
            format!("rate_hz: expected 10 or 1, found {found}"),
            "the sensor measures ten times or once a second and at no other rate",
        )
    })
}
