//! The writer: one task, one transaction at a time, which takes all waiting requests.

use crate::limits::Limits;
use crate::store::error::{Result, StoreError};
use crate::store::plan::Taken;
use crate::store::postgres::session::{Days, Session};
use crate::store::postgres::{append, boundary};
use crate::store::queue::{Change, Command, Group, Outcome, Reply, WriteFault};
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use tokio::sync::mpsc;

/// Attempts for a transaction that the database aborts because of another.
const ATTEMPTS_MAX: u32 = 8;

pub(super) struct Writer {
    limits: Limits,
    session: Session,
    /// The follower passes over what it has.
    lane: Arc<AtomicI64>,
    streams: append::Known,
    days: Days,
    fault: WriteFault,
}

impl Writer {
    pub(super) async fn new(limits: &Limits, session: Session, fault: WriteFault) -> Result<Self> {
        let lane = boundary::new_lane(&session).await?;
        Ok(Self {
            limits: limits.clone(),
            session,
            lane: Arc::new(lane.into()),
            streams: append::Known::default(),
            days: Days::default(),
            fault,
        })
    }

    pub(super) fn lane(&self) -> Arc<AtomicI64> {
        Arc::clone(&self.lane)
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
            let lane = self.lane.load(Ordering::Relaxed);
            match append::group(session, lane, taken, known, limits).await {
                Ok(appended) => return Ok(appended),
                Err(append::Undone::NoLane) if attempt < ATTEMPTS_MAX => {
                    let lane = boundary::new_lane(&self.session).await?;
                    self.lane.store(lane, Ordering::Relaxed);
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
        // Without a connection, the work fails and says why.
        let _ = self.session.revive().await;
        let (session, limits) = (&self.session, &self.limits);
        match change {
            Change::Start(name, t_ns, reply) => {
                tell(reply, boundary::start(session, &name, t_ns, limits).await);
            }
            Change::Stop(id, t_ns, reply) => tell(reply, boundary::stop(session, id, t_ns).await),
            Change::Note(id, note, reply) => tell(reply, boundary::note(session, id, &note).await),
            Change::Renew(id, reply) => tell(reply, boundary::renew(session, id).await),
            Change::Delete(id, reply) => tell(reply, boundary::delete(session, id).await),
            Change::AddLabel(id, label, reply) => {
                tell(reply, boundary::add_label(session, id, label, limits).await);
            }
            Change::RemoveLabel(id, number, reply) => {
                tell(reply, boundary::remove_label(session, id, number).await);
            }
            Change::AskForTokens(is_asking, reply) => {
                tell(reply, boundary::ask_for_tokens(session, is_asking).await);
            }
            Change::EndEpoch(reply) => tell(reply, boundary::end_epoch(session).await),
            // This writer settles with every commit, whether or not the database is reachable.
            Change::Settle(reply) => tell(reply, Ok(())),
        }
    }
}

/// The caller may be gone; the work stays done.
fn tell<T>(reply: Reply<T>, done: Result<T>) {
    let _ = reply.send(done);
}
