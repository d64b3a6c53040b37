//! Compares one stream of a recording with what a scene's sensor would see.

use crate::advice::{Compared, Remedy, remedy};
use crate::align::aligner::{Aligner, still_orientation};
use crate::align::clock::Clock;
use crate::align::series::nearest_step_s;
use crate::align::{
    AlignOptions, Alignment, OffsetFound, Orientation, SAMPLE_MAX, SPAN_MAX, TimeAlignment,
};
use crate::compare::scoring::compare_with_prior;
use crate::compare::{Comparison, Settings};
use crate::decision::{Alternative, Decision, How, Image, Recording, Rendered, View, decide};
use crate::error::{ValidatorError, check_resolution, check_setting};
use crate::frames::cleaning::{self, Counts, Read};
use crate::frames::drift::Drift;
use crate::frames::fitted::{FittedShare, fitted};
use crate::frames::timeline::Timeline;
use crate::frames::types::Pixels;
use crate::frames::{LeftOut, Protocol, RealFrame, RoomSource, sensor_step_c};
use crate::numbers::{count, evenly, mean_frame, single};
use crate::scene_comparison::mounting::mounting;
use crate::scene_comparison::notes;
use crate::scene_comparison::rendering::Renderer;
use crate::scene_comparison::types::{
    AlignedFrames, DYNAMIC_FRAMES, KnownUnit, LAG_FRAMES_MAX, Options, STATIC_FRAMES, TimedFrame,
    pixels, prior, seconds,
};
use crate::verdict::types::Prior;
use grideye_frame::{PIXELS, TICK};
use grideye_recording::Record;
use grideye_scene::{Model, Scene, Simulator};
use std::ops::RangeInclusive;
use std::time::Duration;

/// Compares one stream with what a scene's sensor would see: cleaned, drift removed, aligned within [`Options::align`].
///
/// # Errors
/// Unknown sensor, another resolution, no frames, time that goes back, no overlap; stopped by [`Options::is_stopped`]; and
/// those of [`crate::compare()`].
pub fn compare_scene(
    records: &[Record],
    scene: &Scene,
    sensor: &str,
    options: &Options,
) -> Result<Comparison, ValidatorError> {
    compared(records, (scene, sensor), options, &mut Rendered::default())
}

