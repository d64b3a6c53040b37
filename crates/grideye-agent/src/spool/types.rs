//! The spool's data: segments, the records in them, and what it dropped.

use super::segment::Encoder;
use crate::batch::Place;
use grideye_recording::StreamId;
use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;

/// Numbers of frames and of missing frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Content {
    /// Frames.
    pub frames: u64,
    /// Missing frames.
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

/// Records that left the spool without reaching the collector.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Dropped {
    /// Their stream.
    pub stream: Arc<StreamId>,
    /// How much.
    pub content: Content,
    /// Why.
    pub reason: &'static str,
}

/// The outcome of writing records.
#[derive(Debug, Default)]
pub struct Written {
    /// Places on the disk of the first records, as many as were written.
    pub places: Vec<Place>,
    /// Why the others were not.
    pub error: Option<io::Error>,
}

#[derive(Debug, Default)]
pub(super) struct Segment {
    pub(super) bytes: u64,
    pub(super) streams: Vec<Arc<StreamId>>,
    pub(super) failed_reads: u32,
}

/// Records that wait in a segment without a gap between them.
#[derive(Debug, Default, Clone)]
pub(super) struct Extent {
    pub(super) to: u64,
    pub(super) content: BTreeMap<u16, Content>,
}

#[derive(Debug)]
pub(super) struct Writing {
    pub(super) encoder: Encoder,
    pub(super) end: u64,
    pub(super) is_named_on_disk: bool,
}
