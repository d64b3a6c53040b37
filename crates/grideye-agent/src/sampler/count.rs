//! One row for each frame of the sensor: the frames that were read, and the reasons for those that were not.

use super::event::{COUNT_ESTIMATED, Event, GAP_NOT_LISTED, GLITCH_PIXEL, THERMISTOR_LATE};
use super::limits::{FROZEN_FRAMES, ROWS_PER_GAP_MAX, SET_UP_PAUSE, SETTINGS_EVERY};
use super::machine::{Sampler, State};
use super::phase::Ns;
use super::read::{Read, Seen};
use crate::clock::{duration, signed_ns};
use grideye_frame::{NoData, Reading};
use std::time::Duration;

impl Sampler {
    pub(super) fn record(&mut self, seq: u64, read: &Read) {
        if self.state == State::Done {
            return;
        }
        self.unmoved = None;
        self.prove_thermistor(seq);
        let next = self.phase.as_ref().map(|phase| phase.window(seq + 1));
        self.thermistor_unproved = next.map(|next| (seq, read.after, next.after));
        let is_equal = self.recorded == Some(read.content);
        self.repeats = if is_equal {
            self.repeats.saturating_add(1)
        } else {
            0
        };
        self.recorded = Some(read.content);
        self.last = Some(Seen::by(read, Some(seq)));
        self.next_seq = seq + 1;
        self.faults_in_a_row = 0;
        self.set_up_pause = signed_ns(SET_UP_PAUSE);
        self.excuse = None;
        let at = duration(read.before);
        if self.repeats >= FROZEN_FRAMES {
            return self.frozen(seq, at, read.after);
        }
        self.frames_read += 1;
        if read.content.has_glitch() {
            self.events.push_back(Event::Fault(GLITCH_PIXEL));
        }
        self.events.push_back(Event::Record {
            seq,
            at,
            reading: Reading::Frame(read.frame),
        });
        if self.frames_limit == Some(self.frames_read) {
            self.prove_thermistor(seq);
            self.state = State::Done;
            return;
        }
        if read.after - self.settings_checked >= signed_ns(SETTINGS_EVERY) {
            self.settings_due = Some(read.after);
        }
        self.plan(read.after);
    }

    /// Whether the frame before was read to its end before the update that followed it, of which more is known with
    /// each frame.
    pub(super) fn prove_thermistor(&mut self, seq: u64) {
        let Some((before, read_until, predicted)) = self.thermistor_unproved.take() else {
            return;
        };
        let known = match &self.phase {
            Some(phase) if seq == before + 1 && phase.is_at(seq) => phase.window(seq).after,
            _ => predicted,
        };
        if read_until > known.max(predicted) {
            self.events.push_back(Event::Fault(THERMISTOR_LATE));
        }
    }

    /// The sensor measures no more; a set-up is all that can be tried, and not more often than this is noticed.
    pub(super) fn frozen(&mut self, seq: u64, at: Duration, now: Ns) {
        let reading = Reading::NoData(NoData::Frozen);
        self.events.push_back(Event::Record { seq, at, reading });
        if self.repeats % FROZEN_FRAMES == 0 {
            self.events.push_back(Event::Fault(NoData::Frozen.name()));
            self.excuse = Some(NoData::Frozen);
            self.state = State::SetUp;
            self.next_at = now;
        } else {
            self.plan(now);
        }
    }

    pub(super) fn estimated(&mut self) {
        if !std::mem::replace(&mut self.is_estimated, true) {
            self.events.push_back(Event::Fault(COUNT_ESTIMATED));
        }
    }

    pub(super) fn fault(&mut self, now: Ns, reason: NoData) {
        self.events.push_back(Event::Fault(reason.name()));
        self.excuse = Some(reason);
        self.reckon(now);
    }

    /// Registers that all read zero are no settings: what is wrong was seen before they were asked for.
    pub(super) fn wrong_configuration(&mut self, now: Ns) {
        if self.excuse != Some(NoData::AllZero) {
            self.excuse = Some(NoData::WrongConfiguration);
        }
        let kind = NoData::WrongConfiguration.name();
        self.events.push_back(Event::Fault(kind));
        self.reckon(now);
    }

    /// Lists the frames that surely have been replaced by now and were not read.
    pub(super) fn reckon(&mut self, now: Ns) {
        if self.phase.is_some() {
            self.listed_until = now;
            self.miss_until(self.surely_passed(now), now);
        }
    }

    /// The latest frame whose update has surely passed, or the next one if none has.
    pub(super) fn surely_passed(&self, now: Ns) -> u64 {
        let mut seq = self.next_seq;
        if let Some(phase) = &self.phase {
            while phase.window(seq + 1).until <= now {
                seq += 1;
            }
        }
        seq
    }

    /// Lists every frame before `seq` that was not read.
    pub(super) fn miss_until(&mut self, seq: u64, now: Ns) {
        if let Some(read) = self.unmoved.take().filter(|_| self.next_seq < seq) {
            self.record(self.next_seq, &read);
        }
        if self.state == State::Done {
            return;
        }
        let reason = self.excuse.unwrap_or(NoData::HostStalled);
        let listed_from = seq.saturating_sub(ROWS_PER_GAP_MAX);
        if listed_from > self.next_seq {
            self.events.push_back(Event::Fault(GAP_NOT_LISTED));
            self.next_seq = listed_from;
        }
        while self.next_seq < seq {
            let at = duration(now);
            let reading = Reading::NoData(reason);
            self.events.push_back(Event::Record {
                seq: self.next_seq,
                at,
                reading,
            });
            self.next_seq += 1;
        }
    }
}
