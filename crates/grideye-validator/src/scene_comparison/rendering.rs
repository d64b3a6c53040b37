//! Renders the simulated side, and learns the empty room from the real side.

use crate::align::space::moved;
use crate::align::{OFFSET_MAX_PX, SAMPLE_MAX};
use crate::background::fit::BackgroundFit;
use crate::background::once::Shared;
use crate::background::{Empty, Stretch, background};
use crate::frames::timeline::Timeline;
use crate::frames::types::Pixels;
use crate::frames::{Protocol, RealFrame, RoomSource, SimulatedFrame};
use crate::metrics::room_difference::RoomDifference;
use crate::numbers::{count, evenly, mean_frame, median};
use crate::scene_comparison::types::{
    AlignedFrames, KnownUnit, LearnedRoom, Options, TimedFrame, pixels,
};
use crate::thresholds::Thresholds;
use crate::verdict::types::KnownPattern;
use grideye_frame::PIXELS;
use grideye_recording::Record;
use grideye_scene::{Film, Scene};
use std::time::Duration;

pub(crate) struct Renderer<'a> {
    film: &'a Film,
    empty: &'a Film,
    /// What is known of the unit and its room as the scene lies, less what the scene has too.
    pub(crate) unit: Option<KnownUnit>,
    /// Pixels of which the room is not known.
    pub(crate) open: [bool; PIXELS],
    /// What the scene has too, a warning each.
    pub(crate) shared: Vec<String>,
    /// The unit's pattern, added to the scene.
    pattern_c: Option<[f64; PIXELS]>,
    /// Whether the profile has the background of its room.
    has_background: bool,
}

impl<'a> Renderer<'a> {
    pub(crate) fn new(
        scene: &Scene,
        [film, empty]: [&'a Film; 2],
        aligned: &AlignedFrames,
        options: &Options,
    ) -> Self {
        let room_c = empty.image(aligned.timeline.start()).celsius;
        let back = aligned.found.turned().inverse();
        let unit = options.unit.map(|unit| KnownUnit {
            pattern_c: back.apply(&unit.pattern_c),
            ..unit
        });
        let mut renderer = Self {
            film,
            empty,
            open: [false; PIXELS],
            shared: Vec::new(),
            pattern_c: unit.map(|unit| unit.pattern_c),
            has_background: unit.is_some_and(|unit| unit.has_background),
            unit,
        };
        renderer.count_once(&room_c, !scene.agents().is_empty());
        renderer
    }

    /// Takes what the scene's empty room shows off a background that shows it too. Where nobody is claimed the objects are what is
    /// compared: of them the background must not be the measure.
    fn count_once(&mut self, room_c: &[f64], has_people: bool) {
        let Some(unit) = self.unit.as_mut().filter(|unit| unit.has_background) else {
            return;
        };
        let measured_c = unit.pattern_c;
        let level_c = median(&measured_c).unwrap_or_default();
        for one in Shared::of(&measured_c, room_c) {
            for (pixel, celsius) in one.celsius.into_iter().enumerate() {
                if celsius != 0.0 && has_people {
                    unit.pattern_c[pixel] = measured_c[pixel] - celsius;
                } else if celsius != 0.0 {
                    unit.pattern_c[pixel] = level_c;
                    self.open[pixel] = true;
                }
            }
            self.shared.push(one.warning(has_people));
        }
        self.pattern_c = Some(unit.pattern_c);
    }

    /// The scene at the times of the real frames.
    pub(crate) fn simulated(
        &self,
        real: &[RealFrame],
        aligned: &AlignedFrames,
        seed: u64,
    ) -> Vec<SimulatedFrame> {
        let frames = real.iter();
        let frames = frames.map(|real| self.frame(aligned.scene_time(real.time), aligned, seed));
        frames.collect()
    }

    /// The empty room that the recording shows while the scene is empty too; with a profile that has a background, how
    /// well the profile explains it.
    pub(crate) fn learned_room(
        &self,
        records: &[Record],
        aligned: &AlignedFrames,
        protocol: Protocol,
    ) -> (Option<LearnedRoom>, Option<BackgroundFit>) {
        let (frames, stretches) = self.empty_frames(records, aligned, protocol);
        if frames.len() < EMPTY_FRAMES_MIN {
            return (None, None);
        }
        let room = Some(LearnedRoom::of(&frames));
        if !self.has_background {
            return (room, None);
        }
        let (first, second) = frames.split_at(frames.len() / 2);
        let expected = self.shown(&self.empty.image(aligned.timeline.start()).celsius, aligned);
        let [first, second] = [first, second].map(LearnedRoom::of);
        (
            room,
            Some(BackgroundFit::new(
                [&first.celsius, &second.celsius],
                &expected,
                stretches,
            )),
        )
    }

    /// The frames in which recording and scene are both empty; none under the static protocol.
    fn empty_frames<'b>(
        &self,
        records: &[Record],
        aligned: &'b AlignedFrames,
        protocol: Protocol,
    ) -> (Vec<&'b TimedFrame>, Vec<Stretch>) {
        if protocol == Protocol::Static {
            return Default::default();
        }
        let stretches = background(records, &Empty::Find)
            .map(|found| found.stretches)
            .unwrap_or_default();
        let is_empty = |frame: &&TimedFrame| {
            let since = aligned.timeline.since_first(frame.time);
            stretches.iter().any(|stretch| stretch.holds(since))
                && self.is_empty(aligned.scene_time(frame.time))
        };
        let frames = evenly(aligned.frames.len(), SAMPLE_MAX)
            .into_iter()
            .map(|index| &aligned.frames[index])
            .filter(is_empty)
            .collect();
        (frames, stretches)
    }

