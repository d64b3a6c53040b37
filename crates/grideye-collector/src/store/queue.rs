//! What a store's writer is asked for, and how the asking waits.

use crate::store::error::StoreError;
use crate::store::label::{KeptLabel, Label};
use crate::store::plan::Taken;
use crate::store::recording_id::RecordingId;
use crate::store::types::{Answer, Appended, Recording};
use std::sync::{Arc, Mutex, PoisonError};
use tokio::sync::mpsc::error::TrySendError;
use tokio::sync::{mpsc, oneshot};

/// Where an answer goes.
pub(super) type Reply<T> = oneshot::Sender<Result<T, StoreError>>;

/// What the writer is asked for.
#[derive(Debug)]
pub(super) enum Command {
    Append {
        taken: Taken,
        reply: Reply<Appended>,
    },
    Start {
        name: String,
        t_start_ns: i64,
        reply: Reply<Recording>,
    },
    Stop {
        id: RecordingId,
        t_stop_ns: i64,
        reply: Reply<Recording>,
    },
    Note {
        id: RecordingId,
        note: String,
        reply: Reply<Recording>,
    },
    AddLabel {
        id: RecordingId,
        label: Label,
        reply: Reply<KeptLabel>,
    },
    RemoveLabel {
        id: RecordingId,
        number: i64,
        reply: Reply<()>,
    },
    /// Asks for an end that all who read keep to; the number of what came before it.
    EndEpoch { reply: Reply<i64> },
    /// Asks that whoever reads finds all that was acknowledged.
    Settle { reply: Reply<()> },
}

/// The way to the writer: so many wait, and one more is refused.
#[derive(Debug)]
pub(super) struct Queue(Mutex<Option<mpsc::Sender<Command>>>);

impl Queue {
    pub(super) fn new(waiting_max: usize) -> (Self, mpsc::Receiver<Command>) {
        let (commands, queue) = mpsc::channel(waiting_max.max(1));
        (Self(Mutex::new(Some(commands))), queue)
    }

    /// Hands a command to the writer at once, and waits until it is committed.
    pub(super) fn ask<T: Send + 'static>(
        &self,
        command: impl FnOnce(Reply<T>) -> Command,
    ) -> Answer<'static, T> {
        let (reply, answer) = oneshot::channel();
        let sent = match self.lock().as_ref() {
            None => Err(StoreError::Closed),
            Some(queue) => queue.try_send(command(reply)).map_err(|error| match error {
                TrySendError::Full(_) => StoreError::Busy {
                    waiting: queue.max_capacity(),
                },
                TrySendError::Closed(_) => StoreError::Closed,
            }),
        };
        Box::pin(async move {
            sent?;
            answer.await.map_err(|_gone| StoreError::Closed)?
        })
    }

    /// Takes no more. The writer ends when it has done what it was asked.
    pub(super) fn close(&self) {
        self.lock().take();
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Option<mpsc::Sender<Command>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Why the last write failed; nothing after one that went well.
#[derive(Debug, Clone, Default)]
pub(super) struct WriteFault(Arc<Mutex<Option<StoreError>>>);

impl WriteFault {
    pub(super) fn get(&self) -> Option<StoreError> {
        self.0
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }

    pub(super) fn set(&self, fault: Option<StoreError>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = fault;
    }
}
