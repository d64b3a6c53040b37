//! A running script on one bus.

use crate::fault::active::{Entry, Faults};
use crate::fault::{Chance, FaultKind, Unit, draw};
use crate::script::rules::{Lasting, Rule, Script, When};
use crate::signal::Address;
use alloc::vec::Vec;
use core::time::Duration;

/// Draws for a rule's occurrences are independent of its other draws.
const OCCURRENCE: u64 = 1 << 41;

#[derive(Debug)]
struct Progress {
    stream: u64,
    rule: Rule,
    /// The next occurrence, from 0; `None` if there is none left.
    next: Option<u64>,
    /// When the current occurrence ends, if it does.
    end: Option<End>,
}

#[derive(Debug, Clone, Copy)]
enum End {
    Time(Duration),
    /// When the sensor's frames reach this number.
    Frame(u64),
}

/// A script's changes to the sensors, besides their faults.
#[derive(Debug, Default)]
pub(crate) struct Changes {
    /// Whether lasting faults may have begun or ended.
    pub(crate) any: bool,
    /// Sensors that lose power for a moment; `None` for all.
    pub(crate) brown_outs: Vec<Option<Address>>,
}

/// The frames that the sensor at each address has measured; `None` where there is no sensor.
type Frames = [Option<u64>; 2];

#[derive(Debug)]
pub(crate) struct Running {
    started: Duration,
    rules: Vec<Progress>,
    /// Added to a sensor's own count, this gives the frames at its address since the script began; wraps around.
    frames_more: [u64; 2],
    /// Whether frames must be handled one by one.
    pub(crate) counts_frames: bool,
}

impl Running {
    pub(crate) fn new(script: Script, faults: &mut Faults, frames: Frames, now: Duration) -> Self {
        let rules: Vec<Progress> = script.rules.into_iter().map(Progress::new).collect();
        faults.by_rule.clear();
        faults.by_rule.resize(rules.len(), None);
        Self {
            started: now,
            counts_frames: rules.iter().any(Progress::counts_frames),
            rules,
            frames_more: frames.map(|frames| frames.unwrap_or(0).wrapping_neg()),
        }
    }

    /// A sensor with this many frames left its address: the next one continues its count.
    pub(crate) fn left(&mut self, address: Address, frames: u64) {
        let more = &mut self.frames_more[address.place()];
        *more = more.wrapping_add(frames);
    }

    pub(crate) fn next_event(&self) -> Option<Duration> {
        let times = self.rules.iter().filter_map(Progress::next_time);
        let next = times.min()?;
        Some(self.started.saturating_add(next))
    }

    /// Ends and begins what is due by time.
    pub(crate) fn follow(&mut self, faults: &mut Faults, frames: Frames, now: Duration) -> Changes {
        let elapsed = now.saturating_sub(self.started);
        // With a period shorter than the duration, the next occurrence begins where the previous one ends.
        let ends = |end, _| matches!(end, End::Time(end) if end <= elapsed);
        let start = |rule: &Progress, _| rule.next_start().filter(|start| *start <= elapsed);
        self.follow_each(faults, frames, ends, start)
    }

    /// Ends and begins what is due by frame number.
    pub(crate) fn follow_frames(
        &mut self,
        faults: &mut Faults,
        frames: Frames,
        now: Duration,
    ) -> Changes {
        let elapsed = now.saturating_sub(self.started);
        let ends = |end, frames| matches!(end, End::Frame(end) if end <= frames);
        let start = |rule: &Progress, frames| {
            let due = rule.next_frame().is_some_and(|frame| frame <= frames);
            due.then_some(elapsed)
        };
        self.follow_each(faults, frames, ends, start)
    }

    /// Continues from this time, skipping what was due before.
    pub(crate) fn jump(&mut self, faults: &mut Faults, frames: Frames, now: Duration) -> Changes {
        let elapsed = now.saturating_sub(self.started);
        for progress in &mut self.rules {
            progress.skip_to(elapsed);
        }
        // Every rule begins at most once, and ends.
        let mut changes = self.follow(faults, frames, now);
        for go_on in [Self::follow, Self::follow_frames] {
            let more = go_on(self, faults, frames, now);
            changes.any |= more.any;
            changes.brown_outs.extend(more.brown_outs);
        }
        changes
    }

