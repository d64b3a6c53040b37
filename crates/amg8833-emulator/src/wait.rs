//! The INT pin as an event.

use crate::clock::Clock;
use crate::edge::{Edge, PinEdge};
use crate::shared::{IntPin, PinError};
use crate::source::FrameSource;
use core::time::Duration;

/// How long a wait for the INT pin lasts at most, on the clock of the bus: a day.
pub const WAIT_MAX: Duration = Duration::from_secs(86_400);
/// The step in which an emulated clock moves while a sensor that measures nothing is waited for: the sensor's period.
const IDLE_STEP: Duration = Duration::from_millis(100);

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

    /// Looks at the pin; unless the look is what was waited for, lets an emulated clock pass on to the sensor's next
    /// frame and looks again. One frame at a time, so that other tasks come to their turn in between.
    pub(crate) fn look(&self, wait: &mut Waiting) -> Result<bool, PinError> {
        self.with_bus(|bus, address| {
            let came = |bus: &mut crate::Bus<C, S>, wait: &mut Waiting| {
                let low = bus.interrupt_pin(address) == Some(crate::InterruptPin::Low);
                let counts = bus.device(address).map(crate::Device::edge_counts);
                wait.came(low, counts.unwrap_or_default())
            };
            if came(bus, wait) {
                return Ok(true);
            }
            let now = bus.clock().now();
            if now.saturating_sub(*wait.since.get_or_insert(now)) >= WAIT_MAX {
                return Err(PinError::Late);
            }
            let next = bus.device(address).and_then(crate::Device::next_frame_at);
            let next = next.filter(|next| *next > now);
            bus.clock()
                .wait(next.unwrap_or_else(|| now.saturating_add(IDLE_STEP)));
            Ok(came(bus, wait))
        })?
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
        let step = |bus: &mut crate::Bus<C, S>, address| {
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

/// What is waited for on a pin, and since when.
#[derive(Debug)]
pub(crate) struct Waiting {
    what: What,
    /// Falling and rising edges so far when the wait began, which is with the first look.
    before: Option<(u64, u64)>,
    since: Option<Duration>,
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum What {
    Low,
    High,
    Edge(Edge),
    AnyEdge,
}

impl Waiting {
    pub(crate) const fn new(what: What) -> Self {
        Self {
            what,
            before: None,
            since: None,
        }
    }

    fn came(&mut self, low: bool, (falling, rising): (u64, u64)) -> bool {
        let before = *self.before.get_or_insert((falling, rising));
        match self.what {
            What::Low => low,
            What::High => !low,
            What::Edge(Edge::Falling) => falling > before.0,
            What::Edge(Edge::Rising) => rising > before.1,
            What::AnyEdge => (falling, rising) != before,
        }
    }
}
