//! What an emulated sensor sees: a scene, a recording or a constant, as a function of the world's time, which all
//! sensors of a machine share.

use crate::clock::nanoseconds;
use amg8833_emulator::FrameSource;
use grideye_frame::{Celsius, Frame, TICK};
use grideye_scene::Simulator;
use grideye_scene::profile::Profile;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

/// The world has not begun.
const NOT_BEGUN: u64 = u64::MAX;

/// When a recording's frames are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Replay {
    /// At the times at which they were recorded.
    Times,
    /// One per sensor frame: none twice, none skipped.
    Frames,
}

/// What follows the end of a walk or a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AtEnd {
    /// The last frame stays.
    Hold,
    /// It starts again.
    Loop,
    /// The bus disappears (ENODEV), and a server ends.
    End,
}

/// The time shared by all sensors: it stands at zero until the first transfer on any bus.
#[derive(Debug)]
pub struct World {
    begun_ns: AtomicU64,
}

impl World {
    /// A world that waits for the first transfer.
    #[must_use]
    pub fn new() -> Arc<Self> {
        Arc::new(Self {
            begun_ns: AtomicU64::new(NOT_BEGUN),
        })
    }

    /// Begins now; `false` if it began before.
    pub(crate) fn begin(&self, now: Duration) -> bool {
        let (now, order) = (nanoseconds(now).min(NOT_BEGUN - 1), Ordering::SeqCst);
        let begun = &self.begun_ns;
        begun.compare_exchange(NOT_BEGUN, now, order, order).is_ok()
    }

    pub(crate) fn has_begun(&self) -> bool {
        self.begun_ns.load(Ordering::SeqCst) != NOT_BEGUN
    }

    /// The world's time; `None` before it begins.
    fn since(&self, t: Duration) -> Option<Duration> {
        // The sentinel is later than any real time.
        t.checked_sub(Duration::from_nanos(self.begun_ns.load(Ordering::SeqCst)))
    }
}

/// How long something is shown, and what follows.
#[derive(Debug, Clone)]
pub(crate) struct Timeline {
    /// Zero for what never changes.
    pub(crate) length: Duration,
    pub(crate) at_end: AtEnd,
    /// Set permanently once the end is reached.
    pub(crate) ended: Arc<AtomicBool>,
}

impl Timeline {
    pub(crate) fn new(length: Duration, at_end: AtEnd) -> Self {
        Self {
            length,
            at_end,
            ended: Arc::default(),
        }
    }

    /// The round, from 0, and the time within it.
    fn place(&self, since: Duration) -> (u64, Duration) {
        if since < self.length || self.length.is_zero() {
            return (0, since);
        }
        match self.at_end {
            AtEnd::Hold => (0, since),
            AtEnd::End => {
                self.ended.store(true, Ordering::SeqCst);
                (0, since)
            }
            AtEnd::Loop => {
                let (since, length) = (since.as_nanos(), self.length.as_nanos());
                let [rounds, within] = [since / length, since % length];
                let within = u64::try_from(within).unwrap_or(u64::MAX);
                let rounds = u64::try_from(rounds).unwrap_or(u64::MAX);
                (rounds, Duration::from_nanos(within))
            }
        }
    }
}

pub(crate) enum Pictures {
    /// A scene through one of its sensors, with the scene's own noise if a seed is given.
    Scene {
        simulator: Box<Simulator>,
        thermistor: Celsius,
        noise_seed: Option<u64>,
    },
    /// Frames, the first at time zero, each until the next.
    Frames {
        frames: Vec<(Duration, Frame)>,
        /// With one frame per sensor frame, how many were shown; `None` with recorded times.
        shown: Option<u32>,
    },
}

impl Pictures {
    pub(crate) const fn timed(frames: Vec<(Duration, Frame)>) -> Self {
        let shown = None;
        Self::Frames { frames, shown }
    }
}

