//! The writer: one task, one transaction at a time, as many requests in it as are waiting.

use crate::limits::Limits;
use crate::store::error::StoreError;
use crate::store::location::PostgresUrl;
use crate::store::plan::Taken;
use crate::store::postgres::schema::Days;
use crate::store::postgres::session::Session;
use crate::store::postgres::{append, boundary, labels};
use crate::store::queue::{Command, Reply, WriteFault};
use crate::store::types::Appended;
use tokio::sync::{mpsc, watch};

/// Transactions that the database broke off for the sake of another one are tried so often.
const ATTEMPTS_MAX: u32 = 8;

/// The task's own state.
pub(super) struct Writer {
    url: PostgresUrl,
    limits: Limits,
    session: Session,
    lane: i64,
    streams: append::Known,
    days: Days,
    fault: WriteFault,
    /// The lane and its count at the last commit, for the one who tells the other collectors.
    committed: watch::Sender<(i64, i64)>,
}

impl Writer {
    pub(super) async fn new(
        url: &PostgresUrl,
        limits: &Limits,
        session: Session,
        fault: WriteFault,
    ) -> Result<Self, StoreError> {
        let lane = boundary::new_lane(&session).await?;
        Ok(Self {
            url: url.clone(),
            limits: limits.clone(),
            session,
            lane,
            streams: append::Known::default(),
            days: Days::default(),
            fault,
            committed: watch::Sender::new((lane, 0)),
        })
    }

    /// Lane and count of the last commit.
    pub(super) fn committed(&self) -> watch::Receiver<(i64, i64)> {
        self.committed.subscribe()
    }

    /// Serves until every sender is gone and the queue is empty.
    pub(super) async fn run(mut self, mut queue: mpsc::Receiver<Command>) {
        let mut left_over = None;
        loop {
            let first = match left_over.take() {
                Some(command) => command,
                None => match queue.recv().await {
                    Some(command) => command,
                    None => break,
                },
            };
            let mut group = Vec::new();
            let mut next = Some(first);
            while let Some(command) = next.take() {
                match command {
                    Command::Append { taken, reply } => group.push((taken, reply)),
                    other => left_over = Some(other),
                }
                if left_over.is_none() && group.len() < self.limits.commit_group_max {
                    next = queue.try_recv().ok();
                }
            }
            if !group.is_empty() {
                self.append(group).await;
            }
            if let Some(command) = left_over.take() {
                self.set_boundary(command).await;
            }
        }
    }

    /// One transaction and one sync for the whole group; answers only after it.
    async fn append(&mut self, group: Vec<(Taken, Reply<Appended>)>) {
        let (taken, replies): (Vec<Taken>, Vec<_>) = group.into_iter().unzip();
        let outcome = self.commit(&taken).await;
        self.fault.set(outcome.as_ref().err().cloned());
        match outcome {
            Ok(appended) => {
                for (reply, appended) in replies.into_iter().zip(appended) {
                    // The one who asked may have gone; the work stays done.
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

    async fn commit(
        &mut self,
        taken: &[Taken],
    ) -> Result<Vec<Result<Appended, StoreError>>, StoreError> {
        let newest_ns = taken.iter().map(|taken| taken.t_arrival_ns).max();
        let mut attempt = 1;
        loop {
            self.connect().await?;
            self.days
                .prepare(&self.session, newest_ns.unwrap_or(0))
                .await;
            let done = append::group(
                &self.session,
                self.lane,
                taken,
                &mut self.streams,
                &self.limits,
            )
            .await;
            match done {
                Ok(done) => {
                    self.committed.send_replace((self.lane, done.n));
                    return Ok(done.appended);
                }
                Err(append::Undone::NoLane) if attempt < ATTEMPTS_MAX => {
                    self.lane = boundary::new_lane(&self.session).await?;
                }
                Err(append::Undone::Error(StoreError::Contended { .. }))
                    if attempt < ATTEMPTS_MAX => {}
                Err(append::Undone::NoLane) => {
                    return Err(StoreError::Failed("the lane is gone".to_owned()));
                }
                Err(append::Undone::Error(error)) => return Err(error),
            }
            attempt += 1;
        }
    }

    async fn set_boundary(&mut self, command: Command) {
        let ready = self.connect().await;
        let (session, limits) = (&self.session, &self.limits);
        match (command, ready) {
            (
                Command::Start {
                    name,
                    t_start_ns,
                    reply,
                },
                Ok(()),
            ) => {
                let _ = reply.send(boundary::start(session, &name, t_start_ns, limits).await);
            }
            (
                Command::Stop {
                    id,
                    t_stop_ns,
                    reply,
                },
                Ok(()),
            ) => {
                let _ = reply.send(boundary::stop(session, id, t_stop_ns).await);
            }
            (Command::Note { id, note, reply }, Ok(())) => {
                let _ = reply.send(boundary::note(session, id, &note).await);
            }
            (Command::AddLabel { id, label, reply }, Ok(())) => {
                let _ = reply.send(labels::add(session, id, label, limits).await);
            }
            (Command::RemoveLabel { id, number, reply }, Ok(())) => {
                let _ = reply.send(labels::remove(session, id, number).await);
            }
            (Command::EndEpoch { reply }, Ok(())) => {
                let _ = reply.send(boundary::end_epoch(session).await);
            }
            (
                Command::Start { reply, .. }
                | Command::Stop { reply, .. }
                | Command::Note { reply, .. },
                Err(error),
            ) => {
                let _ = reply.send(Err(error));
            }
            (Command::AddLabel { reply, .. }, Err(error)) => {
                let _ = reply.send(Err(error));
            }
            (Command::RemoveLabel { reply, .. }, Err(error)) => {
                let _ = reply.send(Err(error));
            }
            (Command::EndEpoch { reply }, Err(error)) => {
                let _ = reply.send(Err(error));
            }
            // Every commit is settled here.
            (Command::Settle { reply }, _) => {
                let _ = reply.send(Ok(()));
            }
            // Appends are taken in groups, and never come here.
            (Command::Append { reply, .. }, _) => {
                let _ = reply.send(Err(StoreError::Closed));
            }
        }
        let (lane, n) = *self.committed.borrow();
        self.committed.send_replace((lane, n));
    }

    /// Makes the connection again if it is gone, for example after a restart of the database.
    async fn connect(&mut self) -> Result<(), StoreError> {
        if self.session.is_closed() {
            self.session = Session::open(&self.url, &self.limits).await?;
        }
        Ok(())
    }
}
