mod beside;
mod notes;

pub use beside::KnownUnit;

use crate::align::{
    AlignOptions, Aligner, Alignment, Clock, OFFSET_MAX_PX, Orientation, Pixels, SAMPLE_MAX,
    SPAN_MAX, TimeAlignment, moved, still_orientation,
};
use crate::background::{Empty, background};
use crate::clean::drift::Drift;
use crate::clean::{self, Counts, LeftOut, Read};
use crate::compare::{
    Comparison, Protocol, RealFrame, Settings, Shape, SimulatedFrame, compare_beside, evenly,
};
use crate::error::{Side, ValidatorError};
use crate::metrics::{Binning, count};
use crate::verdict::Thresholds;
use grideye_frame::{COLUMNS, PIXELS, PixelWord, ROWS};
use grideye_recording::Record;
use grideye_scene::{Scene, Simulator};
use std::time::Duration;

/// Frames compared under the static protocol unless asked otherwise, as in the paper.
pub const STATIC_FRAMES: usize = 10;
/// Frames compared under the dynamic protocol unless asked otherwise.
pub const DYNAMIC_FRAMES: usize = 100;
/// Most frames that the repeat may be later.
pub const LAG_FRAMES_MAX: usize = 600;

/// How to compare a recording with a scene. Every default can be left as it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Seed of the simulated noise and of the shuffled pixels. Equal seeds give equal reports; a recording that was
    /// itself simulated with this seed is met by other noise all the same.
    pub seed: u64,
    /// Which frame meets which; by default static if nothing moves in the scene.
    pub protocol: Option<Protocol>,
    /// Frames a side, chosen evenly over the recording; by default [`STATIC_FRAMES`] or [`DYNAMIC_FRAMES`].
    pub frames: Option<usize>,
    /// How many frames later a frame's repeat is, 1 to [`LAG_FRAMES_MAX`]; by default 3, and under the dynamic
    /// protocol as many as come nearest to 0.1 s.
    pub lag_frames: Option<usize>,
    /// Time of the scene at the recording's first frame.
    pub start: Duration,
    /// Random orders of the pixels.
    pub shuffles: usize,
    /// The bins of the second set of entropies; by default the sensor's own steps.
    pub binning: Option<Binning>,
    /// Threads that count pairs of frames; the result is the same with any number.
    pub threads: usize,
    /// What the verdict is measured against.
    pub thresholds: Thresholds,
    /// What may be aligned, and how far.
    pub align: AlignOptions,
    /// What is known of the sensor's specimen: its pattern is added to the scene's claim.
    pub unit: Option<KnownUnit>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            seed: 0,
            protocol: None,
            frames: None,
            lag_frames: None,
            start: Duration::ZERO,
            shuffles: 200,
            binning: None,
            threads: 1,
            thresholds: Thresholds::default(),
            align: AlignOptions::default(),
            unit: None,
        }
    }
}

/// The step of the sensor in degrees, as the driver decodes it.
#[must_use]
pub fn sensor_step_c() -> f64 {
    let decoded = |word| f64::from(amg8833::word::pixel_celsius(PixelWord(word)).get());
    decoded(1) - decoded(0)
}

