//! The queue of a store's writer: its commands, and how callers wait for the answers.

use crate::lock::lock;
use crate::store::error::{RecordingId, Result, StoreError};
use crate::store::plan::Taken;
use crate::store::types::{Answer, Appended, KeptLabel, Label, Recording};
use std::sync::{Arc, Mutex};
use tokio::sync::mpsc::error::TrySendError;
use tokio::sync::{mpsc, oneshot};

pub(super) type Reply<T> = oneshot::Sender<Result<T>>;

/// The result of each batch of a group, or the error that stopped them all.
pub(super) type Outcome = Result<Vec<Result<Appended>>>;

#[derive(Debug)]
pub(super) enum Command {
    Append(Taken, Reply<Appended>),
    Change(Change),
}

/// A change other than a batch, and where its result goes.
#[derive(Debug)]
pub(super) enum Change {
    /// The name, and the wall clock in nanoseconds.
    Start(String, i64, Reply<Recording>),
    Stop(RecordingId, i64, Reply<Recording>),
    Note(RecordingId, String, Reply<Recording>),
    Renew(RecordingId, Reply<()>),
    Delete(RecordingId, Reply<()>),
    AddLabel(RecordingId, Label, Reply<KeptLabel>),
    RemoveLabel(RecordingId, i64, Reply<()>),
    AskForTokens(bool, Reply<bool>),
    /// Ends the epoch, so that readers share an end; answers with the ended epoch's number.
    EndEpoch(Reply<i64>),
    /// Makes every acknowledged frame visible to later reads.
    Settle(Reply<()>),
}

/// The queue to the writer; when it is full, further requests are rejected.
#[derive(Debug)]
pub struct Queue(Mutex<Option<mpsc::Sender<Command>>>);

impl Queue {
    pub(super) fn new(waiting_max: usize) -> (Self, mpsc::Receiver<Command>) {
        let (commands, queue) = mpsc::channel(waiting_max.max(1));
        (Self(Mutex::new(Some(commands))), queue)
    }

    /// Queues a batch at once, and waits until it is committed.
    pub(super) fn append(&self, taken: Taken) -> Answer<'static, Appended> {
        self.ask(|reply| Command::Append(taken, reply))
    }

    /// The same for a change.
    pub(super) fn change<T: Send + 'static>(
        &self,
        change: impl FnOnce(Reply<T>) -> Change,
    ) -> Answer<'static, T> {
        self.ask(|reply| Command::Change(change(reply)))
    }

    fn ask<T: Send + 'static>(
        &self,
        command: impl FnOnce(Reply<T>) -> Command,
    ) -> Answer<'static, T> {
        let (reply, answer) = oneshot::channel();
        let sent = match lock(&self.0).as_ref() {
            None => Err(StoreError::Closed),
            Some(queue) => queue.try_send(command(reply)).map_err(|error| match error {
                TrySendError::Full(_) => StoreError::Busy(queue.max_capacity()),
                TrySendError::Closed(_) => StoreError::Closed,
            }),
        };
        Box::pin(async move {
            sent?;
            answer.await.map_err(|_gone| StoreError::Closed)?
        })
    }

    pub(super) fn close(&self) {
        lock(&self.0).take();
    }
}

/// Batches that share a commit, and the change that came after them.
#[derive(Default)]
pub(super) struct Group {
    pub(super) taken: Vec<Taken>,
    replies: Vec<Reply<Appended>>,
    pub(super) change: Option<Change>,
}

impl Group {
    /// `first`, and what waits after it: at most `batches_max`, up to the first change.
    pub(super) fn gather(
        first: Command,
        queue: &mut mpsc::Receiver<Command>,
        batches_max: usize,
    ) -> Self {
        let mut group = Self::default();
        let mut next = Some(first);
        while let Some(command) = next {
            match command {
                Command::Append(taken, reply) => {
                    group.taken.push(taken);
                    group.replies.push(reply);
                }
                Command::Change(change) => group.change = Some(change),
            }
            let has_room = group.change.is_none() && group.taken.len() < batches_max;
            next = has_room.then(|| queue.try_recv().ok()).flatten();
        }
        group
    }

    /// Replies to the callers of the batches. A caller may be gone; the work stays done.
    pub(super) fn answer(&mut self, outcome: Outcome) {
        // Dropped before the replies, so that each caller is again the only owner of its batch.
        self.taken.clear();
        let replies = std::mem::take(&mut self.replies);
        match outcome {
            Ok(appended) => {
                for (reply, appended) in replies.into_iter().zip(appended) {
                    let _ = reply.send(appended);
                }
            }
            Err(error) => {
                for reply in replies {
                    let _ = reply.send(Err(error.clone()));
                }
            }
        }
    }
}

/// Why the last write failed; `None` after a successful one.
#[derive(Debug, Clone, Default)]
pub(super) struct WriteFault(Arc<Mutex<Option<StoreError>>>);

impl WriteFault {
    pub(super) fn get(&self) -> Option<StoreError> {
        lock(&self.0).clone()
    }

    pub(super) fn set(&self, fault: Option<StoreError>) {
        *lock(&self.0) = fault;
    }
}
