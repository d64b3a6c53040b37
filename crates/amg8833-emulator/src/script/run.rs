//! A script under way on one bus.

use crate::fault::active::{Entry, Faults};
use crate::fault::{Chance, FaultKind, Unit, draw};
use crate::script::rules::{Lasting, Rule, Script, When};
use crate::signal::Address;
use alloc::vec::Vec;
use core::time::Duration;

/// Occurrences of a rule are drawn apart from what else it draws.
const OCCURRENCE: u64 = 1 << 41;

/// How far one rule has come.
#[derive(Debug)]
struct Progress {
    stream: u64,
    rule: Rule,
    /// The occurrence that comes next, from 0; `None` when none comes any more.
    next: Option<u64>,
    /// When the one under way ends.
    end: Option<End>,
}

#[derive(Debug, Clone, Copy)]
enum End {
    Never,
    Time(Duration),
    /// When the sensor's frames have reached this number.
    Frame(u64),
}

/// The sensors that a script breaks.
pub(crate) trait Breakable {
    /// The faults that are set on them.
    fn faults(&mut self) -> &mut Faults;

    /// How many frames the sensor at this address has measured; `None` where there is no sensor.
    fn frames(&self, address: Address) -> Option<u64>;

    /// Makes them behave as their faults say, from now on.
    fn apply_conditions(&mut self, now: Duration);

    /// Takes the power from one, or from all, for a moment.
    fn brown_out(&mut self, target: Option<Address>, now: Duration);
}

#[derive(Debug)]
pub(crate) struct Running {
    started: Duration,
    rules: Vec<Progress>,
    /// What a sensor's own count of frames lacks, or has too many, for the frames at its address since the script began.
    /// Wraps around.
    frames_more: [u64; 2],
    counts_frames: bool,
}

impl Running {
    pub(crate) fn new(script: Script, now: Duration, sensors: &mut impl Breakable) -> Self {
        let rules: Vec<Progress> = script.rules.into_iter().map(Progress::new).collect();
        sensors.faults().by_rule.clear();
        sensors.faults().by_rule.resize(rules.len(), None);
        let frames = |address| sensors.frames(address).unwrap_or(0);
        Self {
            started: now,
            counts_frames: rules.iter().any(Progress::counts_frames),
            rules,
            frames_more: Address::ALL.map(|address| frames(address).wrapping_neg()),
        }
    }

    /// Whether the frames of the sensors have to be gone through one by one.
    pub(crate) fn counts_frames(&self) -> bool {
        self.counts_frames
    }

    /// A sensor that had this many frames left its address: those of the next one count on from there.
    pub(crate) fn left(&mut self, address: Address, frames: u64) {
        let more = &mut self.frames_more[address.place()];
        *more = more.wrapping_add(frames);
    }

    /// When the next rule begins or ends, if a time says so.
    pub(crate) fn next_event(&self) -> Option<Duration> {
        let times = self.rules.iter().filter_map(Progress::next_time);
        let next = times.min()?;
        Some(self.started.saturating_add(next))
    }

    /// Ends and begins what a time says, now.
    pub(crate) fn follow(&mut self, sensors: &mut impl Breakable, now: Duration) {
        let elapsed = now.saturating_sub(self.started);
        for slot in 0..self.rules.len() {
            self.follow_rule(sensors, slot, elapsed, now);
        }
        sensors.apply_conditions(now);
    }

    /// Ends and begins what the number of a frame says.
    pub(crate) fn follow_frames(&mut self, sensors: &mut impl Breakable, now: Duration) {
        if !self.counts_frames {
            return;
        }
        let mut changed = false;
        for slot in 0..self.rules.len() {
            changed |= self.follow_rule_frames(sensors, slot, now);
        }
        if changed {
            sensors.apply_conditions(now);
        }
    }

    /// Goes on from this time, leaving out what was to be in between.
    pub(crate) fn jump(&mut self, sensors: &mut impl Breakable, now: Duration) {
        let elapsed = now.saturating_sub(self.started);
        for progress in &mut self.rules {
            progress.skip_to(elapsed);
        }
        // Every rule begins once at most, and ends.
        for _ in 0..2 {
            self.follow(sensors, now);
        }
        self.follow_frames(sensors, now);
    }

    fn follow_rule(
        &mut self,
        sensors: &mut impl Breakable,
        slot: usize,
        elapsed: Duration,
        now: Duration,
    ) {
        let frames = self.frames(sensors, slot);
        let Some(progress) = self.rules.get_mut(slot) else {
            return;
        };
        // A period that is shorter than the duration lets the next occurrence begin where the one before ends.
        if matches!(progress.end, Some(End::Time(end)) if end <= elapsed) {
            progress.end = None;
            set(sensors, slot, None);
        }
        if let Some(start) = progress.next_start().filter(|start| *start <= elapsed) {
            let begun = progress.begin(start, frames);
            begin(sensors, slot, begun, now);
        }
    }

