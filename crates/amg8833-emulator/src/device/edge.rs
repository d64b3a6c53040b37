//! Changes of the interrupt pin, and the few of them that are kept.

use core::time::Duration;

/// The most changes of the INT pin that a sensor keeps for [`Device::take_edge`](crate::Device::take_edge).
pub const EDGES_MAX: usize = 16;

/// Which way the INT pin went.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Edge {
    /// Pulled low: an interrupt.
    Falling,
    /// Released, or driven high.
    Rising,
}

/// A change of the INT pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PinEdge {
    /// When, on the host's clock: the tick of the frame, the STOP that it had to wait for, or the write that caused it.
    pub at: Duration,
    /// Which way.
    pub edge: Edge,
}

/// What happened to the INT pin: all of it in numbers, the newest one by one.
#[derive(Debug, Clone, Default)]
pub(crate) struct Edges {
    low: bool,
    /// Falling and rising edges so far.
    pub(crate) counts: (u64, u64),
    kept: [Option<PinEdge>; EDGES_MAX],
    /// The place of the oldest, and how many there are from there on.
    oldest: usize,
    count: usize,
    /// Changes that nobody took in time.
    pub(crate) lost: u64,
}

impl Edges {
    pub(crate) fn note(&mut self, low: bool, at: Duration) {
        if low == self.low {
            return;
        }
        self.low = low;
        let edge = if low {
            self.counts.0 += 1;
            Edge::Falling
        } else {
            self.counts.1 += 1;
            Edge::Rising
        };
        if self.count == EDGES_MAX {
            self.take();
            self.lost += 1;
        }
        let place = (self.oldest + self.count) % EDGES_MAX;
        if let Some(free) = self.kept.get_mut(place) {
            *free = Some(PinEdge { at, edge });
            self.count += 1;
        }
    }

    pub(crate) fn take(&mut self) -> Option<PinEdge> {
        let taken = self.kept.get_mut(self.oldest)?.take()?;
        self.oldest = (self.oldest + 1) % EDGES_MAX;
        self.count -= 1;
        Some(taken)
    }
}
