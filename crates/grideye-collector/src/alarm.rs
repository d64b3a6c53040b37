//! One timer per connection: setting a timer for every wait would cost more than checking whether this one has fired.

use crate::lock::lock;
use hyper::rt;
use std::future::{Future, poll_fn};
use std::pin::{Pin, pin};
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll, ready};
use std::time::Duration;
use tokio::time::{Instant, Sleep};

/// Fires no later than the next awaited moment, and is set again if it was too early. It wakes the connection's task.
#[derive(Clone, Default)]
pub(crate) struct Alarm(Arc<Mutex<Option<Pin<Box<Sleep>>>>>);

impl Alarm {
    pub(crate) async fn within<F: Future>(
        &self,
        time_max: Duration,
        future: F,
    ) -> Option<F::Output> {
        let moment = Instant::now() + time_max;
        let mut future = pin!(future);
        poll_fn(|cx| match future.as_mut().poll(cx) {
            Poll::Ready(given) => Poll::Ready(Some(given)),
            Poll::Pending => self.poll_until(cx, moment).map(|()| None),
        })
        .await
    }

    fn poll_until(&self, cx: &mut Context<'_>, moment: Instant) -> Poll<()> {
        let mut alarm = lock(&self.0);
        let alarm = alarm.get_or_insert_with(|| Box::pin(tokio::time::sleep_until(moment)));
        if alarm.deadline() > moment {
            alarm.as_mut().reset(moment);
        }
        loop {
            ready!(alarm.as_mut().poll(cx));
            if moment <= Instant::now() {
                return Poll::Ready(());
            }
            alarm.as_mut().reset(moment);
        }
    }
}

impl rt::Timer for Alarm {
    fn sleep(&self, duration: Duration) -> Pin<Box<dyn rt::Sleep>> {
        self.sleep_until(self.now() + duration)
    }

    fn sleep_until(&self, moment: std::time::Instant) -> Pin<Box<dyn rt::Sleep>> {
        Box::pin(Wait {
            alarm: self.clone(),
            moment: moment.into(),
        })
    }

    fn now(&self) -> std::time::Instant {
        Instant::now().into()
    }
}

struct Wait {
    alarm: Alarm,
    moment: Instant,
}

impl Future for Wait {
    type Output = ();

    fn poll(self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<()> {
        self.alarm.poll_until(cx, self.moment)
    }
}

impl rt::Sleep for Wait {}

#[cfg(test)]
mod tests {
    use super::*;
    use hyper::rt::Timer as _;
    use std::future::pending;
    use tokio::time::sleep;

    const fn s(seconds: u64) -> Duration {
        Duration::from_secs(seconds)
    }

    /// How long `future` takes, in seconds of the runtime's clock.
    async fn taken<T>(future: impl Future<Output = T>) -> (u64, T) {
        let began = Instant::now();
        let given = future.await;
        (began.elapsed().as_secs(), given)
    }

    #[tokio::test(start_paused = true)]
    async fn one_timer_meets_every_deadline_in_any_order() {
        let alarm = Alarm::default();
        let slow = || pending::<()>();
        assert_eq!(taken(alarm.within(s(30), slow())).await, (30, None));
        // The timer is in the past, then 30 seconds ahead, then set earlier, and then fires too early.
        let in_time = alarm.within(s(30), sleep(s(3)));
        assert_eq!(taken(in_time).await, (3, Some(())));
        assert_eq!(taken(alarm.within(s(10), slow())).await, (10, None));
        let in_time = alarm.within(s(10), sleep(s(4)));
        assert_eq!(taken(in_time).await, (4, Some(())));
        assert_eq!(taken(alarm.within(s(30), slow())).await, (30, None));
        assert_eq!(taken(alarm.sleep(s(7))).await, (7, ()));
    }

    #[tokio::test(start_paused = true)]
    async fn two_waits_in_one_task_are_both_woken() {
        let alarm = Alarm::default();
        let both = async { tokio::join!(taken(alarm.sleep(s(20))), taken(alarm.sleep(s(5)))) };
        assert_eq!(both.await, ((20, ()), (5, ())));
    }
}
