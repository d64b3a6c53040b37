//! A handle of a bus that several drivers share.

pub(crate) mod pin;

use crate::bus::Bus;
use crate::clock::Clock;
use crate::shared::pin::IntPin;
use crate::signal::{Address, BusError};
use crate::source::FrameSource;
use core::cell::RefCell;
use embedded_hal::i2c::{ErrorType, I2c, Operation};

pub use pin::PinEdges;

/// A bus that a driver holds while a test goes on looking at the sensor, breaking it, or watching its INT pin.
#[derive(Debug)]
pub struct SharedBus<'a, C, S>(&'a RefCell<Bus<C, S>>);

impl<'a, C, S> SharedBus<'a, C, S> {
    /// One of any number of handles on this bus.
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
    /// As on the bus itself. While the bus is borrowed elsewhere, the arbitration is lost.
    fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), BusError> {
        match self.0.try_borrow_mut() {
            Ok(mut bus) => bus.transaction(address, operations),
            Err(_) => Err(BusError::ArbitrationLoss),
        }
    }
}
