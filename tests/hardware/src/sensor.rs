//! The sensor under test, and how its frames come.

use crate::device::Device;
use amg8833::{Address, Amg8833, Error, FrameRate, Settings};
use embedded_hal::i2c::I2c as _;
use grideye_frame::{PIXELS, PixelWord};
use linux_embedded_hal::i2cdev::linux::LinuxI2CError;
use linux_embedded_hal::{Delay, I2CError, I2cdev};
use std::time::{Duration, Instant};

/// Between two looks for a new frame.
const LOOK_EVERY: Duration = Duration::from_millis(4);

/// Why the suite cannot go on.
pub(crate) enum Fault {
    Bus(String),
    /// Longer than a frame passed between two looks: how many frames came cannot be told.
    Paused(Duration),
}

impl From<Error<I2CError>> for Fault {
    fn from(error: Error<I2CError>) -> Self {
        Self::Bus(error.to_string())
    }
}

impl From<LinuxI2CError> for Fault {
    fn from(error: LinuxI2CError) -> Self {
        Self::Bus(error.to_string())
    }
}

pub(crate) struct Sensor {
    bus: I2cdev,
    address: Address,
}

/// What was seen of frames for some time.
pub(crate) struct Seen {
    /// When the pixels changed, from the first change on.
    pub(crate) changes: Vec<Instant>,
}

impl Seen {
    /// Between two changes; `None` where there were not two.
    pub(crate) fn shortest_gap(&self) -> Option<Duration> {
        let gaps = self.changes.windows(2).map(|pair| pair[1] - pair[0]);
        gaps.min()
    }
}

impl Sensor {
    pub(crate) fn open(device: &Device) -> Result<Self, Fault> {
        let bus = I2cdev::new(&device.bus)?;
        Ok(Self {
            bus,
            address: device.address,
        })
    }

    pub(crate) fn driver(&mut self) -> Amg8833<&mut I2cdev> {
        Amg8833::new(&mut self.bus, self.address)
    }

    /// Woken, reset and set up, with frames that may be read.
    pub(crate) fn start(&mut self, settings: &Settings) -> Result<(), Fault> {
        self.driver().init(&mut Delay, settings)?;
        std::thread::sleep(settings.frame_rate.settling_time());
        Ok(())
    }

    pub(crate) fn sleep(&mut self) -> Result<(), Fault> {
        Ok(self.driver().sleep(&mut Delay)?)
    }

    pub(crate) fn wake(&mut self) -> Result<(), Fault> {
        Ok(self.driver().wake(&mut Delay)?)
    }

    pub(crate) fn initial_reset(&mut self) -> Result<(), Fault> {
        Ok(self.driver().initial_reset(&mut Delay)?)
    }

    /// Long enough for new levels to be compared with a frame that began after them.
    pub(crate) fn let_frames_pass(&self) {
        std::thread::sleep(3 * FrameRate::Ten.period());
    }

    /// Looks at the pixels for so long.
    pub(crate) fn watch(&mut self, time: Duration, rate: FrameRate) -> Result<Seen, Fault> {
        let begin = Instant::now();
        let (mut last, mut looked) = (self.driver().read_pixels()?, begin);
        let mut changes = Vec::new();
        while begin.elapsed() < time {
            std::thread::sleep(LOOK_EVERY);
            let pixels: [PixelWord; PIXELS] = self.driver().read_pixels()?;
            let now = Instant::now();
            if now - looked > rate.period() {
                return Err(Fault::Paused(now - looked));
            }
            looked = now;
            if pixels != last {
                last = pixels;
                changes.push(now);
            }
        }
        Ok(Seen { changes })
    }

    /// Registers as they are, past the driver.
    pub(crate) fn registers<const N: usize>(&mut self, first: u8) -> Result<[u8; N], Fault> {
        let mut bytes = [0; N];
        let read = self
            .bus
            .write_read(self.address.get(), &[first], &mut bytes);
        read.map_err(|error| Fault::Bus(error.to_string()))?;
        Ok(bytes)
    }
}