    fn follow_rule_frames(
        &mut self,
        sensors: &mut impl Breakable,
        slot: usize,
        now: Duration,
    ) -> bool {
        let frames = self.frames(sensors, slot);
        let elapsed = now.saturating_sub(self.started);
        let Some(progress) = self.rules.get_mut(slot) else {
            return false;
        };
        let mut changed = false;
        if matches!(progress.end, Some(End::Frame(end)) if end <= frames) {
            progress.end = None;
            set(sensors, slot, None);
            changed = true;
        }
        if progress.next_frame().is_some_and(|frame| frame <= frames) {
            let begun = progress.begin(elapsed, frames);
            begin(sensors, slot, begun, now);
            changed = true;
        }
        changed
    }

    /// Frames since the script began, of the sensor that a rule goes by.
    fn frames(&self, sensors: &impl Breakable, slot: usize) -> u64 {
        let named = self
            .rules
            .get(slot)
            .and_then(|progress| progress.rule.address);
        let first = Address::ALL
            .into_iter()
            .find(|address| sensors.frames(*address).is_some());
        let Some(address) = named.or(first) else {
            return 0;
        };
        let frames = sensors.frames(address).unwrap_or(0);
        frames.wrapping_add(self.frames_more[address.place()])
    }
}

/// An occurrence that begins: what becomes active, or the moment that it is.
#[derive(Debug, Clone, Copy)]
struct Begun {
    entry: Entry,
    occurrence: u64,
}

fn begin(sensors: &mut impl Breakable, slot: usize, begun: Begun, now: Duration) {
    let mut entry = begun.entry;
    let kind = entry.fault.kind();
    if kind.unit() == Unit::Stretch {
        let drawn = draw(
            sensors.faults().seed,
            entry.stream | OCCURRENCE,
            begun.occurrence,
        );
        if !entry.chance.hits(drawn) {
            set(sensors, slot, None);
            return;
        }
        if kind == FaultKind::BrownOut {
            sensors.brown_out(entry.target, now);
            return;
        }
        entry.chance = Chance::ALWAYS;
        sensors.faults().counts.add(kind);
    }
    set(sensors, slot, Some(entry));
}

fn set(sensors: &mut impl Breakable, slot: usize, entry: Option<Entry>) {
    if let Some(place) = sensors.faults().by_rule.get_mut(slot) {
        *place = entry;
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

    /// The next time that begins or ends something here.
    fn next_time(&self) -> Option<Duration> {
        let end = match self.end {
            Some(End::Time(end)) => Some(end),
            _ => None,
        };
        match (end, self.next_start()) {
            (Some(end), Some(start)) => Some(end.min(start)),
            (end, start) => end.or(start),
        }
    }

    fn next_start(&self) -> Option<Duration> {
        self.start_of(self.next?)
    }

    fn start_of(&self, occurrence: u64) -> Option<Duration> {
        match self.rule.when {
            When::Always => Some(Duration::ZERO),
            When::At(at) => Some(at),
            When::Between { from, .. } => Some(from),
            When::Every { period, from, .. } => {
                let waited = period.as_nanos() * (u128::from(occurrence) + 1);
                let nanoseconds = u64::try_from(waited).ok()?;
                from.checked_add(Duration::from_nanos(nanoseconds))
            }
            When::Frame(_) => None,
        }
    }

    /// The number of frames at which the next occurrence begins. What spoils a frame is there before it.
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

    fn begin(&mut self, elapsed: Duration, frames: u64) -> Begun {
        let occurrence = self.next.unwrap_or_default();
        self.end = Some(self.end_of(elapsed, frames));
        self.next = match self.rule.when {
            When::Every { .. } => occurrence.checked_add(1),
            _ => None,
        };
        self.leave_out_past_the_end();
        Begun {
            occurrence,
            entry: Entry {
                fault: self.rule.fault,
                chance: self.rule.chance,
                stream: self.stream,
                target: self.rule.address,
                left: match self.rule.lasting {
                    Lasting::Times(times) => Some(times),
                    _ => None,
                },
            },
        }
    }

    fn end_of(&self, start: Duration, frames: u64) -> End {
        let stretch = match self.rule.lasting {
            Lasting::For(duration) => Some(start.saturating_add(duration)),
            Lasting::Frames(count) => return End::Frame(frames.saturating_add(count.into())),
            Lasting::ToTheEnd | Lasting::Times(_) => None,
        };
        let until = match self.rule.when {
            When::Between { until, .. } => until,
            _ => None,
        };
        match (stretch, until) {
            (Some(stretch), Some(until)) => End::Time(stretch.min(until)),
            (Some(end), None) | (None, Some(end)) => End::Time(end),
            (None, None) => End::Never,
        }
    }

    fn leave_out_past_the_end(&mut self) {
        let until = match self.rule.when {
            When::Every { until, .. } | When::Between { until, .. } => until,
            _ => None,
        };
        let start = self.next_start();
        if until.is_some_and(|until| start.is_some_and(|start| start >= until)) {
            self.next = None;
        }
    }

    /// Makes the newest occurrence up to this time the next one.
    fn skip_to(&mut self, elapsed: Duration) {
        if let (
            When::Every {
                period,
                from,
                until,
            },
            Some(next),
        ) = (self.rule.when, self.next)
        {
            let latest = until.map_or(elapsed, |until| elapsed.min(until));
            let periods = latest.saturating_sub(from).as_nanos() / period.as_nanos().max(1);
            let newest = u64::try_from(periods).unwrap_or(u64::MAX).saturating_sub(1);
            self.next = Some(next.max(newest));
            self.leave_out_past_the_end();
        }
    }
}
