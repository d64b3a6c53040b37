//! The connections of one server: how many there may be, and how all of them end.

use rustix::net::{Shutdown, shutdown};
use std::collections::BTreeMap;
use std::os::fd::AsFd;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

#[derive(Debug)]
pub(crate) struct Guests<S> {
    inside: Mutex<Inside<S>>,
    one_less: Condvar,
}

#[derive(Debug)]
struct Inside<S> {
    streams: BTreeMap<u64, Arc<S>>,
    next: u64,
    stopping: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TurnedAway {
    Full,
    Stopping,
}

impl<S: AsFd> Guests<S> {
    pub(crate) fn new() -> Arc<Self> {
        Arc::new(Self {
            inside: Mutex::new(Inside {
                streams: BTreeMap::new(),
                next: 0,
                stopping: false,
            }),
            one_less: Condvar::new(),
        })
    }

    /// Lets a connection in, for as long as the [`Guest`] lives.
    pub(crate) fn admit(
        self: &Arc<Self>,
        stream: &Arc<S>,
        most: usize,
    ) -> Result<Guest<S>, TurnedAway> {
        let mut inside = self.lock();
        if inside.stopping {
            return Err(TurnedAway::Stopping);
        }
        if inside.streams.len() >= most {
            return Err(TurnedAway::Full);
        }
        let number = inside.next;
        inside.next += 1;
        inside.streams.insert(number, Arc::clone(stream));
        Ok(Guest {
            guests: Arc::clone(self),
            number,
        })
    }

    pub(crate) fn is_stopping(&self) -> bool {
        self.lock().stopping
    }

    /// Lets nobody in any more, and shuts all connections down.
    pub(crate) fn stop(&self, how: Shutdown) {
        let mut inside = self.lock();
        inside.stopping = true;
        for stream in inside.streams.values() {
            // One that is not connected any more needs no end.
            let _ = shutdown(stream, how);
        }
    }

    pub(crate) fn wait(&self, longest: Duration) {
        let waiting = |inside: &mut Inside<S>| !inside.streams.is_empty();
        // Whether all have gone or the time is up makes no difference to what follows.
        let _ = self
            .one_less
            .wait_timeout_while(self.lock(), longest, waiting);
    }

    #[cfg(test)]
    pub(crate) fn count(&self) -> usize {
        self.lock().streams.len()
    }

    fn lock(&self) -> MutexGuard<'_, Inside<S>> {
        lock(&self.inside)
    }
}

/// A panic elsewhere while it was held is no reason to hang the others as well.
pub(crate) fn lock<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// One connection's place. Its end, also by a panic of the bus, is the connection's.
pub(crate) struct Guest<S: AsFd> {
    guests: Arc<Guests<S>>,
    number: u64,
}

impl<S: AsFd> Drop for Guest<S> {
    fn drop(&mut self) {
        if let Some(stream) = self.guests.lock().streams.remove(&self.number) {
            let _ = shutdown(stream, Shutdown::Both);
        }
        self.guests.one_less.notify_all();
    }
}
