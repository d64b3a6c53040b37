//! The traits of `embedded-hal-async` 1.0.

use crate::bus::{Bus, BusError};
use crate::clock::Clock;
use crate::edge::Edge;
use crate::shared::{IntPin, PinError, SharedBus};
use crate::source::FrameSource;
use crate::wait::{Waiting, What};
use core::future::poll_fn;
use core::task::Poll;
use embedded_hal::i2c::{I2c as Blocking, Operation};
use embedded_hal_async::digital::Wait;
use embedded_hal_async::i2c::I2c;

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
