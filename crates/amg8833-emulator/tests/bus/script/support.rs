//! A bus with a script and a sensor that counts.

use amg8833_emulator::script::{Rule, Script};
use amg8833_emulator::{Address, Bus, BusError, ManualClock};
use core::time::Duration;
use embedded_hal::i2c::{I2c, NoAcknowledgeSource};
use grideye_frame::{Celsius, Frame};

pub(crate) const HIGH: u8 = 0x69;
pub(crate) const EXAMPLE: &str = include_str!("../../../scripts/faults.toml");

pub(crate) type Source = fn(Duration) -> Frame;
pub(crate) type TestBus = Bus<ManualClock, Source>;

pub(crate) const COUNTING: Source = counting;

pub(crate) const fn ms(milliseconds: u64) -> Duration {
    Duration::from_millis(milliseconds)
}

/// Tick n shows n quarter degrees, up to 2000, then restarts.
pub(crate) fn counting(t: Duration) -> Frame {
    let tick = t.as_millis() / 100 % 2_000;
    Frame::uniform(Celsius::new(f32::from(u16::try_from(tick).unwrap()) / 4.0))
}

pub(crate) fn bus() -> TestBus {
    Bus::with_sensor(ManualClock::new(), Address::High, COUNTING).with_instant_transactions()
}

pub(crate) fn following(rules: Vec<Rule>) -> TestBus {
    let mut bus = bus();
    bus.set_script(Script::new(7, rules).unwrap());
    bus
}

pub(crate) fn from_toml(text: &str) -> TestBus {
    let mut bus = bus();
    bus.set_script(Script::from_toml(text, "test.toml").unwrap());
    bus
}

pub(crate) fn pixels(bus: &mut TestBus) -> Result<Vec<u16>, BusError> {
    let mut bytes = [0; 128];
    bus.write_read(HIGH, &[0x80], &mut bytes)?;
    let words = bytes.chunks(2);
    Ok(words
        .map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
        .collect())
}

pub(crate) fn probe_at(bus: &mut TestBus, milliseconds: u64) -> Result<(), BusError> {
    bus.clock().set(ms(milliseconds));
    bus.write(HIGH, &[])
}

pub(crate) const ABSENT: BusError = BusError::NoAcknowledge {
    address: HIGH,
    source: NoAcknowledgeSource::Address,
};
