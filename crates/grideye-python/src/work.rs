//! Long calls: without Python's lock, and ended by Ctrl-C.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

/// How long Ctrl-C waits for its answer.
const LOOK_EVERY: Duration = Duration::from_millis(50);

thread_local! {
    /// Of the work that this thread does.
    static OWN: RefCell<Option<Arc<State>>> = const { RefCell::new(None) };
}

#[derive(Default)]
struct State {
    stop: AtomicBool,
    done: AtomicU64,
}

/// Whether nobody waits for the work that this thread does.
pub(crate) fn is_stopped() -> bool {
    OWN.with_borrow(|own| {
        own.as_ref()
            .is_some_and(|own| own.stop.load(Ordering::SeqCst))
    })
}

/// Whether somebody waits for the work that this thread does, of which one more piece is done.
pub(crate) fn goes_on() -> bool {
    OWN.with_borrow(|own| {
        own.iter().for_each(|own| {
            own.done.fetch_add(1, Ordering::Relaxed);
        });
    });
    !is_stopped()
}

/// Works on a thread of its own, while Python's other threads run and its signals are handled. After a signal that
/// raises, the work is told to stop, and ends when it looks.
pub(crate) fn work<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    work_shown(py, None, work)
}

/// The same; `show` is called now and then with how many pieces are done.
pub(crate) fn work_shown<T: Send + 'static>(
    py: Python<'_>,
    show: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let state = Arc::new(State::default());
    let (tell, mut told) = mpsc::sync_channel(1);
    let own = Arc::clone(&state);
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
                let shown = show.map(|show| show.call1((state.done.load(Ordering::Relaxed),)));
                if let Err(raised) = py.check_signals().and(shown.transpose()) {
                    state.stop.store(true, Ordering::SeqCst);
                    return Err(raised);
                }
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err("the work ended without a result"));
            }
        }
    }
}
