//! The sensor under the drivers, and its true values.

use amg8833_emulator::{Address, Bus, ManualClock, SharedBus};
use grideye_frame::{Celsius, Frame};
use grideye_scene::{Scene, Simulator};
use std::cell::RefCell;
use std::time::Duration;

pub(crate) type Source = Box<dyn FnMut(Duration) -> Frame>;
pub(crate) type Sensor = RefCell<Bus<ManualClock, Source>>;
pub(crate) type Handle<'a> = SharedBus<'a, ManualClock, Source>;

pub(crate) fn sensor(source: impl FnMut(Duration) -> Frame + 'static) -> Sensor {
    let source: Source = Box::new(source);
    let bus = Bus::with_sensor(ManualClock::new(), Address::High, source);
    RefCell::new(bus.with_instant_transactions())
}

pub(crate) fn uniform(celsius: f32) -> Frame {
    Frame::uniform(Celsius::new(celsius))
}

/// Pixels at 20 degrees, and the chip itself at this temperature.
pub(crate) fn warm_chip(celsius: f32) -> Frame {
    Frame {
        thermistor: Celsius::new(celsius),
        ..uniform(20.0)
    }
}

pub(crate) fn set(sensor: &Sensor, milliseconds: u64) {
    let bus = sensor.borrow();
    bus.clock().set(Duration::from_millis(milliseconds));
}

/// The registers, read without a driver.
pub(crate) fn registers(sensor: &Sensor, first: u8, count: usize) -> Vec<u8> {
    use embedded_hal::i2c::I2c;
    let mut bytes = vec![0; count];
    let mut bus = sensor.borrow_mut();
    bus.write_read(0x69, &[first], &mut bytes).unwrap();
    bytes
}

pub(crate) fn words(sensor: &Sensor, first: u8, count: usize) -> Vec<u16> {
    let bytes = registers(sensor, first, 2 * count);
    let pairs = bytes.chunks_exact(2);
    pairs
        .map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
        .collect()
}

/// The value of a pixel or level word: two's complement of twelve bits in quarter degrees (AMG88 spec §4-11-11).
pub(crate) fn true_pixel(word: u16) -> f32 {
    let steps = if word >= 0x800 {
        i32::from(word) - 0x1000
    } else {
        i32::from(word)
    };
    steps as f32 / 4.0
}

/// The value of the thermistor word: sign and magnitude in sixteenths of a degree (AMG88 spec §4-11-9).
pub(crate) fn true_thermistor(word: u16) -> f32 {
    let magnitude = f32::from(word & 0x7FF) / 16.0;
    if word & 0x800 == 0 {
        magnitude
    } else {
        -magnitude
    }
}

/// The scene of the paper's experiment 3, a person walking below the sensor, with all temperatures lowered by
/// `colder_by`.
pub(crate) fn person(colder_by: f64) -> impl FnMut(Duration) -> Frame + 'static {
    let scenes = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../scenes/");
    let mut text = std::fs::read_to_string(format!("{scenes}experiment-3.toml")).unwrap();
    for celsius in ["23.5", "27.5", "27 "] {
        let value: f64 = celsius.trim().parse().unwrap();
        assert!(text.contains(&format!("_c = {celsius}")));
        text = text.replace(
            &format!("_c = {celsius}"),
            &format!("_c = {:.1} ", value - colder_by),
        );
    }
    let files = |name: &str| std::fs::read_to_string(format!("{scenes}{name}"));
    let loaded = Scene::parse(&text, "experiment-3.toml", &files).unwrap();
    let simulator = Simulator::new(&loaded.scene, "ceiling").unwrap();
    let chip = loaded.scene.ambient().get() + 4.5;
    move |t| simulator.noisy(t, 42).to_frame(Celsius::new(chip)).unwrap()
}

/// How far the frame's warmest pixel is above its median: the person, or the noise.
pub(crate) fn contrast(sensor: &Sensor) -> f32 {
    let mut pixels: Vec<f32> = words(sensor, 0x80, 64)
        .into_iter()
        .map(true_pixel)
        .collect();
    pixels.sort_by(f32::total_cmp);
    pixels[63] - pixels[32]
}