/// Compares one stream of a recording with what a scene's sensor would see.
///
/// Time counts from the first frame that was read. Frames that say nothing of their own moment are left out, slow
/// common drift is taken out, and time is aligned within the bounds of [`Options::align`] where something moves; how
/// the image lies is reported, and changed only if asked for. [`Comparison::alignment`] holds what was found.
///
/// # Errors
/// When the scene has no such sensor or the sensor has another resolution, the recording holds no frame, or (under
/// the dynamic protocol) time runs backwards in it or it begins after the scene's end; when a bound of the alignment
/// is out of its range; and as [`compare()`] does.
pub fn compare_scene(
    records: &[Record],
    scene: &Scene,
    sensor: &str,
    options: &Options,
) -> Result<Comparison, ValidatorError> {
    options.align.check()?;
    let simulator = Simulator::new(scene, sensor)?;
    let shape = shape_of(&simulator)?;
    let protocol = options.protocol.unwrap_or(if scene.is_static() {
        Protocol::Static
    } else {
        Protocol::Dynamic
    });
    let (read, mut counts) = clean::clean(records, protocol == Protocol::Dynamic);
    let timed = timed(read, protocol, options)?;
    let mut aligned = aligned(timed, scene, sensor, protocol, options)?;
    within_scene(&mut aligned, scene, protocol, options, &mut counts)?;
    aligned.found.left_out = counts.list();
    let mut notes = notes::alignment(&aligned.found, records.len(), options);
    let lag_frames = lag(&aligned.frames, protocol, options.lag_frames)?;
    let real = chosen(
        &aligned.frames,
        lag_frames,
        number(protocol, options.frames)?,
        &mut notes,
    );
    let noise_seed = options.seed.wrapping_add(INDEPENDENCE);
    let pictures = Pictures::new(scene, &simulator, sensor, options)?;
    let (simulated, nobody) = pictures.simulated(&real, &aligned, noise_seed);
    notes.push(protocol_note(protocol, scene));
    notes.push(format!(
        "The simulated noise has the seed {noise_seed} and σ {:.2} °C.",
        simulator.sensor().noise_sigma
    ));
    let settings = settings(&simulator, protocol, lag_frames, options);
    let room = pictures.learned_room(records, &aligned, protocol, options);
    let beside = beside::beside(
        records,
        &simulator,
        (nobody, !scene.agents().is_empty()),
        room,
        &aligned.found,
        options,
    );
    let comparison = compare_beside(shape, &real, &simulated, &settings, &beside)?;
    Ok(Comparison {
        notes,
        alignment: Some(aligned.found),
        ..comparison
    })
}

/// Keeps the noise of this simulation apart from that of a recording simulated with the same seed (the golden ratio
/// in 64 bits, as in `SplitMix64`).
const INDEPENDENCE: u64 = 0x9E37_79B9_7F4A_7C15;

/// The repeat under the dynamic protocol is to be this much later: new noise at 10 Hz, and too short to walk away.
const DYNAMIC_LAG: Duration = Duration::from_millis(100);
const STATIC_LAG_FRAMES: usize = 3;

/// A frame that was read, at the time that the scene has without alignment.
struct Timed {
    seq: u64,
    time: Duration,
    celsius: Pixels,
}

/// Frames as they are compared, and what was done to them.
struct Aligned {
    frames: Vec<Timed>,
    clock: Clock,
    found: Alignment,
}

fn shape_of(simulator: &Simulator) -> Result<Shape, ValidatorError> {
    let sensor = simulator.sensor();
    if (sensor.columns, sensor.rows) == (COLUMNS, ROWS) {
        return Ok(Shape {
            columns: COLUMNS,
            rows: ROWS,
        });
    }
    Err(ValidatorError::Resolution {
        sensor: sensor.name.clone(),
        columns: sensor.columns,
        rows: sensor.rows,
    })
}

fn timed(
    read: Vec<Read>,
    protocol: Protocol,
    options: &Options,
) -> Result<Vec<Timed>, ValidatorError> {
    let Some(first_ns) = read.first().map(|frame| frame.boot_ns) else {
        return Err(ValidatorError::NoFrames { side: Side::Real });
    };
    let backwards = read
        .windows(2)
        .find(|pair| pair[1].boot_ns < pair[0].boot_ns);
    if let (Protocol::Dynamic, Some(pair)) = (protocol, backwards) {
        return Err(ValidatorError::TimeRunsBackwards {
            seq: pair[1].seq,
            by: Duration::from_nanos(pair[0].boot_ns - pair[1].boot_ns),
        });
    }
    let timed = |frame: Read| Timed {
        seq: frame.seq,
        time: Duration::from_nanos(frame.boot_ns.saturating_sub(first_ns))
            .saturating_add(options.start),
        celsius: frame.celsius,
    };
    Ok(read.into_iter().map(timed).collect())
}