/// One specimen of the sensor, from a profile and a seed.
pub(crate) struct Specimen {
    pub(crate) profile: Arc<Profile>,
    pub(crate) seed: u64,
    /// Ticks measured so far.
    pub(crate) ticks: u64,
}

/// A frame source: pictures on a timeline in a world, seen by an ideal sensor or a specimen.
pub(crate) struct Show {
    pub(crate) world: Arc<World>,
    /// Whether the world belongs to this sensor alone and restarts with each first measurement.
    pub(crate) alone: bool,
    pub(crate) timeline: Timeline,
    pub(crate) pictures: Pictures,
    pub(crate) specimen: Option<Specimen>,
}

impl FrameSource for Show {
    fn frame_at(&mut self, t: Duration) -> Frame {
        let seen = self.picture(self.world.since(t));
        match &mut self.specimen {
            None => seen,
            Some(specimen) => {
                let tick = specimen.ticks;
                specimen.ticks += 1;
                specimen.profile.apply(specimen.seed, tick, t, seen)
            }
        }
    }

    fn measuring_from(&mut self, t: Duration) {
        if self.alone {
            let begun = nanoseconds(t).min(NOT_BEGUN - 1);
            self.world.begun_ns.store(begun, Ordering::SeqCst);
        }
    }
}

impl Show {
    /// Pictures that stay at their end, for a sensor alone.
    pub(crate) fn alone(pictures: Pictures) -> Self {
        Self {
            world: World::new(),
            alone: true,
            timeline: Timeline::new(Duration::ZERO, AtEnd::Hold),
            pictures,
            specimen: None,
        }
    }

    fn picture(&mut self, since: Option<Duration>) -> Frame {
        match &mut self.pictures {
            Pictures::Scene {
                simulator,
                thermistor,
                noise_seed,
            } => {
                let (round, at) = self.timeline.place(since.unwrap_or_default());
                let image = match noise_seed {
                    Some(seed) => simulator.noisy(at, seed.wrapping_add(round)),
                    None => simulator.image(at),
                };
                // Sensors other than 8 x 8 were rejected before.
                let frame = image.to_frame(*thermistor);
                frame.unwrap_or(Frame::uniform(*thermistor))
            }
            Pictures::Frames { frames, shown } => {
                let mut at = since.unwrap_or_default();
                if let Some(shown) = shown {
                    at = TICK * *shown;
                    *shown = shown.saturating_add(u32::from(since.is_some()));
                }
                nearest(frames, self.timeline.place(at).1)
            }
        }
    }
}

/// These frames, a tick apart.
pub(crate) fn evenly(frames: impl Iterator<Item = Frame>) -> Vec<(Duration, Frame)> {
    (0..).map(|tick| TICK * tick).zip(frames).collect()
}

/// The time from the first frame to the end of the last, which lasts one tick.
pub(crate) fn length(frames: &[(Duration, Frame)]) -> Duration {
    frames.last().map_or(Duration::ZERO, |(at, _)| *at + TICK)
}