pub(super) fn compared(
    records: &[Record],
    (scene, sensor): (&Scene, &str),
    options: &Options,
    rendered: &mut Rendered,
) -> Result<Comparison, ValidatorError> {
    options.align.check()?;
    let [film, empty] = rendered.own((scene, sensor))?;
    let simulator = film.simulator();
    check_resolution(simulator.sensor())?;
    let protocol = options.protocol.unwrap_or(protocol_of(scene));
    let (read, mut counts) = cleaning::clean(records, protocol == Protocol::Dynamic);
    let timeline = Timeline::new(records, scene, options.start_s)?;
    let fitted = fitted(records, scene);
    let timed = timed(read, protocol, (&timeline, &fitted), &mut counts)?;
    let mut aligned = aligned((timed, timeline), scene, &film, protocol, options);
    within_scene(&mut aligned, scene, protocol, &mut counts)?;
    aligned.found.left_out = counts.list();
    let mut notes = notes::alignment(&aligned.found, records.len(), &timeline);
    let lag_frames = lag(&aligned.frames, protocol, options.lag_frames)?;
    let noise_seed = options.seed.wrapping_add(INDEPENDENCE);
    let mut renderer = Renderer::new(scene, [&film, &empty], &aligned, options);
    let (room, background) = renderer.learned_room(records, &aligned, protocol);
    let fitted = leave_out_fitted(&mut aligned.frames);
    let number = number(protocol, options.frames)?;
    let is_known = background.as_ref().is_none_or(|fit| !fit.is_worse());
    let unit = renderer.unit.filter(|_| is_known);
    // A measured background has the room as the sensor sees it.
    let open = match unit.is_some_and(|unit| unit.has_background) {
        true => Vec::new(),
        false => mounting(scene, sensor, aligned.timeline.start())?,
    };
    let told = open.iter().map(|(told, _)| told);
    notes.extend(told.map(|told| format!("The scene leaves open: {told} by default.")));
    let known = (unit, renderer.open, open);
    let (decision, remedy) = decided(&aligned, (scene, sensor), (known, options), rendered)?;
    let real = chosen(&aligned.frames, lag_frames, number, &mut notes);
    let (pattern, room) = renderer.known(room, background.as_ref(), &timeline, options);
    notes.push(notes::background(&pattern, room.as_ref(), options));
    let is_replaced = pattern.from == RoomSource::Recording;
    let shared = renderer.shared.iter().filter(|_| is_known).cloned();
    let fit = background.as_ref().and_then(|fit| fit.warning(is_replaced));
    let warnings = notes::level(records).into_iter().chain(shared).chain(fit);
    let simulated = renderer.simulated(&real, &aligned, noise_seed);
    let laws = scene.laws().source.into_iter();
    notes.extend(laws.map(|law| format!("The scene leaves open: {law}.")));
    notes.extend(protocol_notes(protocol, scene));
    let noise_c = simulator.sensor().noise_sigma;
    notes.push(format!(
        "The simulated noise has the seed {noise_seed} and σ {noise_c:.2} °C."
    ));
    let settings = settings((scene, simulator), protocol, lag_frames, options);
    let prior = Prior {
        left_out: aligned.found.left_out.clone(),
        has_people: !scene.agents().is_empty(),
        drift_c: drift_c(&aligned, &decision, options),
        decision: Some(decision),
        remedy,
        turned: aligned.found.turned(),
        fitted: (!scene.calibrated().is_empty()).then_some(fitted),
        ..prior(records, simulator, pattern, options)
    };
    let comparison = compare_with_prior(&real, &simulated, &settings, &prior)?;
    notes.extend(aligned.found.orientation.as_ref().and_then(|lies| {
        let turned = Alternative::Turned(lies.orientation);
        let mut all = prior.decision.iter().flat_map(|one| &one.alternatives);
        notes::orientation(lies, all.any(|one| one.of == turned && one.likeness < 0.0))
    }));
    Ok(Comparison {
        warnings: warnings.collect(),
        background,
        notes,
        alignment: Some(aligned.found),
        ..comparison
    })
}

fn protocol_of(scene: &Scene) -> Protocol {
    match scene.is_static() {
        true => Protocol::Static,
        false => Protocol::Dynamic,
    }
}

/// What is known of the unit, the pixels of which the room is not known, and what is open of its mounting.
type Known = (Option<KnownUnit>, [bool; PIXELS], Vec<(String, Image)>);

/// Whether the recording is the scene's, by its own clock: alignment is for the scores. A profile that the recording
/// contradicts is not used.
fn decided(
    aligned: &AlignedFrames,
    (scene, sensor): (&Scene, &str),
    ((unit, is_open, open), options): (Known, &Options),
    rendered: &mut Rendered,
) -> Result<(Decision, Option<Remedy>), ValidatorError> {
    let laws = scene.laws();
    let spread_c = laws
        .background_sd_c
        .unwrap_or(options.thresholds.background_spread_c);
    let (known_c, unknown_c) = match unit {
        None => ([0.0; PIXELS], spread_c),
        Some(unit) if unit.has_background => (unit.pattern_c, unit.spread_c),
        Some(unit) => (unit.pattern_c, unit.spread_c.hypot(spread_c)),
    };
    let frames = aligned.frames.iter();
    let times_s: Vec<f64> = frames
        .clone()
        .map(|frame| frame.time.as_secs_f64())
        .collect();
    let frames = frames
        .map(|frame| std::array::from_fn(|pixel| single(frame.celsius[pixel] - known_c[pixel])));
    let frames: Vec<_> = frames.collect();
    let unknown_c = is_open.map(|is_open| {
        let unknown_c = unknown_c.max(PROFILE_ERROR_C);
        single(if is_open {
            unknown_c.max(spread_c)
        } else {
            unknown_c
        })
    });
    let mut recording = Recording::new(&times_s, &frames, unknown_c, sensor_step_c());
    recording.unit.open = open;
    let before = std::mem::take(rendered);
    let of = (scene, sensor);
    let mut view = View::after(before, of, &recording.times_s, recording.within_s)?;
    let right_min = options.thresholds.right_min;
    let how = How {
        right_min,
        is_brief: false,
        is_stopped: options.is_stopped,
    };
    let decision = decide(&mut view, &recording, &laws, how).ok_or(ValidatorError::Stopped)?;
    let level_max_c = unit.map_or(options.thresholds.offset_max_c, |unit| {
        unit.level_c(&options.thresholds)
    });
    // Where nobody is, no change of the scene's people is the cause.
    let level_c = view.level_c(&recording.pictures);
    let asks = level_c.abs() > level_max_c || decision.is_refused(right_min) && !decision.is_empty;
    if !(options.advises && asks) {
        *rendered = view.into_rendered();
        return Ok((decision, None));
    }
    let compared = Compared {
        scene,
        sensor,
        recording: &recording,
        laws: &laws,
        how: How {
            is_brief: true,
            ..how
        },
        start_s: aligned.timeline.start_s(),
        level_max_c,
        level_c,
        same: decision.alike(),
        contrasts: decision.contrasts.iter().map(|one| one.found).collect(),
    };
    let remedy = remedy(&compared, view, rendered)?;
    Ok((decision, remedy))
}