/// Finds out how recording and scene lie to each other, and takes out what may be taken out.
fn aligned(
    frames: Vec<Timed>,
    scene: &Scene,
    sensor: &str,
    protocol: Protocol,
    options: &Options,
) -> Result<Aligned, ValidatorError> {
    // Without a grid, a frame is quicker to make and just as near.
    let simulator = Simulator::without_grid(scene, sensor)?;
    let moves = protocol == Protocol::Dynamic && !scene.is_static();
    let mut aligned = if moves {
        moving(frames, &simulator, scene, &options.align)
    } else {
        still(frames, &simulator, &options.align)
    };
    let drift = drift(&aligned, &simulator);
    aligned.found.drift_c = drift.range_c();
    let turned_back = match aligned.found.orientation {
        Some(found) if found.applied => found.orientation.inverse(),
        _ => Orientation::Upright,
    };
    for frame in &mut aligned.frames {
        let by_c = drift.at(frame.time.as_secs_f64());
        frame.celsius = turned_back.apply(&frame.celsius.map(|celsius| celsius - by_c));
    }
    Ok(aligned)
}

/// Aligns a recording of something that moves.
fn moving(
    frames: Vec<Timed>,
    simulator: &Simulator,
    scene: &Scene,
    options: &AlignOptions,
) -> Aligned {
    let (times_s, sample) = sample(&frames, SPAN_MAX);
    let end_s = scene.duration().as_secs_f64();
    let aligner = Aligner::new(simulator, end_s, times_s, sample, options);
    let mut found = Alignment {
        orientation: aligner.orientation(),
        ..Alignment::default()
    };
    let turned = turned(&mut found, options);
    let aligner = if turned == Orientation::Upright {
        aligner
    } else {
        aligner.turned_back(turned)
    };
    let mut clock = Clock::own();
    if options.time != TimeAlignment::None {
        let (aligned, time) = aligner.time(options.time);
        clock = aligned;
        found.time = Some(time);
    }
    found.offset = aligner.offset(&clock);
    offset_applied(&mut found, options);
    Aligned {
        frames,
        clock,
        found,
    }
}

/// Sees how the image of a standing scene lies.
fn still(frames: Vec<Timed>, simulator: &Simulator, options: &AlignOptions) -> Aligned {
    let (_, sample) = sample(&frames, Duration::MAX);
    let mut mean = [0.0; PIXELS];
    for frame in &sample {
        for (sum, celsius) in mean.iter_mut().zip(frame) {
            *sum += celsius / count(sample.len());
        }
    }
    let time = frames.first().map(|frame| frame.time).unwrap_or_default();
    let claim = pixels(&simulator.image(time).celsius);
    let mut found = Alignment {
        orientation: still_orientation(&mean, &claim),
        ..Alignment::default()
    };
    turned(&mut found, options);
    Aligned {
        frames,
        clock: Clock::own(),
        found,
    }
}

/// Times and pixels of the frames that alignment looks at.
fn sample(frames: &[Timed], span: Duration) -> (Vec<f64>, Vec<Pixels>) {
    let first = frames.first().map(|frame| frame.time).unwrap_or_default();
    let within = frames
        .iter()
        .take_while(|frame| frame.time.saturating_sub(first) <= span)
        .count();
    evenly(within, SAMPLE_MAX)
        .into_iter()
        .map(|index| (frames[index].time.as_secs_f64(), frames[index].celsius))
        .unzip()
}

/// Marks the orientation as applied if that was asked for, and gives what is to be undone.
fn turned(found: &mut Alignment, options: &AlignOptions) -> Orientation {
    match &mut found.orientation {
        Some(orientation) if options.orientation => {
            orientation.applied = orientation.orientation != Orientation::Upright;
            orientation.orientation
        }
        _ => Orientation::Upright,
    }
}

