//! What an emulated sensor sees: a scene, a recording or a constant, as a function of the world's time.
//!
//! ```text
//!  Clock ──t──▶ World: time since the first transfer ──▶ Timeline: held, looped or ended ──▶ Pictures ──▶ Frame
//! ```
//!
//! All sensors share one world, so that two of them see the same person at the same place at the same time, also
//! when one of them is reset.

use amg8833_emulator::FrameSource;
use grideye_frame::{Celsius, Frame, TICK};
use grideye_scene::Simulator;
use grideye_scene::profile::Profile;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

/// The world has not begun.
const NOT_BEGUN: u64 = u64::MAX;

/// When a recording's frames come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Replay {
    /// At the times at which they were recorded.
    Times,
    /// One with each frame of the sensor: none twice, none left out.
    Frames,
}

/// What comes after the end of a walk or a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AtEnd {
    /// The last picture stays.
    Hold,
    /// It begins again.
    Loop,
    /// The bus is gone (ENODEV), and a server ends.
    End,
}

/// The time that all sensors share: it stands at zero until somebody speaks on one of the buses.
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

    /// Begins now; `false` if it has begun before.
    pub(crate) fn begin(&self, now: Duration) -> bool {
        let begun = self.begun_ns.compare_exchange(
            NOT_BEGUN,
            nanoseconds(now),
            Ordering::SeqCst,
            Ordering::SeqCst,
        );
        begun.is_ok()
    }

    /// The world's time; `None` before it has begun.
    fn since(&self, t: Duration) -> Option<Duration> {
        // No time is as late as that of a world that has not begun.
        t.checked_sub(Duration::from_nanos(self.begun_ns.load(Ordering::SeqCst)))
    }
}

/// How long something is shown, and what comes then.
#[derive(Debug, Clone)]
pub(crate) struct Timeline {
    /// Zero for what never changes.
    pub(crate) length: Duration,
    pub(crate) at_end: AtEnd,
    /// Set for good once the end was reached.
    pub(crate) ended: Arc<AtomicBool>,
}

impl Timeline {
    /// A timeline whose end has not been reached.
    pub(crate) fn new(length: Duration, at_end: AtEnd) -> Self {
        Self {
            length,
            at_end,
            ended: Arc::default(),
        }
    }

    /// Which round it is, from 0, and the time within it.
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
                let rounds = since.as_nanos() / self.length.as_nanos();
                let within = since.as_nanos() % self.length.as_nanos();
                (
                    u64::try_from(rounds).unwrap_or(u64::MAX),
                    Duration::from_nanos(u64::try_from(within).unwrap_or(u64::MAX)),
                )
            }
        }
    }
}

/// What is shown.
pub(crate) enum Pictures {
    /// A scene through one of its sensors, with the scene's own noise if there is a seed for it.
    Scene {
        simulator: Box<Simulator>,
        thermistor: Celsius,
        noise_seed: Option<u64>,
    },
    /// Frames, the first at time zero, each until the next.
    Times(Vec<(Duration, Frame)>),
    /// Frames, one each time that the sensor measures.
    Frames { frames: Vec<Frame>, shown: usize },
    /// One frame permanently.
    Constant(Box<Frame>),
}

/// One specimen of the sensor, whose noise and pattern the profile tells and the seed decides.
pub(crate) struct Specimen {
    pub(crate) profile: Arc<Profile>,
    pub(crate) seed: u64,
    /// Ticks that it has measured.
    pub(crate) ticks: u64,
}

/// A frame source: pictures on a timeline in a world, seen by an ideal sensor or by a specimen.
pub(crate) struct Show {
    pub(crate) world: Arc<World>,
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
}

impl Show {
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
                // The plan has refused every sensor that is not 8 x 8.
                image
                    .to_frame(*thermistor)
                    .unwrap_or(Frame::uniform(*thermistor))
            }
            Pictures::Times(frames) => {
                let (_, at) = self.timeline.place(since.unwrap_or_default());
                nearest(frames, at)
            }
            Pictures::Frames { frames, shown } => {
                let index = *shown;
                if since.is_some() {
                    *shown = following(index, frames.len(), &self.timeline);
                }
                let index = index.min(frames.len().saturating_sub(1));
                frames.get(index).copied().unwrap_or(nothing())
            }
            Pictures::Constant(frame) => **frame,
        }
    }
}

/// The time from the first frame to the end of the last, which is seen for a tick at least.
pub(crate) fn length(frames: &[(Duration, Frame)]) -> Duration {
    frames.last().map_or(Duration::ZERO, |(at, _)| *at + TICK)
}

/// The last frame that was recorded until half a tick after this time: so far off a recorded time may be.
fn nearest(frames: &[(Duration, Frame)], at: Duration) -> Frame {
    let begun = frames.partition_point(|(recorded, _)| *recorded <= at + TICK / 2);
    frames
        .get(begun.saturating_sub(1))
        .map_or(nothing(), |(_, frame)| *frame)
}