/// A measured background changes by this much from one recording to the next, °C: with the air, and what stands there.
const PROFILE_ERROR_C: f64 = 0.12;

/// The drift, and the largest that is no fault.
fn drift_c(aligned: &AlignedFrames, decision: &Decision, options: &Options) -> [f64; 2] {
    let thresholds = &options.thresholds;
    let times = || aligned.frames.iter().map(|frame| frame.time);
    let span = times()
        .max()
        .unwrap_or_default()
        .saturating_sub(times().min().unwrap_or_default());
    let minutes = span.as_secs_f64() / 60.0;
    [
        aligned.found.drift_c + decision.drift_c,
        thresholds.drift_max_c + minutes * thresholds.drift_max_c_per_min,
    ]
}

/// Separates this simulation's noise from that of a recording simulated with the same seed (golden ratio, as in
/// `SplitMix64`).
const INDEPENDENCE: u64 = 0x9E37_79B9_7F4A_7C15;

fn timed(
    read: Vec<Read>,
    protocol: Protocol,
    (timeline, fitted): (&Timeline, &[RangeInclusive<u64>]),
    counts: &mut Counts,
) -> Result<Vec<TimedFrame>, ValidatorError> {
    let backwards = read
        .windows(2)
        .find(|pair| pair[1].boot_ns < pair[0].boot_ns);
    if let (Protocol::Dynamic, Some(pair)) = (protocol, backwards) {
        return Err(ValidatorError::Refused(format!(
            "time goes back by {:?} at frame {} of the recording\nhint: compare the parts before and after it separately",
            Duration::from_nanos(pair[0].boot_ns - pair[1].boot_ns),
            pair[1].seq
        )));
    }
    let nothing = match read.is_empty() {
        true => ValidatorError::no_frames("real"),
        false => ValidatorError::Refused(
            "the recording ends before the scene begins\nhint: give a later start".to_owned(),
        ),
    };
    let mut timed = Vec::with_capacity(read.len());
    for Read {
        seq,
        boot_ns,
        celsius,
    } in read
    {
        let time = match (timeline.time(boot_ns), protocol) {
            (None, Protocol::Dynamic) => {
                counts.add(LeftOut::OutsideScene, seq);
                continue;
            }
            (time, _) => time.unwrap_or_else(|| timeline.start()),
        };
        timed.push(TimedFrame {
            seq,
            time,
            celsius,
            is_fitted: fitted.iter().any(|range| range.contains(&boot_ns)),
        });
    }
    if timed.is_empty() {
        return Err(nothing);
    }
    Ok(timed)
}

fn aligned(
    (frames, timeline): (Vec<TimedFrame>, Timeline),
    scene: &Scene,
    film: &grideye_scene::Film,
    protocol: Protocol,
    options: &Options,
) -> AlignedFrames {
    let moves = protocol == Protocol::Dynamic && !scene.is_static();
    let mut aligned = if moves {
        moving((frames, timeline), film, scene, &options.align)
    } else {
        still((frames, timeline), film, &options.align)
    };
    let drift = drift(&aligned, film);
    aligned.found.drift_c = drift.range_c();
    let turned_back = aligned.found.turned().inverse();
    for frame in &mut aligned.frames {
        let by_c = drift.at(frame.time.as_secs_f64());
        frame.celsius = turned_back.apply(&frame.celsius.map(|celsius| celsius - by_c));
    }
    aligned
}

