//! Long calls: without Python's lock, and ended by Ctrl-C.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

/// How long Ctrl-C waits for its answer.
const LOOK_EVERY: Duration = Duration::from_millis(50);

thread_local! {
    /// Of the work that this thread does.
    static OWN: RefCell<Option<Arc<AtomicBool>>> = const { RefCell::new(None) };
}

/// Whether nobody waits for the work that this thread does.
pub(crate) fn is_stopped() -> bool {
    OWN.with_borrow(|own| own.as_ref().is_some_and(|stop| stop.load(Ordering::SeqCst)))
}

/// Works on a thread of its own, while Python's other threads run and its signals are handled. After a signal that
/// raises, the work is told to stop, and ends when it looks.
pub(crate) fn work<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let stop = Arc::new(AtomicBool::new(false));
    let (tell, mut told) = mpsc::sync_channel(1);
    let own = Arc::clone(&stop);
    thread::Builder::new().spawn(move || {
        OWN.set(Some(own));
        // After Ctrl-C nobody listens.
        let _ = tell.send(work());
    })?;
    loop {
        let outcome;
        (told, outcome) = py.detach(move || {
            let outcome = told.recv_timeout(LOOK_EVERY);
            (told, outcome)
        });
        match outcome {
            Ok(done) => return Ok(done),
            Err(RecvTimeoutError::Timeout) => {
                if let Err(raised) = py.check_signals() {
                    stop.store(true, Ordering::SeqCst);
                    return Err(raised);
                }
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err("the work ended without a result"));
            }
        }
    }
}
