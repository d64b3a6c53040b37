//! The agent's threads: how they are started, and which of them still run.

use super::error::StartError;
use crate::lock::lock;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

/// Stack of each thread. Only what is touched becomes resident.
pub(super) const STACK_BYTES: usize = 1 << 20;

/// Which of some threads still run, and whether they shall.
#[derive(Debug)]
pub(super) struct Running {
    pub(super) is_stopping: AtomicBool,
    is_running: Mutex<Vec<bool>>,
    ended: Condvar,
}

impl Running {
    pub(super) fn new(buses: usize) -> Self {
        Self {
            is_stopping: AtomicBool::new(false),
            is_running: Mutex::new(vec![true; buses]),
            ended: Condvar::new(),
        }
    }

    pub(super) fn left(&self) -> usize {
        let is_running = lock(&self.is_running);
        is_running.iter().filter(|is_running| **is_running).count()
    }

    pub(super) fn wait(&self, timeout: Duration) -> bool {
        let some_run = |is_running: &mut Vec<bool>| is_running.contains(&true);
        let waited = self
            .ended
            .wait_timeout_while(lock(&self.is_running), timeout, some_run);
        !waited.unwrap_or_else(PoisonError::into_inner).1.timed_out()
    }

    pub(super) fn still_running(&self, names: &[String]) -> Vec<String> {
        let is_running = lock(&self.is_running);
        let running = names
            .iter()
            .zip(is_running.iter())
            .filter(|(_, is_running)| **is_running);
        running.map(|(name, _)| name.clone()).collect()
    }
}

/// Says that a thread has ended, however it ended.
pub(super) struct Ended<'a> {
    pub(super) running: &'a Running,
    pub(super) index: usize,
}

impl Drop for Ended<'_> {
    fn drop(&mut self) {
        if let Some(is_running) = lock(&self.running.is_running).get_mut(self.index) {
            *is_running = false;
        }
        self.running.ended.notify_all();
    }
}

/// A thread of which [`Running`] tells the end, however it comes.
pub(super) fn spawn_until_ended(
    name: &str,
    running: &Arc<Running>,
    work: impl FnOnce() + Send + 'static,
) -> Result<(), StartError> {
    let running = Arc::clone(running);
    spawn(name, move || {
        let _ended = Ended {
            running: &running,
            index: 0,
        };
        work();
    })
}

pub(super) fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> Result<(), StartError> {
    let thread = std::thread::Builder::new()
        .name(name.to_owned())
        .stack_size(STACK_BYTES);
    match thread.spawn(work) {
        Ok(_) => Ok(()),
        Err(source) => Err(StartError::Thread {
            name: name.to_owned(),
            source,
        }),
    }
}