fn offset_applied(found: &mut Alignment, options: &AlignOptions) {
    if let Some(offset) = &mut found.offset {
        offset.applied = options.pose;
    }
}

/// The slow drift that is common to all pixels, against the scene at the times that were found.
fn drift(aligned: &Aligned, simulator: &Simulator) -> Drift {
    let chosen = evenly(aligned.frames.len(), SAMPLE_MAX);
    let (times_s, left): (Vec<f64>, Vec<Pixels>) = chosen
        .into_iter()
        .map(|index| {
            let frame = &aligned.frames[index];
            let time_s = frame.time.as_secs_f64();
            let scene_s = aligned.clock.scene_s(time_s);
            let claim = simulator.image(seconds(scene_s)).celsius;
            let left = std::array::from_fn(|pixel| frame.celsius[pixel] - claim[pixel]);
            (time_s, left)
        })
        .unzip();
    Drift::new(&times_s, &left)
}

/// Leaves out the frames that the scene says nothing of.
fn within_scene(
    aligned: &mut Aligned,
    scene: &Scene,
    protocol: Protocol,
    options: &Options,
    counts: &mut Counts,
) -> Result<(), ValidatorError> {
    if protocol == Protocol::Static || scene.is_static() {
        return Ok(());
    }
    let (end, clock) = (scene.duration(), aligned.clock.clone());
    // The last frame of a walk may end on it but for rounding.
    let times_s = -1e-6..=end.as_secs_f64() + 1e-6;
    aligned.frames.retain(|frame| {
        let is_within = times_s.contains(&clock.scene_s(frame.time.as_secs_f64()));
        if !is_within {
            counts.add(LeftOut::OutsideScene, frame.seq);
        }
        is_within
    });
    if aligned.frames.is_empty() {
        return Err(ValidatorError::NoOverlap {
            starts: options.start,
            ends: end,
        });
    }
    Ok(())
}

fn seconds(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds.max(0.0)).unwrap_or_default()
}

fn pixels(celsius: &[f64]) -> Pixels {
    std::array::from_fn(|pixel| celsius.get(pixel).copied().unwrap_or_default())
}

fn lag(timed: &[Timed], protocol: Protocol, asked: Option<usize>) -> Result<usize, ValidatorError> {
    let lag = match (asked, protocol) {
        (Some(asked), _) => asked,
        (None, Protocol::Static) => STATIC_LAG_FRAMES,
        (None, Protocol::Dynamic) => period(timed).map_or(STATIC_LAG_FRAMES, lag_of_period),
    };
    if (1..=LAG_FRAMES_MAX).contains(&lag) {
        return Ok(lag);
    }
    Err(ValidatorError::Setting {
        name: "lag_frames",
        expected: "a number from 1 to 600",
        found: count(lag),
    })
}

fn period(timed: &[Timed]) -> Option<Duration> {
    let (first, last) = (timed.first()?, timed.last()?);
    let frames = u32::try_from(last.seq.checked_sub(first.seq)?).ok()?;
    (last.time.saturating_sub(first.time)).checked_div(frames)
}

/// The lag of 1 to 600 frames that comes nearest to [`DYNAMIC_LAG`].
fn lag_of_period(period: Duration) -> usize {
    if period.is_zero() {
        return STATIC_LAG_FRAMES;
    }
    let frames = (DYNAMIC_LAG + period / 2).as_nanos() / period.as_nanos();
    usize::try_from(frames)
        .unwrap_or(LAG_FRAMES_MAX)
        .clamp(1, LAG_FRAMES_MAX)
}

fn number(protocol: Protocol, asked: Option<usize>) -> Result<usize, ValidatorError> {
    match (asked, protocol) {
        (Some(0), _) => Err(ValidatorError::Setting {
            name: "frames",
            expected: "a number above zero",
            found: 0.0,
        }),
        (Some(asked), _) => Ok(asked),
        (None, Protocol::Static) => Ok(STATIC_FRAMES),
        (None, Protocol::Dynamic) => Ok(DYNAMIC_FRAMES),
    }
}