fn moving(
    (frames, timeline): (Vec<TimedFrame>, Timeline),
    film: &grideye_scene::Film,
    scene: &Scene,
    options: &AlignOptions,
) -> AlignedFrames {
    let (times_s, sample) = sample(&frames, SPAN_MAX);
    let end_s = scene.duration().as_secs_f64();
    let aligner = Aligner::new(film, end_s, times_s, sample, options);
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
    let offset = aligner.offset(&clock);
    found.offset = offset.map(|offset| OffsetFound {
        applied: options.pose,
        ..offset
    });
    AlignedFrames {
        frames,
        timeline,
        clock,
        found,
    }
}

fn still(
    (frames, timeline): (Vec<TimedFrame>, Timeline),
    film: &grideye_scene::Film,
    options: &AlignOptions,
) -> AlignedFrames {
    let (_, sample) = sample(&frames, Duration::MAX);
    let mean = pixels(&mean_frame(&sample));
    let time = frames.first().map(|frame| frame.time).unwrap_or_default();
    let claim = pixels(&film.image(time).celsius);
    let mut found = Alignment {
        orientation: still_orientation(&mean, &claim),
        ..Alignment::default()
    };
    turned(&mut found, options);
    AlignedFrames {
        frames,
        timeline,
        clock: Clock::own(),
        found,
    }
}

fn sample(frames: &[TimedFrame], span: Duration) -> (Vec<f64>, Vec<Pixels>) {
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

/// Marks the orientation as applied if requested, and returns the one to undo.
fn turned(found: &mut Alignment, options: &AlignOptions) -> Orientation {
    match &mut found.orientation {
        Some(orientation) if options.orientation => {
            orientation.applied = orientation.orientation != Orientation::Upright;
            orientation.orientation
        }
        _ => Orientation::Upright,
    }
}

/// The slow common drift against the scene at the aligned times.
fn drift(aligned: &AlignedFrames, film: &grideye_scene::Film) -> Drift {
    let chosen = evenly(aligned.frames.len(), SAMPLE_MAX);
    let (times_s, left): (Vec<f64>, Vec<Pixels>) = chosen
        .into_iter()
        .map(|index| {
            let frame = &aligned.frames[index];
            let time_s = frame.time.as_secs_f64();
            let scene_s = nearest_step_s(aligned.clock.scene_s(time_s));
            let claim = film.image(seconds(scene_s)).celsius;
            let left = std::array::from_fn(|pixel| frame.celsius[pixel] - claim[pixel]);
            (time_s, left)
        })
        .unzip();
    Drift::new(&times_s, &left)
}

fn within_scene(
    aligned: &mut AlignedFrames,
    scene: &Scene,
    protocol: Protocol,
    counts: &mut Counts,
) -> Result<(), ValidatorError> {
    if protocol == Protocol::Static || scene.is_static() {
        return Ok(());
    }
    let (end, clock) = (scene.duration(), aligned.clock);
    // Rounding must not cost the last frame of a walk that ends on it.
    let times_s = -1e-6..=end.as_secs_f64() + 1e-6;
    aligned.frames.retain(|frame| {
        let is_within = times_s.contains(&clock.scene_s(frame.time.as_secs_f64()));
        if !is_within {
            counts.add(LeftOut::OutsideScene, frame.seq);
        }
        is_within
    });
    if aligned.frames.is_empty() {
        return Err(ValidatorError::Refused(format!(
            "the recording begins {:?} into the scene, which ends after {end:?}\nhint: give an earlier start",
            aligned.timeline.start()
        )));
    }
    Ok(())
}

/// Keeps the frames to judge the scene by; all of them if too few are others than those it was fitted to.
fn leave_out_fitted(frames: &mut Vec<TimedFrame>) -> FittedShare {
    let share = FittedShare {
        fitted: frames.iter().filter(|frame| frame.is_fitted).count(),
        of: frames.len(),
    };
    if share.leaves_enough() {
        frames.retain(|frame| !frame.is_fitted);
    }
    share
}

fn protocol_notes(protocol: Protocol, scene: &Scene) -> impl Iterator<Item = String> {
    let why = if scene.is_static() {
        "nothing moves in the scene"
    } else {
        "the scene's agent moves"
    };
    let note = match protocol {
        Protocol::Static => format!(
            "Every real frame is compared with every simulated one (static protocol; {why})."
        ),
        Protocol::Dynamic => {
            format!("Frames are compared one by one at equal times (dynamic protocol; {why}).")
        }
    };
    std::iter::once(note).chain(notes::model(scene))
}

fn settings(
    (scene, simulator): (&Scene, &Simulator),
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
        shuffles: options.shuffles,
        seed: options.seed,
        thresholds: options.thresholds,
        model: match scene.model() {
            Model::Paper => "paper",
            Model::PaperGrid => "paper-grid",
            Model::Physical => "physical",
        },
        ..defaults
    }
}

