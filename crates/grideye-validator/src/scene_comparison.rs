use crate::compare::{
    Comparison, Protocol, RealFrame, Settings, Shape, SimulatedFrame, compare, evenly,
};
use crate::error::{Side, ValidatorError};
use crate::metrics::{Binning, count};
use crate::verdict::Thresholds;
use grideye_frame::{COLUMNS, PixelWord, ROWS};
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
/// Time counts from the first frame that was read. Nothing is aligned: not in time, not in orientation.
///
/// # Errors
/// When the scene has no such sensor or the sensor has another resolution, the recording holds no frame, or (under
/// the dynamic protocol) time runs backwards in it or it begins after the scene's end; and as [`compare()`] does.
pub fn compare_scene(
    records: &[Record],
    scene: &Scene,
    sensor: &str,
    options: &Options,
) -> Result<Comparison, ValidatorError> {
    let simulator = Simulator::new(scene, sensor)?;
    let shape = shape_of(&simulator)?;
    let protocol = options.protocol.unwrap_or(if scene.is_static() {
        Protocol::Static
    } else {
        Protocol::Dynamic
    });
    let mut notes = Vec::new();
    let read = frames_read(records, &mut notes)?;
    let timed = timed(read, protocol, scene, options, &mut notes)?;
    let lag_frames = lag(&timed, protocol, options.lag_frames)?;
    let real = chosen(
        &timed,
        lag_frames,
        number(protocol, options.frames)?,
        &mut notes,
    );
    let noise_seed = options.seed.wrapping_add(INDEPENDENCE);
    let simulated = simulated(&simulator, &real, noise_seed);
    notes.push(protocol_note(protocol, scene));
    notes.push(format!(
        "Frames of the recording are compared at their own times: its first frame is second {:.1} of the scene; no delay was looked for and no image was turned or moved.",
        options.start.as_secs_f64()
    ));
    notes.push(format!(
        "The simulated noise has the seed {noise_seed} and σ {:.2} °C.",
        simulator.sensor().noise_sigma
    ));
    let settings = settings(&simulator, protocol, lag_frames, options);
    let comparison = compare(shape, &real, &simulated, &settings)?;
    Ok(Comparison {
        notes,
        ..comparison
    })
}

/// Keeps the noise of this simulation apart from that of a recording simulated with the same seed (the golden ratio
/// in 64 bits, as in `SplitMix64`).
const INDEPENDENCE: u64 = 0x9E37_79B9_7F4A_7C15;

/// The repeat under the dynamic protocol is to be this much later: new noise at 10 Hz, and too short to walk away.
const DYNAMIC_LAG: Duration = Duration::from_millis(100);
const STATIC_LAG_FRAMES: usize = 3;

/// A frame that was read.
struct Read {
    seq: u64,
    /// On the device's clock.
    boot: Duration,
    celsius: Vec<f64>,
}

/// A frame that was read, at its time in the scene.
struct Timed {
    seq: u64,
    time: Duration,
    celsius: Vec<f64>,
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

fn frames_read(records: &[Record], notes: &mut Vec<String>) -> Result<Vec<Read>, ValidatorError> {
    let read: Vec<Read> = records
        .iter()
        .filter_map(|record| {
            let frame = amg8833::word::frame(record.reading.frame()?);
            Some(Read {
                seq: record.seq,
                boot: Duration::from_nanos(record.stamp.t_boot_ns),
                celsius: frame
                    .pixels
                    .iter()
                    .map(|pixel| f64::from(pixel.get()))
                    .collect(),
            })
        })
        .collect();
    if read.is_empty() {
        return Err(ValidatorError::NoFrames { side: Side::Real });
    }
    let missing = records.len() - read.len();
    if missing > 0 {
        notes.push(format!(
            "{missing} of {} rows of the recording are gaps and were left out.",
            records.len()
        ));
    }
    Ok(read)
}

fn timed(
    read: Vec<Read>,
    protocol: Protocol,
    scene: &Scene,
    options: &Options,
    notes: &mut Vec<String>,
) -> Result<Vec<Timed>, ValidatorError> {
    let first = read.first().map_or(Duration::ZERO, |frame| frame.boot);
    let backwards = read.windows(2).find(|pair| pair[1].boot < pair[0].boot);
    if let (Protocol::Dynamic, Some(pair)) = (protocol, backwards) {
        return Err(ValidatorError::TimeRunsBackwards {
            seq: pair[1].seq,
            by: pair[0].boot - pair[1].boot,
        });
    }
    let mut timed: Vec<Timed> = read
        .into_iter()
        .map(|Read { seq, boot, celsius }| Timed {
            seq,
            time: boot.saturating_sub(first).saturating_add(options.start),
            celsius,
        })
        .collect();
    if protocol == Protocol::Dynamic && !scene.is_static() {
        let (all, end) = (timed.len(), scene.duration());
        timed.retain(|frame| frame.time <= end);
        if timed.is_empty() {
            return Err(ValidatorError::NoOverlap {
                starts: options.start,
                ends: end,
            });
        }
        if timed.len() < all {
            notes.push(format!(
                "{} frames after the end of the scene's walk at {:.1} s were left out.",
                all - timed.len(),
                end.as_secs_f64()
            ));
        }
    }
    Ok(timed)
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
        celsius: timed[index].celsius.clone(),
        later: repeat(timed, index, lag_frames).map(<[f64]>::to_vec),
    };
    chosen
        .into_iter()
        .map(|place| frame(candidates[place]))
        .collect()
}

/// The frame whose number is `lag_frames` higher. A gap, or a new start of the count, between the two leaves none.
fn repeat(timed: &[Timed], index: usize, lag_frames: usize) -> Option<&[f64]> {
    let sought = timed[index]
        .seq
        .checked_add(u64::try_from(lag_frames).ok()?)?;
    let following = timed.get(index + 1..)?;
    let near = following.iter().take(lag_frames);
    near.into_iter()
        .find(|frame| frame.seq == sought)
        .map(|frame| frame.celsius.as_slice())
}

fn simulated(simulator: &Simulator, real: &[RealFrame], seed: u64) -> Vec<SimulatedFrame> {
    let frame = |real: &RealFrame| SimulatedFrame {
        time: real.time,
        celsius: simulator.noisy(real.time, seed).celsius,
        noise_free: simulator.image(real.time).celsius,
        truth: Some(simulator.truth(real.time).foreground(TRUTH_SHARE_MIN)),
    };
    real.iter().map(frame).collect()
}

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
