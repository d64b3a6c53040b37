//! The writer: one task, one transaction at a time, which takes all waiting requests.

use crate::limits::Limits;
use crate::store::error::{Result, StoreError};
use crate::store::plan::Taken;
use crate::store::postgres::session::{Days, Session};
use crate::store::postgres::{append, boundary};
use crate::store::queue::{Change, Command, Group, Outcome, Reply, WriteFault};
use tokio::sync::{mpsc, watch};

/// Attempts for a transaction that the database aborts because of another.
const ATTEMPTS_MAX: u32 = 8;

pub(super) struct Writer {
    limits: Limits,
    session: Session,
    lane: i64,
    streams: append::Known,
    days: Days,
    fault: WriteFault,
    /// The lane and its count at the last commit, for the task that notifies the other collectors.
    committed: watch::Sender<(i64, i64)>,
}

impl Writer {
    pub(super) async fn new(limits: &Limits, session: Session, fault: WriteFault) -> Result<Self> {
        let lane = boundary::new_lane(&session).await?;
        Ok(Self {
            limits: limits.clone(),
            session,
            lane,
            streams: append::Known::default(),
            days: Days::default(),
            fault,
            committed: watch::Sender::new((lane, 0)),
        })
    }

    pub(super) fn committed(&self) -> watch::Receiver<(i64, i64)> {
        self.committed.subscribe()
    }

    pub(super) async fn run(mut self, mut queue: mpsc::Receiver<Command>) {
        while let Some(first) = queue.recv().await {
            let mut group = Group::gather(first, &mut queue, self.limits.commit_group_max);
            if !group.taken.is_empty() {
                let outcome = self.commit(&group.taken).await;
                self.fault.set(outcome.as_ref().err().cloned());
                group.answer(outcome);
            }
            if let Some(change) = group.change {
                self.change(change).await;
                let committed = *self.committed.borrow();
                self.committed.send_replace(committed);
            }
        }
    }

    async fn commit(&mut self, taken: &[Taken]) -> Outcome {
        let newest_ns = taken.iter().map(|taken| taken.t_arrival_ns).max();
        let newest_ns = newest_ns.unwrap_or(0);
        let mut attempt = 1;
        loop {
            self.session.revive().await?;
            self.days.prepare(&self.session, newest_ns).await;
            let (session, known, limits) = (&self.session, &mut self.streams, &self.limits);
            match append::group(session, self.lane, taken, known, limits).await {
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

    async fn change(&mut self, change: Change) {
        let revived = self.session.revive().await;
        let (session, limits) = (&self.session, &self.limits);
        match change {
            Change::Start(name, t_start_ns, reply) => {
                let start = boundary::start(session, &name, t_start_ns, limits);
                answer(reply, revived, start).await;
            }
            Change::Stop(id, t_stop_ns, reply) => {
                answer(reply, revived, boundary::stop(session, id, t_stop_ns)).await;
            }
            Change::Note(id, note, reply) => {
                answer(reply, revived, boundary::note(session, id, &note)).await;
            }
            Change::Renew(id, reply) => {
                answer(reply, revived, boundary::renew(session, id)).await;
            }
            Change::Delete(id, reply) => {
                answer(reply, revived, boundary::delete(session, id)).await;
            }
            Change::AddLabel(id, label, reply) => {
                let add = boundary::add_label(session, id, label, limits);
                answer(reply, revived, add).await;
            }
            Change::RemoveLabel(id, number, reply) => {
                answer(reply, revived, boundary::remove_label(session, id, number)).await;
            }
            Change::AskForTokens(is_asking, reply) => {
                answer(reply, revived, boundary::ask_for_tokens(session, is_asking)).await;
            }
            Change::EndEpoch(reply) => {
                answer(reply, revived, boundary::end_epoch(session)).await;
            }
            // This writer settles with every commit, whether or not the database is reachable.
            Change::Settle(reply) => answer(reply, Ok(()), async { Ok(()) }).await,
        }
    }
}

/// Replies with the result of the work if connected. The caller may be gone; the work stays done.
async fn answer<T>(reply: Reply<T>, revived: Result<()>, work: impl Future<Output = Result<T>>) {
    let done = match revived {
        Ok(()) => work.await,
        Err(error) => Err(error),
    };
    let _ = reply.send(done);
}