/// The last frame recorded up to half a tick after `at`: recorded times may be off by that much.
fn nearest(frames: &[(Duration, Frame)], at: Duration) -> Frame {
    let begun = frames.partition_point(|(recorded, _)| *recorded <= at + TICK / 2);
    let frame = frames.get(begun.saturating_sub(1));
    // Recordings without frames were rejected before.
    frame.map_or(Frame::uniform(Celsius::new(0.0)), |(_, frame)| *frame)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn warm(celsius: f32) -> Frame {
        Frame::uniform(Celsius::new(celsius))
    }

    fn ms(milliseconds: u64) -> Duration {
        Duration::from_millis(milliseconds)
    }

    fn show(pictures: Pictures, length: Duration, at_end: AtEnd) -> Show {
        Show {
            alone: false,
            timeline: Timeline::new(length, at_end),
            ..Show::alone(pictures)
        }
    }

    fn seen(show: &mut Show, times_ms: &[u64]) -> Vec<f32> {
        let celsius = |t: &u64| show.frame_at(ms(*t)).pixels[0].get();
        times_ms.iter().map(celsius).collect()
    }

    fn three_at_their_times(at_end: AtEnd) -> Show {
        let frames = [(0, 1.0), (1000, 2.0), (1100, 3.0)];
        let frames = frames.map(|(at, celsius)| (ms(at), warm(celsius))).to_vec();
        let length = length(&frames);
        assert_eq!(length, ms(1200));
        show(Pictures::timed(frames), length, at_end)
    }

    fn has_ended(show: &Show) -> bool {
        show.timeline.ended.load(Ordering::SeqCst)
    }

    #[test]
    fn a_recording_comes_at_its_own_times_once_somebody_speaks() {
        let mut show = three_at_their_times(AtEnd::Hold);
        let before = seen(&mut show, &[100, 60_000]);
        assert_eq!(before, [1.0, 1.0], "nobody asked yet");
        assert!(show.world.begin(ms(70_000)));
        assert!(!show.world.begin(ms(99_000)), "it begins once");
        // A time half a period off still belongs to the tick; the last frame stays.
        let times = [70_000, 70_900, 70_949, 70_950, 71_050, 71_200, 99_000];
        let expected = [1.0, 1.0, 1.0, 2.0, 3.0, 3.0, 3.0];
        assert_eq!(seen(&mut show, &times), expected);
        assert!(!has_ended(&show));
    }

    #[test]
    fn a_recording_begins_again_or_ends_by_choice() {
        let mut looped = three_at_their_times(AtEnd::Loop);
        looped.world.begin(ms(0));
        let rounds = seen(&mut looped, &[1100, 1200, 2200, 3600]);
        assert_eq!(rounds, [3.0, 1.0, 2.0, 1.0]);

        let mut ending = three_at_their_times(AtEnd::End);
        ending.world.begin(ms(0));
        seen(&mut ending, &[1199]);
        assert!(!has_ended(&ending));
        seen(&mut ending, &[1200]);
        assert!(has_ended(&ending));

        // What never changes has no end.
        let timeline = Timeline::new(Duration::ZERO, AtEnd::End);
        assert_eq!(timeline.place(ms(5)), (0, ms(5)));
        assert!(!timeline.ended.load(Ordering::SeqCst));
    }

    /// The end comes after the last frame, not with it.
    #[test]
    fn frame_by_frame_none_is_left_out_and_none_comes_twice() {
        for (at_end, expected) in [
            (AtEnd::Hold, [1.0, 2.0, 3.0, 3.0, 3.0]),
            (AtEnd::Loop, [1.0, 2.0, 3.0, 1.0, 2.0]),
            (AtEnd::End, [1.0, 2.0, 3.0, 3.0, 3.0]),
        ] {
            let frames = evenly([1.0, 2.0, 3.0].map(warm).into_iter());
            let shown = Some(0);
            let mut show = show(Pictures::Frames { frames, shown }, ms(300), at_end);
            assert_eq!(seen(&mut show, &[50, 60]), [1.0, 1.0], "nobody asked yet");
            show.world.begin(ms(90));
            assert_eq!(seen(&mut show, &[100, 204, 10_000]), expected[..3]);
            assert!(!has_ended(&show), "{at_end:?}");
            let after = seen(&mut show, &[10_100, 10_200]);
            assert_eq!(after, expected[3..], "{at_end:?}");
            assert_eq!(has_ended(&show), at_end == AtEnd::End);
        }
    }

    #[test]
    fn a_sensor_alone_starts_over_with_each_first_measurement() {
        let frames = vec![(ms(0), warm(1.0)), (ms(100), warm(2.0))];
        let mut show = Show::alone(Pictures::timed(frames));
        for start in [100, 5_000] {
            show.measuring_from(ms(start));
            let times = [0, 100, 900].map(|since| start + since);
            assert_eq!(seen(&mut show, &times), [1.0, 2.0, 2.0]);
        }
    }
}