/// Chooses evenly among the frames that have a repeat; among all if fewer than two have one.
fn chosen(
    timed: &[Timed],
    lag_frames: usize,
    number: usize,
    notes: &mut Vec<String>,
) -> Vec<RealFrame> {
    let with_repeat: Vec<usize> = (0..timed.len())
        .filter(|&index| repeat(timed, index, lag_frames).is_some())
        .collect();
    let candidates = if with_repeat.len() < 2 {
        (0..timed.len()).collect()
    } else {
        with_repeat
    };
    let chosen = evenly(candidates.len(), number);
    notes.push(format!(
        "{} of the {} frames that were read are compared, chosen evenly over the recording.",
        chosen.len(),
        timed.len()
    ));
    let frame = |index: usize| RealFrame {
        time: timed[index].time,
        celsius: timed[index].celsius.to_vec(),
        later: repeat(timed, index, lag_frames).map(|later| later.to_vec()),
    };
    chosen
        .into_iter()
        .map(|place| frame(candidates[place]))
        .collect()
}

/// The frame whose number is `lag_frames` higher. A gap, or a new start of the count, between the two leaves none.
fn repeat(timed: &[Timed], index: usize, lag_frames: usize) -> Option<&Pixels> {
    let sought = timed[index]
        .seq
        .checked_add(u64::try_from(lag_frames).ok()?)?;
    let following = timed.get(index + 1..)?;
    let near = following.iter().take(lag_frames);
    near.into_iter()
        .find(|frame| frame.seq == sought)
        .map(|frame| &frame.celsius)
}

/// What makes the frames of the simulated side.
struct Pictures<'a> {
    simulator: &'a Simulator,
    /// The scene without its people.
    empty: Simulator,
    /// What this specimen shows beside the scene.
    pattern_c: Option<[f64; PIXELS]>,
}

impl<'a> Pictures<'a> {
    fn new(
        scene: &Scene,
        simulator: &'a Simulator,
        sensor: &str,
        options: &Options,
    ) -> Result<Self, ValidatorError> {
        Ok(Self {
            simulator,
            empty: Simulator::new(&scene.without_agents(), sensor)?,
            pattern_c: options.unit.map(|unit| unit.pattern_c),
        })
    }

    /// What the scene has at the times of the real frames, with its people and (without noise) without them.
    fn simulated(
        &self,
        real: &[RealFrame],
        aligned: &Aligned,
        seed: u64,
    ) -> (Vec<SimulatedFrame>, Vec<Vec<f64>>) {
        let time = |real: &RealFrame| match &aligned.clock {
            clock if *clock == Clock::own() => real.time,
            clock => seconds(clock.scene_s(real.time.as_secs_f64())),
        };
        real.iter()
            .map(|real| self.frame(time(real), aligned, seed))
            .unzip()
    }

    /// What the recording shows while neither it nor the scene shows anybody.
    ///
    /// Of a scene that stands still, no stretch is known to be empty: who stands there from first to last would be taken
    /// for the room.
    fn learned_room(
        &self,
        records: &[Record],
        aligned: &Aligned,
        protocol: Protocol,
        options: &Options,
    ) -> Option<Vec<f64>> {
        if protocol == Protocol::Static || self.pattern_c.is_some() {
            return None;
        }
        let found = background(records, &Empty::Find).ok()?;
        let is_empty = |frame: &&Timed| {
            let since = frame.time.saturating_sub(options.start);
            found.stretches.iter().any(|stretch| stretch.holds(since))
                && self.is_empty(seconds(aligned.clock.scene_s(frame.time.as_secs_f64())))
        };
        let within: Vec<&Timed> = evenly(aligned.frames.len(), SAMPLE_MAX)
            .into_iter()
            .map(|index| &aligned.frames[index])
            .filter(is_empty)
            .collect();
        (within.len() >= EMPTY_FRAMES_MIN).then(|| {
            let mean = |pixel: usize| {
                let sum: f64 = within.iter().map(|frame| frame.celsius[pixel]).sum();
                sum / count(within.len())
            };
            (0..PIXELS).map(mean).collect()
        })
    }