    fn follow_each(
        &mut self,
        faults: &mut Faults,
        frames: Frames,
        ends: impl Fn(End, u64) -> bool,
        start: impl Fn(&Progress, u64) -> Option<Duration>,
    ) -> Changes {
        let mut changes = Changes::default();
        let first = Address::ALL
            .into_iter()
            .find(|at| frames[at.place()].is_some());
        for (progress, slot) in self.rules.iter_mut().zip(&mut faults.by_rule) {
            let address = progress.rule.address.or(first);
            let frames = address.map_or(0, |at| {
                let more = self.frames_more[at.place()];
                frames[at.place()].unwrap_or(0).wrapping_add(more)
            });
            if progress.end.is_some_and(|end| ends(end, frames)) {
                progress.end = None;
                *slot = None;
                changes.any = true;
            }
            let Some(start) = start(progress, frames) else {
                continue;
            };
            changes.any = true;
            let (occurrence, mut entry) = progress.begin(start, frames);
            let kind = entry.fault.kind();
            let mut strikes = true;
            if kind.unit() == Unit::Stretch {
                let drawn = draw(faults.seed, entry.stream | OCCURRENCE, occurrence);
                strikes = entry.chance.hits(drawn);
                entry.chance = Chance::ALWAYS;
                if strikes && kind == FaultKind::BrownOut {
                    changes.brown_outs.push(entry.target);
                    strikes = false;
                } else if strikes {
                    faults.counts.add(kind);
                }
            }
            *slot = strikes.then_some(entry);
        }
        changes
    }
}

impl Progress {
    fn new((stream, rule): (u64, Rule)) -> Self {
        let mut progress = Self {
            stream,
            rule,
            next: Some(0),
            end: None,
        };
        progress.leave_out_past_the_end();
        progress
    }

    fn counts_frames(&self) -> bool {
        matches!(self.rule.when, When::Frame(_)) || matches!(self.rule.lasting, Lasting::Frames(_))
    }

    /// The next time at which this rule begins or ends.
    fn next_time(&self) -> Option<Duration> {
        let end = match self.end {
            Some(End::Time(end)) => Some(end),
            _ => None,
        };
        end.into_iter().chain(self.next_start()).min()
    }

    fn next_start(&self) -> Option<Duration> {
        let next = self.next?;
        match self.rule.when {
            When::Always => Some(Duration::ZERO),
            When::At(at) => Some(at),
            When::Between { from, .. } => Some(from),
            When::Every { period, from, .. } => {
                let waited = period.as_nanos() * (u128::from(next) + 1);
                let nanoseconds = u64::try_from(waited).ok()?;
                from.checked_add(Duration::from_nanos(nanoseconds))
            }
            When::Frame(_) => None,
        }
    }

    /// The frame count at which the next occurrence begins; a fault of a frame begins one frame earlier.
    fn next_frame(&self) -> Option<u64> {
        self.next?;
        match self.rule.when {
            When::Frame(number) if self.rule.fault.kind().unit() == Unit::Frame => {
                Some(number.saturating_sub(1))
            }
            When::Frame(number) => Some(number),
            _ => None,
        }
    }

    /// Begins the next occurrence; returns its number and fault.
    fn begin(&mut self, elapsed: Duration, frames: u64) -> (u64, Entry) {
        let occurrence = self.next.unwrap_or_default();
        self.end = self.end_of(elapsed, frames);
        self.next = match self.rule.when {
            When::Every { .. } => occurrence.checked_add(1),
            _ => None,
        };
        self.leave_out_past_the_end();
        let entry = Entry {
            fault: self.rule.fault,
            chance: self.rule.chance,
            stream: self.stream,
            target: self.rule.address,
            left: match self.rule.lasting {
                Lasting::Times(times) => Some(times),
                _ => None,
            },
        };
        (occurrence, entry)
    }

    fn end_of(&self, start: Duration, frames: u64) -> Option<End> {
        let stretch = match self.rule.lasting {
            Lasting::For(duration) => Some(start.saturating_add(duration)),
            Lasting::Frames(count) => {
                return Some(End::Frame(frames.saturating_add(count.into())));
            }
            Lasting::ToTheEnd | Lasting::Times(_) => None,
        };
        let until = match self.rule.when {
            When::Between { until, .. } => until,
            _ => None,
        };
        let end = stretch.into_iter().chain(until).min();
        end.map(End::Time)
    }

    fn leave_out_past_the_end(&mut self) {
        let until = match self.rule.when {
            When::Every { until, .. } | When::Between { until, .. } => until,
            _ => None,
        };
        if until.is_some_and(|until| self.next_start() >= Some(until)) {
            self.next = None;
        }
    }

    /// Makes the newest occurrence up to this time the next one.
    fn skip_to(&mut self, elapsed: Duration) {
        let (
            When::Every {
                period,
                from,
                until,
            },
            Some(next),
        ) = (self.rule.when, self.next)
        else {
            return;
        };
        let latest = until.map_or(elapsed, |until| elapsed.min(until));
        let periods = latest.saturating_sub(from).as_nanos() / period.as_nanos().max(1);
        let newest = u64::try_from(periods).unwrap_or(u64::MAX).saturating_sub(1);
        self.next = Some(next.max(newest));
        self.leave_out_past_the_end();
    }
}
