//! Runs long computations off the threads that serve, one at a time, with a bounded queue.

use axum::http::StatusCode;
use grideye_collector::Refusal;
use std::sync::Arc;
use tokio::sync::Semaphore;

/// Maximum requests running or waiting; one more gets an error.
const WAITING_MAX: usize = 32;

/// Runs one piece of work at a time, so that pages never use more than one processor.
pub(crate) struct Queue {
    turn: Arc<Semaphore>,
    waiting: Semaphore,
    waiting_max: usize,
}

impl Queue {
    pub(crate) fn new() -> Self {
        Self::with_waiting(WAITING_MAX)
    }

    /// With a limit on requests, including the running one.
    pub(crate) fn with_waiting(waiting_max: usize) -> Self {
        Self {
            turn: Arc::new(Semaphore::new(1)),
            waiting: Semaphore::new(waiting_max),
            waiting_max,
        }
    }

    /// Runs the work on its own thread, after earlier work. Work that has started finishes even if nobody waits for it
    /// any more.
    ///
    /// # Errors
    /// 503 if too many wait, 500 if the work panicked.
    pub(crate) async fn run<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Refusal> {
        let Ok(_waiting) = self.waiting.try_acquire() else {
            let what = format!("{} requests are already waiting", self.waiting_max);
            return Err(Refusal::new(StatusCode::SERVICE_UNAVAILABLE, "busy", what)
                .hint("try again in a second, or close other pages"));
        };
        let turn = Arc::clone(&self.turn).acquire_owned().await;
        let done = tokio::task::spawn_blocking(move || {
            let _turn = turn;
            work()
        });
        done.await.map_err(|error| {
            let what = format!("the computation failed: {error}");
            Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, "broke_off", what)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::response::IntoResponse as _;
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::sync::mpsc;

    #[tokio::test]
    async fn one_works_at_a_time_and_one_too_many_gets_503() {
        let queue = Arc::new(Queue::new());
        let (open, opened) = mpsc::channel::<()>();
        let is_first_done = Arc::new(AtomicBool::new(false));
        let first = {
            let (queue, is_done) = (Arc::clone(&queue), Arc::clone(&is_first_done));
            tokio::spawn(async move {
                let work = move || {
                    let was_opened = opened.recv().is_ok();
                    is_done.store(true, Ordering::SeqCst);
                    was_opened
                };
                queue.run(work).await.ok()
            })
        };
        let others: Vec<_> = (1..WAITING_MAX)
            .map(|_| {
                let (queue, is_done) = (Arc::clone(&queue), Arc::clone(&is_first_done));
                tokio::spawn(
                    async move { queue.run(move || is_done.load(Ordering::SeqCst)).await.ok() },
                )
            })
            .collect();
        while queue.waiting.available_permits() > 0 {
            tokio::task::yield_now().await;
        }
        let refused = queue.run(|| ()).await;
        let status = refused.map_err(|refusal| refusal.into_response().status());
        assert_eq!(status, Err(StatusCode::SERVICE_UNAVAILABLE));
        // Gives another one time to start, if it could.
        std::thread::sleep(std::time::Duration::from_millis(50));
        open.send(()).unwrap();
        for other in std::iter::once(first).chain(others) {
            assert_eq!(other.await.unwrap(), Some(true));
        }
    }
}
