//! The bus and the INT pin on the traits of `embedded-hal-async` 1.0.

use crate::bus::Bus;
use crate::clock::Clock;
use crate::device::Device;
use crate::mux::Mux;
use crate::shared::{IntPin, PinError, SharedBus, WAIT_MAX};
use crate::signal::{InterruptPin, Outcome};
use crate::source::FrameSource;
use core::future::poll_fn;
use core::task::Poll;
use core::time::Duration;
use embedded_hal::i2c::{I2c as Blocking, Operation};
use embedded_hal_async::digital::Wait;
use embedded_hal_async::i2c::I2c;
use grideye_frame::TICK;

/// The step of an emulated clock while waiting for a sensor that measures nothing: the sensor's period.
const IDLE_STEP: Duration = TICK;

macro_rules! at_once {
    ($($bus:ty),+) => {
        $(/// Ready at once: the emulated bus does its work and advances its clock within one poll.
        impl<C: Clock, S: FrameSource> I2c for $bus {
            async fn transaction(
                &mut self,
                address: u8,
                operations: &mut [Operation<'_>],
            ) -> Outcome {
                Blocking::transaction(self, address, operations)
            }
        })+
    };
}

at_once!(Bus<C, S>, SharedBus<'_, C, S>, Mux<C, S>);

/// Each poll checks the pin, advances an emulated clock to the sensor's next frame ([`Clock::wait`]) and checks again,
/// so that tasks waiting for one another share the same emulated time on any executor. A real clock ignores the
/// advance: the executor then polls the pin as fast as it likes, unless the program waits for [`IntPin::next_frame_at`]
/// first.
///
/// No edge after the first poll is missed. A wait ends with [`PinError::Late`] after [`WAIT_MAX`](crate::WAIT_MAX).
impl<C: Clock, S: FrameSource> Wait for IntPin<'_, C, S> {
    async fn wait_for_high(&mut self) -> Result<(), PinError> {
        wait(self, |low, _, _| !low).await
    }

    async fn wait_for_low(&mut self) -> Result<(), PinError> {
        wait(self, |low, _, _| low).await
    }

    async fn wait_for_rising_edge(&mut self) -> Result<(), PinError> {
        wait(self, |_, (_, before), (_, rising)| rising > before).await
    }

    async fn wait_for_falling_edge(&mut self) -> Result<(), PinError> {
        wait(self, |_, (before, _), (falling, _)| falling > before).await
    }

    async fn wait_for_any_edge(&mut self) -> Result<(), PinError> {
        wait(self, |_, before, edges| edges != before).await
    }
}

type Edges = (u64, u64);

/// Waits until `came` accepts the pin's level (low or not) and its edge counts before and now.
async fn wait<C: Clock, S: FrameSource>(
    pin: &IntPin<'_, C, S>,
    came: impl Fn(bool, Edges, Edges) -> bool,
) -> Result<(), PinError> {
    let mut begun = None;
    poll_fn(|context| match pin.look(&mut begun, &came) {
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
    /// Checks the pin; if the awaited change has not come, advances an emulated clock to the next frame and checks
    /// again.
    fn look(
        &self,
        begun: &mut Option<(Duration, Edges)>,
        came: impl Fn(bool, Edges, Edges) -> bool,
    ) -> Result<bool, PinError> {
        self.with_bus(|bus, address| {
            let now = bus.clock().now();
            let look = |bus: &mut Bus<C, S>| {
                let low = bus.interrupt_pin(address) == Some(InterruptPin::Low);
                let edges = bus.device(address).map(Device::edge_counts);
                (low, edges.unwrap_or_default())
            };
            let (low, edges) = look(bus);
            let (since, before) = *begun.get_or_insert((now, edges));
            if came(low, before, edges) {
                return Ok(true);
            }
            if now.saturating_sub(since) >= WAIT_MAX {
                return Err(PinError::Late);
            }
            let next = bus.device(address).and_then(Device::next_frame_at);
            let next = next.filter(|next| *next > now);
            let idle = now.saturating_add(IDLE_STEP);
            bus.clock().wait(next.unwrap_or(idle));
            let (low, edges) = look(bus);
            Ok(came(low, before, edges))
        })?
    }
}