    /// The profile's background unless the recording contradicts it, else what the recording shows of the empty room,
    /// else the unit's pattern alone. The learned room is returned if the profile's is not used.
    pub(crate) fn known(
        &mut self,
        learned: Option<LearnedRoom>,
        fit: Option<&BackgroundFit>,
        timeline: &Timeline,
        options: &Options,
    ) -> (KnownPattern, Option<LearnedRoom>) {
        let is_trusted = self.has_background && !fit.is_some_and(BackgroundFit::is_worse);
        let learned = learned.filter(|_| !is_trusted);
        let own = learned
            .as_ref()
            .and_then(|room| self.learn(room, timeline, &options.thresholds));
        match (own, options.unit) {
            (Some(own), _) => (own, learned),
            (None, Some(unit)) => (unit.pattern(&options.thresholds), None),
            (None, None) => (KnownPattern::default(), learned),
        }
    }

    /// Takes learned less simulated room as the pattern where nothing warm is claimed; `None` if more is warm.
    fn learn(
        &mut self,
        learned: &LearnedRoom,
        timeline: &Timeline,
        thresholds: &Thresholds,
    ) -> Option<KnownPattern> {
        let nobody = self.empty.image(timeline.start()).celsius;
        let ambient_c = self.film.simulator().ambient_c();
        let map = RoomDifference::new(&learned.celsius, &nobody, ambient_c);
        if map.beyond_pattern(thresholds.pattern_spread_c).is_some() {
            return None;
        }
        let cold = |pixel: usize, known: f64, unknown: f64| match map.cold[pixel] {
            true => known,
            false => unknown,
        };
        let added_c = std::array::from_fn(|pixel| cold(pixel, map.left_c[pixel], 0.0));
        self.pattern_c = Some(added_c);
        let spread_c = thresholds.pattern_spread_c;
        let left = (0..PIXELS).map(|pixel| cold(pixel, learned.error_c, spread_c));
        Some(KnownPattern {
            from: RoomSource::Recording,
            left_c: Some(left.collect()),
        })
    }

    fn is_empty(&self, time: Duration) -> bool {
        let (with, without) = (self.film.image(time), self.empty.image(time));
        is_same(&with.celsius, &without.celsius)
    }

    fn frame(&self, time: Duration, aligned: &AlignedFrames, seed: u64) -> SimulatedFrame {
        let (clean, noisy) = (self.film.image(time), self.film.noisy(time, seed));
        let noise_free = self.shown(&clean.celsius, aligned);
        let noise = |pixel: usize| noisy.celsius[pixel] - clean.celsius[pixel];
        SimulatedFrame {
            time,
            celsius: std::array::from_fn(|pixel| noise_free[pixel] + noise(pixel)),
            noise_free,
        }
    }

    /// An image moved by the applied offset, plus the unit's pattern, which does not move.
    fn shown(&self, clean: &[f64], aligned: &AlignedFrames) -> Pixels {
        let offset = aligned.found.offset.filter(|offset| offset.applied);
        let mut shown = pixels(clean);
        if let Some(offset) = offset {
            let within = |px: f64| px.clamp(-OFFSET_MAX_PX, OFFSET_MAX_PX);
            let [right, down] = offset.right_down_px.map(within);
            shown = moved(&shown, right, down);
        }
        for (shown, pattern) in shown.iter_mut().zip(self.pattern_c.iter().flatten()) {
            *shown += pattern;
        }
        shown
    }
}

impl LearnedRoom {
    fn of(frames: &[&TimedFrame]) -> Self {
        let number = count(frames.len());
        let celsius = mean_frame(frames.iter().map(|frame| &frame.celsius));
        let error = |pixel: usize| {
            let left = |frame: &&TimedFrame| (frame.celsius[pixel] - celsius[pixel]).powi(2);
            let squares: f64 = frames.iter().map(left).sum();
            squares.sqrt() / number
        };
        let errors: Vec<f64> = (0..PIXELS).map(error).collect();
        Self {
            error_c: median(&errors).unwrap_or_default(),
            frames: frames.len(),
            celsius,
        }
    }
}

fn is_same(with: &[f64], without: &[f64]) -> bool {
    let mut pixels = with.iter().zip(without);
    pixels.all(|(with, without)| (with - without).abs() < NOBODY_C)
}

/// A smaller effect than this counts as nobody, °C: a fifth of the sensor's step.
const NOBODY_C: f64 = 0.05;
/// Fewest empty frames for learning the room: the noise of their mean is then a quarter of a frame's.
const EMPTY_FRAMES_MIN: usize = 16;
