//! The traits of `embedded-hal-async` 1.0.

use crate::bus::Bus;
use crate::clock::Clock;
use crate::device::Device;
use crate::device::edge::Edge;
use crate::mux::Mux;
use crate::shared::SharedBus;
use crate::shared::pin::{IntPin, PinError, WAIT_MAX};
use crate::signal::{BusError, InterruptPin};
use crate::source::FrameSource;
use core::future::poll_fn;
use core::task::Poll;
use core::time::Duration;
use embedded_hal::i2c::{I2c as Blocking, Operation};
use embedded_hal_async::digital::Wait;
use embedded_hal_async::i2c::I2c;
use grideye_frame::TICK;

/// The step in which an emulated clock moves while a sensor that measures nothing is waited for: the sensor's period.
const IDLE_STEP: Duration = TICK;

/// Ready at once: the emulated bus does its work, and lets its clock pass, within one poll.
impl<C: Clock, S: FrameSource> I2c for Bus<C, S> {
    async fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), BusError> {
        Blocking::transaction(self, address, operations)
    }
}

/// Ready at once, as on the bus itself.
impl<C: Clock, S: FrameSource> I2c for SharedBus<'_, C, S> {
    async fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), BusError> {
        Blocking::transaction(self, address, operations)
    }
}

/// Ready at once, as on the bus itself.
impl<C: Clock, S: FrameSource> I2c for Mux<C, S> {
    async fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), BusError> {
        Blocking::transaction(self, address, operations)
    }
}

/// What waiting does: each poll looks at the pin as of the clock's time. When that is not what is waited for, an
/// emulated clock is moved on to the sensor's next frame ([`Clock::wait`]), the pin is looked at again, and then it is
/// other tasks' turn before the next frame. So a lone wait on a [`ManualClock`](crate::ManualClock) ends at once, at the
/// emulated time of the edge, and tasks that wait for one another go through the same emulated time whatever the
/// executor.
///
/// A real clock ignores that, and its pin is polled as fast as the executor likes: a program that cares waits for the
/// time of [`IntPin::next_frame_at`] on its executor's timer first.
///
/// No edge after the first poll is missed, even if the pin is back by the next one. A wait ends with [`PinError::Late`]
/// after [`WAIT_MAX`](crate::WAIT_MAX), and with [`PinError::Borrowed`] at once.
impl<C: Clock, S: FrameSource> Wait for IntPin<'_, C, S> {
    async fn wait_for_high(&mut self) -> Result<(), PinError> {
        wait(self, What::High).await
    }

    async fn wait_for_low(&mut self) -> Result<(), PinError> {
        wait(self, What::Low).await
    }

    async fn wait_for_rising_edge(&mut self) -> Result<(), PinError> {
        wait(self, What::Edge(Edge::Rising)).await
    }

    async fn wait_for_falling_edge(&mut self) -> Result<(), PinError> {
        wait(self, What::Edge(Edge::Falling)).await
    }

    async fn wait_for_any_edge(&mut self) -> Result<(), PinError> {
        wait(self, What::AnyEdge).await
    }
}

async fn wait<C: Clock, S: FrameSource>(
    pin: &IntPin<'_, C, S>,
    what: What,
) -> Result<(), PinError> {
    let mut waiting = Waiting::new(what);
    poll_fn(|context| match pin.look(&mut waiting) {
        Ok(true) => Poll::Ready(Ok(())),
        Ok(false) => {
            context.waker().wake_by_ref();
            Poll::Pending
        }
        Err(error) => Poll::Ready(Err(error)),
    })
    .await
}

impl<C: Clock, S: FrameSource> IntPin<'_, C, S> {
    /// Looks at the pin; unless the look is what was waited for, lets an emulated clock pass on to the sensor's next
    /// frame and looks again. One frame at a time, so that other tasks come to their turn in between.
    fn look(&self, wait: &mut Waiting) -> Result<bool, PinError> {
        self.with_bus(|bus, address| {
            let came = |bus: &mut Bus<C, S>, wait: &mut Waiting| {
                let low = bus.interrupt_pin(address) == Some(InterruptPin::Low);
                let counts = bus.device(address).map(Device::edge_counts);
                wait.came(low, counts.unwrap_or_default())
            };
            if came(bus, wait) {
                return Ok(true);
            }
            let now = bus.clock().now();
            if now.saturating_sub(*wait.since.get_or_insert(now)) >= WAIT_MAX {
                return Err(PinError::Late);
            }
            let next = bus.device(address).and_then(Device::next_frame_at);
            let next = next.filter(|next| *next > now);
            bus.clock()
                .wait(next.unwrap_or_else(|| now.saturating_add(IDLE_STEP)));
            Ok(came(bus, wait))
        })?
    }
}

/// What is waited for on a pin, and since when.
#[derive(Debug)]
struct Waiting {
    what: What,
    /// Falling and rising edges so far when the wait began, which is with the first look.
    before: Option<(u64, u64)>,
    since: Option<Duration>,
}

#[derive(Debug, Clone, Copy)]
enum What {
    Low,
    High,
    Edge(Edge),
    AnyEdge,
}

impl Waiting {
    const fn new(what: What) -> Self {
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
