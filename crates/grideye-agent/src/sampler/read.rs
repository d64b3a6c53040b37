//! One read of the registers, and what it leaves to be decided.

use super::content::Content;
use super::phase::Ns;
use grideye_frame::RawFrame;

/// What the registers held when they were last read.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    /// Right before that read.
    pub(super) before: Ns,
    pub(super) content: Content,
    /// Which frame it is, where that is known.
    pub(super) seq: Option<u64>,
}

impl Seen {
    pub(super) fn by(read: &Read, seq: Option<u64>) -> Self {
        Self {
            seq,
            before: read.before,
            content: read.content,
        }
    }
}

/// One read: the registers were copied after `before` and at `latched_until` at the latest.
#[derive(Debug, Clone, Copy)]
pub(super) struct Read {
    pub(super) before: Ns,
    pub(super) latched_until: Ns,
    pub(super) after: Ns,
    pub(super) frame: RawFrame,
    pub(super) content: Content,
}

/// A new frame that may be any from `low` to `high`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pending {
    pub(super) read: Read,
    pub(super) seen_before: Ns,
    pub(super) low: u64,
    pub(super) high: u64,
}
