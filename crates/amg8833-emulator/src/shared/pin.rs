//! The INT pin as an input of the controller.

use crate::bus::Bus;
use crate::clock::Clock;
use crate::signal::{Address, InterruptPin};
use crate::source::FrameSource;
use core::cell::RefCell;
use core::fmt;
use core::time::Duration;
use embedded_hal::digital;

/// How long a wait for the INT pin lasts at most, on the clock of the bus: a day.
pub const WAIT_MAX: Duration = Duration::from_secs(86_400);

/// The INT pin as an `embedded_hal::digital::InputPin`: low on an interrupt, else high by its pull-up.
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

/// What can go wrong with the INT pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PinError {
    /// The pin cannot be looked at while the bus is borrowed elsewhere.
    Borrowed,
    /// What was waited for did not come within [`WAIT_MAX`](crate::WAIT_MAX).
    Late,
}

impl fmt::Display for PinError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Borrowed => formatter.write_str("the bus of the INT pin is borrowed elsewhere"),
            Self::Late => write!(
                formatter,
                "the INT pin did not change within {} h\nhint: is the sensor awake, and INT enabled (register 0x03)?",
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
        match self.bus.try_borrow_mut() {
            Ok(mut bus) => Ok(look(&mut bus, self.address)),
            Err(_) => Err(PinError::Borrowed),
        }
    }
}
