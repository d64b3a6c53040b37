//! Changes of the interrupt pin, with the newest few stored.

use core::time::Duration;

/// How many changes of the INT pin a sensor stores for [`Device::take_edge`](crate::Device::take_edge).
pub const EDGES_MAX: usize = 16;

/// The direction of a change of the INT pin.
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
    /// When, on the host's clock: the frame's tick, the STOP that delayed the frame, or the write that caused the
    /// change.
    pub at: Duration,
    /// The direction.
    pub edge: Edge,
}

/// The changes of the INT pin: counts of all, details of the newest.
#[derive(Debug, Clone, Default)]
pub(crate) struct Edges {
    low: bool,
    pub(crate) counts: (u64, u64),
    kept: [Option<PinEdge>; EDGES_MAX],
    /// The index of the oldest stored change, and the number stored.
    oldest: usize,
    count: usize,
    /// Changes overwritten before anything took them.
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
