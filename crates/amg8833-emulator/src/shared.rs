//! Shared handles of a bus for several drivers, and the sensors' INT pins as controller inputs.

use crate::bus::Bus;
use crate::clock::Clock;
use crate::device::edge::PinEdge;
use crate::signal::{Address, BusError, InterruptPin, Outcome};
use crate::source::FrameSource;
use core::cell::RefCell;
use core::fmt;
use core::time::Duration;
use embedded_hal::digital;
use embedded_hal::i2c::{ErrorType, I2c, Operation};

/// A bus handle for a driver, while a test still inspects the sensor, injects faults or watches its INT pin.
#[derive(Debug)]
pub struct SharedBus<'a, C, S>(&'a RefCell<Bus<C, S>>);

impl<'a, C, S> SharedBus<'a, C, S> {
    /// Creates a handle of this bus, one of any number.
    pub const fn new(bus: &'a RefCell<Bus<C, S>>) -> Self {
        Self(bus)
    }

    /// The INT pin of the sensor at this address, with a pull-up.
    #[must_use]
    pub const fn int_pin(&self, address: Address) -> IntPin<'a, C, S> {
        IntPin {
            bus: self.0,
            address,
        }
    }
}

impl<C, S> Clone for SharedBus<'_, C, S> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<C, S> Copy for SharedBus<'_, C, S> {}

impl<C, S> ErrorType for SharedBus<'_, C, S> {
    type Error = BusError;
}

impl<C: Clock, S: FrameSource> I2c for SharedBus<'_, C, S> {
    /// As on the bus itself. Returns `ArbitrationLoss` while the bus is borrowed elsewhere.
    fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Outcome {
        match self.0.try_borrow_mut() {
            Ok(mut bus) => bus.transaction(address, operations),
            Err(_) => Err(BusError::ArbitrationLoss),
        }
    }
}

/// The longest wait for the INT pin, on the clock of the bus: a day.
pub const WAIT_MAX: Duration = Duration::from_secs(86_400);

/// The INT pin as an `embedded_hal::digital::InputPin`: low on an interrupt, otherwise high by its pull-up.
#[derive(Debug)]
pub struct IntPin<'a, C, S> {
    pub(crate) bus: &'a RefCell<Bus<C, S>>,
    pub(crate) address: Address,
}

impl<C, S> Clone for IntPin<'_, C, S> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<C, S> Copy for IntPin<'_, C, S> {}

/// Why reading the INT pin or waiting for it failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PinError {
    /// The bus is borrowed elsewhere, so its pin cannot be read.
    Borrowed,
    /// The awaited change did not come within [`WAIT_MAX`](crate::WAIT_MAX).
    Late,
}

impl fmt::Display for PinError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Borrowed => formatter.write_str("the bus of the INT pin is borrowed elsewhere"),
            Self::Late => write!(
                formatter,
                "the INT pin did not change within {} h\nhint: is the sensor awake and INT enabled (register 0x03)?",
                WAIT_MAX.as_secs() / 3_600
            ),
        }
    }
}

impl core::error::Error for PinError {}

impl digital::Error for PinError {
    fn kind(&self) -> digital::ErrorKind {
        digital::ErrorKind::Other
    }
}

impl<C, S> digital::ErrorType for IntPin<'_, C, S> {
    type Error = PinError;
}

impl<C: Clock, S: FrameSource> digital::InputPin for IntPin<'_, C, S> {
    fn is_high(&mut self) -> Result<bool, PinError> {
        self.is_low().map(|low| !low)
    }

    fn is_low(&mut self) -> Result<bool, PinError> {
        let pin = self.with_bus(Bus::interrupt_pin)?;
        Ok(pin == Some(InterruptPin::Low))
    }
}

impl<C, S> IntPin<'_, C, S> {
    pub(crate) fn with_bus<R>(
        &self,
        look: impl FnOnce(&mut Bus<C, S>, Address) -> R,
    ) -> Result<R, PinError> {
        let bus = self.bus.try_borrow_mut().ok();
        let mut bus = bus.ok_or(PinError::Borrowed)?;
        Ok(look(&mut bus, self.address))
    }
}

impl<'a, C: Clock, S: FrameSource> IntPin<'a, C, S> {
    /// When the next frame reaches the registers; `None` if the sensor does not measure or is not there.
    ///
    /// # Errors
    /// [`PinError::Borrowed`] while the bus is borrowed elsewhere.
    pub fn next_frame_at(&self) -> Result<Option<Duration>, PinError> {
        self.with_bus(|bus, address| {
            let _ = bus.interrupt_pin(address);
            bus.device(address)?.next_frame_at()
        })
    }

    /// The untaken changes of the pin up to this time. Advances an emulated clock to `until`; ends early on a real
    /// clock or while the bus is borrowed elsewhere.
    #[must_use]
    pub const fn edges(&self, until: Duration) -> PinEdges<'a, C, S> {
        PinEdges { pin: *self, until }
    }
}

/// The changes of an INT pin, from [`IntPin::edges`].
#[derive(Debug)]
pub struct PinEdges<'a, C, S> {
    pin: IntPin<'a, C, S>,
    until: Duration,
}

impl<C: Clock, S: FrameSource> Iterator for PinEdges<'_, C, S> {
    type Item = PinEdge;

    fn next(&mut self) -> Option<PinEdge> {
        let until = self.until;
        let step = |bus: &mut Bus<C, S>, address| {
            let _ = bus.interrupt_pin(address);
            let device = bus.device_mut(address)?;
            if let Some(edge) = device.take_edge() {
                return Some(Some(edge));
            }
            let next = device.next_frame_at().unwrap_or(until).min(until);
            let now = bus.clock().now();
            bus.clock().wait(next);
            // Without this check, the iterator would never end on a clock that cannot be moved.
            (bus.clock().now() > now).then_some(None)
        };
        loop {
            if let Some(edge) = self.pin.with_bus(step).ok()?? {
                return Some(edge);
            }
        }
    }
}
