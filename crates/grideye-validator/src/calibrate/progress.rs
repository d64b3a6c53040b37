//! How far the work has come, for whoever waits.

/// Frames that were simulated with all their derivatives, and at most how many will be: a search that ends early skips the
/// rest of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// So many; never fewer than before, and all at the end.
    pub done: u64,
    /// Of so many.
    pub total: u64,
}

/// Counts steps, and tells.
pub(crate) struct Pace<'a> {
    tell: &'a mut dyn FnMut(Progress),
    at: Progress,
    /// Frames of a step of the search that runs, and where `done` is when it has ended.
    each: u64,
    ends: u64,
}

impl<'a> Pace<'a> {
    pub(crate) fn new(total: usize, tell: &'a mut dyn FnMut(Progress)) -> Self {
        let total = long(total);
        Self {
            tell,
            at: Progress { done: 0, total },
            each: 0,
            ends: 0,
        }
    }

    /// A search of at most so many steps begins, on so many frames.
    pub(crate) fn begin(&mut self, steps_max: usize, frames: usize) {
        self.each = long(frames);
        self.ends = self.at.done + long(steps_max) * self.each;
    }

    pub(crate) fn step(&mut self) {
        self.reach((self.at.done + self.each).min(self.ends));
    }

    pub(crate) fn end(&mut self) {
        self.reach(self.ends);
    }

    fn reach(&mut self, done: u64) {
        self.at.done = done;
        (self.tell)(self.at);
    }
}

fn long(number: usize) -> u64 {
    u64::try_from(number).unwrap_or(u64::MAX)
}