/// The number of the frame after this one.
fn following(index: usize, count: usize, timeline: &Timeline) -> usize {
    let next = index + 1;
    match timeline.at_end {
        AtEnd::Loop if next >= count => 0,
        AtEnd::End if index >= count => {
            timeline.ended.store(true, Ordering::SeqCst);
            index
        }
        AtEnd::Hold | AtEnd::End if index >= count => index,
        _ => next,
    }
}

/// A recording without frames is refused before it comes here.
fn nothing() -> Frame {
    Frame::uniform(Celsius::new(0.0))
}

fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(NOT_BEGUN - 1)
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
            world: World::new(),
            timeline: Timeline::new(length, at_end),
            pictures,
            specimen: None,
        }
    }

    fn seen(show: &mut Show, times_ms: &[u64]) -> Vec<f32> {
        times_ms
            .iter()
            .map(|t| show.frame_at(ms(*t)).pixels[0].get())
            .collect()
    }

    fn three_at_their_times(at_end: AtEnd) -> Show {
        let frames = vec![
            (ms(0), warm(1.0)),
            (ms(1000), warm(2.0)),
            (ms(1100), warm(3.0)),
        ];
        let length = length(&frames);
        assert_eq!(length, ms(1200));
        show(Pictures::Times(frames), length, at_end)
    }

    #[test]
    fn a_recording_comes_at_its_own_times_once_somebody_speaks() {
        let mut show = three_at_their_times(AtEnd::Hold);
        assert_eq!(
            seen(&mut show, &[100, 60_000]),
            [1.0, 1.0],
            "nobody asked yet"
        );
        assert!(show.world.begin(ms(70_000)));
        assert!(!show.world.begin(ms(99_000)), "it begins once");
        let times = [70_000, 70_900, 70_949, 70_950, 71_050, 71_200, 99_000];
        assert_eq!(
            seen(&mut show, &times),
            [1.0, 1.0, 1.0, 2.0, 3.0, 3.0, 3.0],
            "a time half a period off still belongs to the tick; the last frame stays"
        );
        assert!(!show.timeline.ended.load(Ordering::SeqCst));
    }

    #[test]
    fn a_recording_begins_anew_or_ends_by_choice() {
        let mut looped = three_at_their_times(AtEnd::Loop);
        looped.world.begin(ms(0));
        assert_eq!(
            seen(&mut looped, &[1100, 1200, 2200, 3600]),
            [3.0, 1.0, 2.0, 1.0]
        );

        let mut ending = three_at_their_times(AtEnd::End);
        ending.world.begin(ms(0));
        seen(&mut ending, &[1199]);
        assert!(!ending.timeline.ended.load(Ordering::SeqCst));
        seen(&mut ending, &[1200]);
        assert!(ending.timeline.ended.load(Ordering::SeqCst));
    }

    #[test]
    fn frame_by_frame_none_is_left_out_and_none_comes_twice() {
        let frames = || Pictures::Frames {
            frames: vec![warm(1.0), warm(2.0), warm(3.0)],
            shown: 0,
        };
        let ticks = [100, 204, 10_000, 10_100, 10_200];
        for (at_end, expected) in [
            (AtEnd::Hold, [1.0, 2.0, 3.0, 3.0, 3.0]),
            (AtEnd::Loop, [1.0, 2.0, 3.0, 1.0, 2.0]),
            (AtEnd::End, [1.0, 2.0, 3.0, 3.0, 3.0]),
        ] {
            let mut show = show(frames(), ms(300), at_end);
            assert_eq!(seen(&mut show, &[50, 60]), [1.0, 1.0], "nobody asked yet");
            show.world.begin(ms(90));
            assert_eq!(seen(&mut show, &ticks), expected, "{at_end:?}");
            let ended = show.timeline.ended.load(Ordering::SeqCst);
            assert_eq!(ended, at_end == AtEnd::End);
        }
    }

    #[test]
    fn the_end_comes_after_the_last_frame_and_not_with_it() {
        let frames = vec![warm(1.0), warm(2.0)];
        let mut show = show(Pictures::Frames { frames, shown: 0 }, ms(200), AtEnd::End);
        show.world.begin(ms(0));
        assert_eq!(seen(&mut show, &[100, 200]), [1.0, 2.0]);
        assert!(!show.timeline.ended.load(Ordering::SeqCst));
        seen(&mut show, &[300]);
        assert!(show.timeline.ended.load(Ordering::SeqCst));
    }

    #[test]
    fn what_never_changes_has_no_end() {
        let timeline = Timeline::new(Duration::ZERO, AtEnd::End);
        assert_eq!(timeline.place(ms(5)), (0, ms(5)));
        assert!(!timeline.ended.load(Ordering::SeqCst));
    }
}
