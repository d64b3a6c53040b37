//! The connections of one server: their limit and their end.

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

    /// Admits a connection, for as long as the [`Guest`] lives.
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

    pub(crate) fn stop(&self, how: Shutdown) {
        let mut inside = self.lock();
        inside.stopping = true;
        for stream in inside.streams.values() {
            // A connection that has already ended needs no shutdown.
            let _ = shutdown(stream, how);
        }
    }

    pub(crate) fn wait(&self, longest: Duration) {
        let waiting = |inside: &mut Inside<S>| !inside.streams.is_empty();
        // The server continues the same way, whether all are gone or time is up.
        let _ = self
            .one_less
            .wait_timeout_while(self.lock(), longest, waiting);
    }

    fn lock(&self) -> MutexGuard<'_, Inside<S>> {
        lock(&self.inside)
    }
}

/// A panic elsewhere under the lock must not hang the others.
pub(crate) fn lock<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// One connection's slot. Dropping it, even on a panic of the bus, ends the connection.
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