/// Delay of the repeat under the dynamic protocol: new noise, but too short to walk away.
const DYNAMIC_LAG: Duration = TICK;
const STATIC_LAG_FRAMES: usize = 3;

pub(crate) fn lag(
    timed: &[TimedFrame],
    protocol: Protocol,
    asked: Option<usize>,
) -> Result<usize, ValidatorError> {
    let lag = match (asked, protocol) {
        (Some(asked), _) => asked,
        (None, Protocol::Static) => STATIC_LAG_FRAMES,
        (None, Protocol::Dynamic) => period(timed).map_or(STATIC_LAG_FRAMES, lag_of_period),
    };
    let is_lag = (1..=LAG_FRAMES_MAX).contains(&lag);
    let expected = "a number from 1 to 600";
    check_setting(is_lag, "lag_frames", expected, count(lag))?;
    Ok(lag)
}

fn period(timed: &[TimedFrame]) -> Option<Duration> {
    let (first, last) = (timed.first()?, timed.last()?);
    let frames = u32::try_from(last.seq.checked_sub(first.seq)?).ok()?;
    (last.time.saturating_sub(first.time)).checked_div(frames)
}

/// The lag of 1 to 600 frames nearest to [`DYNAMIC_LAG`].
fn lag_of_period(period: Duration) -> usize {
    if period.is_zero() {
        return STATIC_LAG_FRAMES;
    }
    let frames = (DYNAMIC_LAG + period / 2).as_nanos() / period.as_nanos();
    usize::try_from(frames)
        .unwrap_or(LAG_FRAMES_MAX)
        .clamp(1, LAG_FRAMES_MAX)
}

pub(crate) fn number(protocol: Protocol, asked: Option<usize>) -> Result<usize, ValidatorError> {
    check_setting(asked != Some(0), "frames", "a number above zero", 0.0)?;
    Ok(asked.unwrap_or(match protocol {
        Protocol::Static => STATIC_FRAMES,
        Protocol::Dynamic => DYNAMIC_FRAMES,
    }))
}

/// Chooses evenly among the frames with a repeat, or among all if fewer than two have one.
pub(crate) fn chosen(
    timed: &[TimedFrame],
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
        "{} of {} frames read are compared, chosen evenly over the recording.",
        chosen.len(),
        timed.len()
    ));
    let frame = |index: usize| RealFrame {
        time: timed[index].time,
        celsius: timed[index].celsius,
        later: repeat(timed, index, lag_frames).copied(),
    };
    let chosen = chosen.into_iter();
    chosen.map(|place| frame(candidates[place])).collect()
}

/// The frame with a sequence number `lag_frames` higher; `None` across a gap or a restarted count.
fn repeat(timed: &[TimedFrame], index: usize, lag_frames: usize) -> Option<&Pixels> {
    let lag = u64::try_from(lag_frames).ok()?;
    let sought = timed[index].seq.checked_add(lag)?;
    let mut near = timed.get(index + 1..)?.iter().take(lag_frames);
    near.find(|frame| frame.seq == sought)
        .map(|frame| &frame.celsius)
}
