//! [`FrameStore`], the trait that every engine implements.

use crate::store::error::RecordingId;
use crate::store::plan::Taken;
use crate::store::queue::{Change, Queue};
use crate::store::types::{
    Answer, Appended, KeptLabel, Label, Members, News, Recording, Span, StoreUsage, StoredRecord,
    StreamSummary,
};
use grideye_recording::wire::Batch;
use std::sync::Arc;
use tokio::sync::mpsc;

/// A store of frames and recordings. A change is answered once it is on disk; a repeated frame changes nothing.
pub trait FrameStore: Send + Sync + 'static {
    /// The queue to the engine's only writer.
    #[doc(hidden)]
    fn queue(&self) -> &Queue;

    /// Stores the whole batch, or nothing if there is an error.
    fn append(&self, batch: Arc<Batch>, t_arrival_ns: i64) -> Answer<'_, Appended> {
        self.queue().append(Taken {
            batch,
            t_arrival_ns,
        })
    }

    /// Summaries of the streams added to last, at most `streams_listed_max`, ordered by device, sensor, boot.
    fn streams(&self) -> Answer<'_, Vec<StreamSummary>>;

    /// For each (device, sensor), the newest record of the stream that frames were added to last.
    fn newest(&self) -> Answer<'_, Vec<StoredRecord>>;

    /// Starts a recording. Frames that arrive from now on belong to it.
    fn start_recording(&self, name: String, t_start_ns: i64) -> Answer<'_, Recording> {
        let start = |reply| Change::Start(name, t_start_ns, reply);
        self.queue().change(start)
    }

    /// Ends a recording. Frames that arrive from now on do not belong to it.
    fn stop_recording(&self, id: RecordingId, t_stop_ns: i64) -> Answer<'_, Recording> {
        let stop = |reply| Change::Stop(id, t_stop_ns, reply);
        self.queue().change(stop)
    }

    /// Sets a recording's note; empty text removes it.
    fn note_recording(&self, id: RecordingId, note: String) -> Answer<'_, Recording> {
        self.queue().change(|reply| Change::Note(id, note, reply))
    }

    /// Renews the lease of a running recording; the first call gives it one.
    fn renew_recording(&self, id: RecordingId) -> Answer<'_, ()> {
        self.queue().change(|reply| Change::Renew(id, reply))
    }

    /// Deletes a recording with its note and labels, for good: its number is not given again. Its frames stay, and from
    /// now on age like all others.
    fn delete_recording(&self, id: RecordingId) -> Answer<'_, ()> {
        self.queue().change(|reply| Change::Delete(id, reply))
    }

    /// The running recordings that have a lease, and how often each was renewed.
    fn leases(&self) -> Answer<'_, Vec<(RecordingId, i64)>>;

    /// The labels of a recording, oldest first.
    fn labels(&self, id: RecordingId) -> Answer<'_, Vec<KeptLabel>>;

    /// Adds a label to a recording. The caller checks that its frames exist.
    fn add_label(&self, id: RecordingId, label: Label) -> Answer<'_, KeptLabel> {
        let add = |reply| Change::AddLabel(id, label, reply);
        self.queue().change(add)
    }

    /// Removes a label.
    fn remove_label(&self, id: RecordingId, number: i64) -> Answer<'_, ()> {
        let remove = |reply| Change::RemoveLabel(id, number, reply);
        self.queue().change(remove)
    }

    /// Whether a collector ever asked for tokens with this store; from now on one did, if `is_asking`.
    fn asked_for_tokens(&self, is_asking: bool) -> Answer<'_, bool> {
        self.queue()
            .change(|reply| Change::AskForTokens(is_asking, reply))
    }

    /// Every recording, newest first.
    fn recordings(&self) -> Answer<'_, Vec<Recording>>;

    /// Which frames belong to a recording. Only this method decides that.
    fn members(&self, id: RecordingId) -> Answer<'_, Members>;

    /// The next records of one span of a recording, by ascending seq: at most `rows`, after `after_seq`.
    fn page(
        &self,
        span: Span,
        after_seq: Option<u64>,
        rows: usize,
    ) -> Answer<'_, Vec<StoredRecord>>;

    /// What other collectors add to the same store from now on, for the live page. Gives the receiver once, and `None`
    /// for a store that is not shared.
    fn news(&self) -> Option<mpsc::Receiver<News>> {
        None
    }

    /// How much space the frames take, and the limit.
    fn usage(&self) -> Answer<'_, StoreUsage>;

    /// Fails if the store cannot be read, or if the last write failed.
    fn ping(&self) -> Answer<'_, ()>;

    /// Commits all waiting requests and closes the files. Later calls return [`Closed`](crate::StoreError::Closed).
    fn close(&self) -> Answer<'_, ()>;
}