    /// Whether the scene shows nobody.
    fn is_empty(&self, time: Duration) -> bool {
        let (with, without) = (self.simulator.image(time), self.empty.image(time));
        with.celsius
            .iter()
            .zip(&without.celsius)
            .all(|(with, without)| (with - without).abs() < NOBODY_C)
    }

    fn frame(&self, time: Duration, aligned: &Aligned, seed: u64) -> (SimulatedFrame, Vec<f64>) {
        let clean = self.simulator.image(time).celsius;
        let noisy = self.simulator.noisy(time, seed).celsius;
        let noise_free = self.shown(&clean, aligned);
        let noise = noisy.iter().zip(&clean).map(|(noisy, clean)| noisy - clean);
        let frame = SimulatedFrame {
            time,
            celsius: noise_free
                .iter()
                .zip(noise)
                .map(|(clean, noise)| clean + noise)
                .collect(),
            noise_free,
            truth: Some(self.simulator.truth(time).foreground(TRUTH_SHARE_MIN)),
        };
        let nobody = self.shown(&self.empty.image(time).celsius, aligned);
        (frame, nobody)
    }

    /// An image moved by the offset, if that is to be taken out, under the specimen's pattern, which does not move.
    fn shown(&self, clean: &[f64], aligned: &Aligned) -> Vec<f64> {
        let offset = aligned.found.offset.filter(|offset| offset.applied);
        let mut shown = offset.map_or_else(
            || clean.to_vec(),
            |offset| {
                let [right, down] = offset
                    .right_down_px
                    .map(|px| px.clamp(-OFFSET_MAX_PX, OFFSET_MAX_PX));
                moved(&pixels(clean), right, down).to_vec()
            },
        );
        for (shown, pattern) in shown.iter_mut().zip(self.pattern_c.iter().flatten()) {
            *shown += pattern;
        }
        shown
    }
}

/// Less of somebody than this is nobody, °C: a fifth of the sensor's step.
const NOBODY_C: f64 = 0.05;
/// Frames of an empty room that its map is the mean of, at least: the noise of the mean is a quarter of a frame's then.
const EMPTY_FRAMES_MIN: usize = 16;

/// A pixel belongs to an agent that covers half of it or more.
const TRUTH_SHARE_MIN: f64 = 0.5;

fn protocol_note(protocol: Protocol, scene: &Scene) -> String {
    let why = if scene.is_static() {
        "nothing moves in the scene"
    } else {
        "the scene's agent moves"
    };
    match protocol {
        Protocol::Static => format!(
            "Every real frame is compared with every simulated one (static protocol; {why})."
        ),
        Protocol::Dynamic => {
            format!("Frames are compared one by one at equal times (dynamic protocol; {why}).")
        }
    }
}

fn settings(
    simulator: &Simulator,
    protocol: Protocol,
    lag_frames: usize,
    options: &Options,
) -> Settings {
    let defaults = Settings::new(protocol, simulator.ambient_c(), sensor_step_c());
    let sigma = simulator.sensor().noise_sigma;
    Settings {
        noise_sigma_c: if sigma > 0.0 {
            sigma
        } else {
            defaults.noise_sigma_c
        },
        lag_frames,
        binning: options.binning.unwrap_or(defaults.binning),
        field_of_view_rad: Some(simulator.sensor().field_of_view_rad.into()),
        threads: options.threads,
        shuffles: options.shuffles,
        seed: options.seed,
        thresholds: options.thresholds,
        ..defaults
    }
}
