//! Locks that stay usable after a panic on another thread.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Locks even a poisoned mutex: a panic would be a defect, but continuing loses less than stopping.
pub(crate) fn lock<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
