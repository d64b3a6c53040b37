mod background_fit;
mod beside;
mod choice;
mod notes;
mod pictures;

pub use background_fit::BackgroundFit;
pub use beside::KnownUnit;

use crate::align::{
    AlignOptions, Aligner, Alignment, Clock, Orientation, Pixels, SAMPLE_MAX, SPAN_MAX,
    TimeAlignment, still_orientation,
};
use crate::clean::drift::Drift;
use crate::clean::{self, Counts, LeftOut, Read};
use crate::compare::{Comparison, Protocol, Settings, Shape, compare_beside, evenly};
use crate::error::{Side, ValidatorError};
use crate::metrics::{Binning, count};
use crate::verdict::{State, Thresholds};
use beside::{KnownPattern, People};
use choice::{chosen, lag, number};
use grideye_frame::{COLUMNS, PIXELS, PixelWord, ROWS};
use grideye_recording::Record;
use grideye_scene::{Scene, Simulator};
use pictures::{Pictures, shows_people};
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
/// is out of its range; and as [`crate::compare()`] does.
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
    let mut pictures = Pictures::new(scene, &simulator, sensor, options)?;
    let (room, background) = pictures.learned_room(records, &aligned, protocol, options);
    let pattern = match (options.unit, &room) {
        (Some(unit), _) => Some(KnownPattern::of(&unit)),
        (None, room) => room.as_ref().and_then(|room| pictures.learn(room, options)),
    };
    let (simulated, nobody) = pictures.simulated(&real, &aligned, noise_seed);
    notes.push(protocol_note(protocol, scene));
    notes.push(format!(
        "The simulated noise has the seed {noise_seed} and σ {:.2} °C.",
        simulator.sensor().noise_sigma
    ));
    let settings = settings(&simulator, protocol, lag_frames, options);
    let beside = beside::beside(
        records,
        &simulator,
        People {
            are_shown: shows_people(&simulated, &nobody),
            are_in_scene: !scene.agents().is_empty(),
            nobody,
        },
        (room, pattern),
        &aligned.found,
        options,
    );
    let comparison = compare_beside(shape, &real, &simulated, &settings, &beside)?;
    let is_turned = comparison
        .judgement
        .criteria
        .iter()
        .any(|criterion| (criterion.name, criterion.state) == ("orientation", State::Failed));
    let lies = aligned.found.orientation.as_ref();
    notes.extend(lies.and_then(|found| notes::orientation(found, is_turned)));
    let warning = background.as_ref().and_then(BackgroundFit::warning);
    Ok(Comparison {
        warnings: Vec::from_iter(warning),
        background,
        notes,
        alignment: Some(aligned.found),
        ..comparison
    })
}

/// Keeps the noise of this simulation apart from that of a recording simulated with the same seed (the golden ratio
/// in 64 bits, as in `SplitMix64`).
const INDEPENDENCE: u64 = 0x9E37_79B9_7F4A_7C15;

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
