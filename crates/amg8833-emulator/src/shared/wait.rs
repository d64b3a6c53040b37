//! The INT pin as an event.

use crate::bus::Bus;
use crate::clock::Clock;
use crate::device::edge::PinEdge;
use crate::shared::pin::{IntPin, PinError};
use crate::source::FrameSource;
use core::time::Duration;

impl<'a, C: Clock, S: FrameSource> IntPin<'a, C, S> {
    /// When the next frame comes into the registers: the next time at which the pin can change by itself. `None` when
    /// the sensor does not measure, or is not there.
    ///
    /// # Errors
    ///
    /// While the bus is borrowed elsewhere.
    pub fn next_frame_at(&self) -> Result<Option<Duration>, PinError> {
        self.with_bus(|bus, address| {
            let _ = bus.interrupt_pin(address);
            bus.device(address)?.next_frame_at()
        })
    }

    /// The changes of the pin that were not taken yet, in order, from those that lie in the past to those to come until
    /// this time. To find those to come, an emulated clock is moved on, frame by frame; with a real clock, the changes
    /// end at the present.
    ///
    /// Ends early while the bus is borrowed elsewhere.
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
            // Without this the changes would never end on a clock that cannot be moved.
            (bus.clock().now() > now).then_some(None)
        };
        loop {
            if let Some(edge) = self.pin.with_bus(step).ok()?? {
                return Some(edge);
            }
        }
    }
}
