//! What the spool knows of segments, of the records in them, and of what it dropped.

use super::segment::Encoder;
use crate::batch::Place;
use grideye_recording::StreamId;
use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;

/// Frames, and rows that say why there is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Content {
    /// Frames.
    pub frames: u64,
    /// Rows without a frame.
    pub rows: u64,
}

impl Content {
    pub(super) fn add(&mut self, is_frame: bool) {
        if is_frame {
            self.frames += 1;
        } else {
            self.rows += 1;
        }
    }

    pub(super) fn take(&mut self, is_frame: bool) {
        if is_frame {
            self.frames = self.frames.saturating_sub(1);
        } else {
            self.rows = self.rows.saturating_sub(1);
        }
    }
}

/// What left the spool in another way than to the collector.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Dropped {
    /// The stream that it belongs to.
    pub stream: Arc<StreamId>,
    /// How much.
    pub content: Content,
    /// Why.
    pub reason: &'static str,
}

/// What became of records that were to be written.
#[derive(Debug, Default)]
pub struct Written {
    /// Where the first so many of them are on the disk.
    pub places: Vec<Place>,
    /// Why the others are not.
    pub error: Option<io::Error>,
}

/// A segment that is there.
#[derive(Debug, Default)]
pub(super) struct Segment {
    pub(super) bytes: u64,
    pub(super) streams: Vec<Arc<StreamId>>,
    pub(super) failed_reads: u32,
}

/// Records that wait in a segment, without a gap between them.
#[derive(Debug, Default, Clone)]
pub(super) struct Extent {
    pub(super) to: u64,
    pub(super) content: BTreeMap<u16, Content>,
}

/// The segment that is being written.
#[derive(Debug)]
pub(super) struct Writing {
    pub(super) encoder: Encoder,
    pub(super) end: u64,
    pub(super) is_named_on_disk: bool,
}
