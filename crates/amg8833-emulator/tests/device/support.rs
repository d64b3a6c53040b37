//! A sensor with its bus and clock, and helpers for these tests.

use amg8833_emulator::{Address, Bus, Device, Fault, ManualClock, Options};
use core::time::Duration;
use embedded_hal::i2c::I2c;
use grideye_frame::{Celsius, Frame};

pub(crate) const HIGH: u8 = 0x69;
pub(crate) const ADDRESS: Address = Address::High;
pub(crate) const NORMAL: [u8; 2] = [0x00, 0x00];
pub(crate) const SLEEP: [u8; 2] = [0x00, 0x10];
pub(crate) const INITIAL_RESET: [u8; 2] = [0x01, 0x3F];
pub(crate) const FLAG_RESET: [u8; 2] = [0x01, 0x30];
pub(crate) const ONE_FPS: [u8; 2] = [0x02, 0x01];
pub(crate) const AVERAGE_KEY: [[u8; 2]; 5] = [
    [0x1F, 0x50],
    [0x1F, 0x45],
    [0x1F, 0x57],
    [0x07, 0x20],
    [0x1F, 0x00],
];

pub(crate) type Source = Box<dyn FnMut(Duration) -> Frame>;

/// One sensor at 0x69 on a bus with a manual clock.
pub(crate) struct Rig {
    pub(crate) bus: Bus<ManualClock, Source>,
}

impl Rig {
    pub(crate) fn new(source: impl FnMut(Duration) -> Frame + 'static) -> Self {
        Self::with(source, Options::default())
    }

    pub(crate) fn with(source: impl FnMut(Duration) -> Frame + 'static, options: Options) -> Self {
        let mut bus = Bus::new(ManualClock::new()).with_instant_transactions();
        let boxed: Source = Box::new(source);
        assert!(bus.plug(Address::High, boxed, options).is_none());
        Self { bus }
    }

    /// A bus with only this sensor, and its clock at the start.
    pub(crate) fn of(device: Device<Source>) -> Self {
        let mut rig = Self::new(constant(0.0));
        *rig.device() = device;
        rig
    }

    pub(crate) fn at_scl(self, hz: u32) -> Self {
        let bus = self.bus.with_scl_hz(hz.try_into().unwrap());
        Self { bus }
    }

    pub(crate) fn pass(&mut self, milliseconds: u64) {
        self.bus
            .clock()
            .advance(Duration::from_millis(milliseconds));
    }

    pub(crate) fn set(&mut self, milliseconds: u64) {
        self.bus.clock().set(Duration::from_millis(milliseconds));
    }

    pub(crate) fn write(&mut self, bytes: &[u8]) {
        self.bus.write(HIGH, bytes).unwrap();
    }

    pub(crate) fn read(&mut self, register: u8, count: usize) -> Vec<u8> {
        let mut bytes = vec![0xA5; count];
        self.bus.write_read(HIGH, &[register], &mut bytes).unwrap();
        bytes
    }

    pub(crate) fn register(&mut self, register: u8) -> u8 {
        self.read(register, 1)[0]
    }

    pub(crate) fn pixels(&mut self) -> Vec<u16> {
        words(&self.read(0x80, 128))
    }

    /// The word of all pixels, which must be equal.
    pub(crate) fn word(&mut self) -> u16 {
        let pixels = self.pixels();
        assert!(
            pixels.iter().all(|word| *word == pixels[0]),
            "mixed frames: {pixels:?}"
        );
        pixels[0]
    }

    /// All 256 registers.
    pub(crate) fn image(&mut self) -> Vec<u8> {
        self.read(0x00, 256)
    }

    pub(crate) fn device(&mut self) -> &mut Device<Source> {
        self.bus.device_mut(Address::High).unwrap()
    }

    pub(crate) fn frames(&mut self) -> u64 {
        use amg8833_emulator::Clock;
        let now = self.bus.clock().now();
        self.device().advance(now);
        self.device().frames()
    }
}

pub(crate) fn words(bytes: &[u8]) -> Vec<u16> {
    bytes
        .chunks(2)
        .map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
        .collect()
}

pub(crate) const fn ms(milliseconds: u64) -> Duration {
    Duration::from_millis(milliseconds)
}

pub(crate) fn uniform(celsius: f32) -> Frame {
    Frame::uniform(Celsius::new(celsius))
}

pub(crate) fn constant(celsius: f32) -> impl FnMut(Duration) -> Frame {
    move |_| uniform(celsius)
}

/// Tick n of an exact clock shows n quarter degrees: the pixel words count the ticks.
pub(crate) fn counting(t: Duration) -> Frame {
    uniform(f32::from(u16::try_from(t.as_millis() / 100).unwrap()) / 4.0)
}

/// A uniform frame except for one pixel, given by its number from 1 to 64.
pub(crate) fn with_pixel(celsius: f32, number: usize, other: f32) -> Frame {
    let mut frame = uniform(celsius);
    frame.pixels[number - 1] = Celsius::new(other);
    frame
}

pub(crate) fn broken(fault: Fault) -> Rig {
    let mut rig = Rig::new(counting);
    rig.set(300);
    assert!(rig.bus.set_fault(Address::High, fault));
    rig
}

pub(crate) fn mended(rig: &mut Rig) {
    assert!(rig.bus.clear_fault(Address::High));
    assert!(rig.bus.faults(Address::High).is_empty());
}
