//! `grideye demo`: the whole loop on one computer.
//!
//! Only sensor and bus are emulated. Agent, HTTP on a loopback address, collector, store, page, comparison and report are the
//! real ones.

use crate::cli::Demo;
use crate::exit::{Outcome, bad_input};
use crate::output::outln;
use crate::stage::{Stage, open_in_browser};
use crate::{collect, compare, files, progress, recordings};
use amg8833_emulator::{Address, Bus};
use anyhow::{Context as _, Result, anyhow};
use grideye_agent::agent::{Agent, AgentHandle, AnyBus, Start};
use grideye_agent::config::Config as AgentConfig;
use grideye_agent::log::{Level, Log};
use grideye_collector::{Account, Counting};
use grideye_frame::{RecordedFrame, TICK};
use grideye_inputs::{SceneText, hashed, hashed_text};
use grideye_recording::{Record, Row};
use grideye_rig::{
    AgentClock, PacedClock, Replayed, SharedBus, Source, replay_source, scene_source,
};
use grideye_studio::{Demonstration, Recorded};
use grideye_validator::compare_scene;
use grideye_validator::report::{self, Context, Input};
use grideye_validator::thresholds::ThresholdSet;
use indicatif::ProgressBar;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

pub(crate) fn run(options: &Demo) -> Result<Outcome> {
    files::writable_folder(&options.out)?;
    let show = Show::prepare(options)?;
    keep_apart(options, &show)?;
    let demonstration = show.scene().map(|shown| &shown.demonstration);
    let annexes = collect::annexes(&options.page.scenes, demonstration)?;
    let stage = Stage::open(
        options.page.listen,
        options.out.join(STORE),
        annexes,
        Some(Counting::default()),
    )?;
    progress::say(&format!("live page  {}", stage.page()));
    files::warned(show.scene().map_or(&[][..], |shown| &shown.warnings));
    if options.page.open {
        open_in_browser(&stage.page());
    }
    let (delivered, agent) = stage.perform(options, show.frames(), show.source(options.seed)?)?;
    let Some(delivered) = delivered else {
        progress::say("interrupted before the recording was complete");
        return Ok(Outcome::NoAnswer);
    };
    let outcome = conclude(options, &show, &stage, &delivered)?;
    if options.once {
        return Ok(outcome);
    }
    progress::say("the live page stays until Ctrl-C");
    stage.wait_for_interrupt();
    drop(agent);
    Ok(Outcome::Done)
}

const RECORDING: &str = "recording.csv";
const PAGE: &str = "report.html";
const JSON: &str = "report.json";

/// An input may be in the output folder, but not under a name that the demo writes.
fn keep_apart(options: &Demo, show: &Show) -> Result<()> {
    let written = [RECORDING, PAGE, JSON, STORE].map(|name| options.out.join(name));
    let files = show.scene().map_or(&[][..], |shown| &shown.files);
    files::keep_apart(files.iter().chain(&options.replay), &written)
}

fn conclude(options: &Demo, show: &Show, stage: &Stage, delivered: &Delivered) -> Result<Outcome> {
    let path = options.out.join(RECORDING);
    files::write_whole(&path, |out| stage.client.download_csv(delivered.id, out))?;
    let rows: Vec<Row> = recordings::open(&path)?.collect::<Result<_>>()?;
    let (line, outcome, result) = match show {
        Show::Scene(scene) => judge_scene(options, scene, delivered, &path, &rows)?,
        Show::Replay(frames) => {
            let replayed = Replayed::new(frames, &rows);
            let outcome = match replayed.is_equal() {
                true => Outcome::Done,
                false => Outcome::Disagrees,
            };
            let result = format!("recording {}", path.display());
            (format!("replay    {replayed}"), outcome, result)
        }
    };
    let audit = stage.audit(delivered)?;
    let is_whole = audit.balanced == Some(true) && audit.is_whole();
    outln!("delivery  {audit}")?;
    outln!("{line}")?;
    let closed = if options.once { " (closed now)" } else { "" };
    outln!("page      {}{closed}   {result}", stage.page())?;
    Ok(if is_whole || outcome == Outcome::Disagrees {
        outcome
    } else {
        Outcome::NoAnswer
    })
}

type Judged = (String, Outcome, String);

fn judge_scene(
    options: &Demo,
    shown: &SceneShow,
    delivered: &Delivered,
    recording: &Path,
    rows: &[Row],
) -> Result<Judged> {
    let once = rows.iter().take(delivered.frames);
    let records: Vec<Record> = once.map(|row| row.record).collect();
    let seed = options.seed.wrapping_add(1);
    let how = compare::how(seed);
    let Demonstration { scene, sensor, .. } = &shown.demonstration;
    let comparison = compare_scene(&records, scene, sensor, &how).map_err(bad_input)?;
    let context = Context {
        scene: shown.origin.clone(),
        recording: recording.display().to_string(),
        sensor: sensor.clone(),
        seeds: vec![("emulated sensor".to_owned(), options.seed), ("simulation".to_owned(), seed)],
        inputs: [shown.inputs.clone(), vec![hashed(recording).map_err(bad_input)?]].concat(),
        assumptions: [shown.warnings.clone(), vec![
            "The recording comes from an emulated sensor in the same scene, not from a real one: the scores show that the loop is whole, not that the simulator is right.".to_owned(),
        ]].concat(),
        experiment: shown.experiment,
        thresholds: ThresholdSet::shipped().lines,
        room: grideye_inputs::room(scene, sensor, &comparison),
        ..compare::context()
    };
    let page = options.out.join(PAGE);
    let html = report::html(&comparison, &context);
    files::write_text(&page, &html)?;
    let json = options.out.join(JSON);
    files::write_text(&json, &report::json(&comparison, &context))?;
    let line = format!(
        "verdict   {}\nscores    {}",
        comparison.judgment.headline,
        report::scores_line(&comparison, shown.experiment)
    );
    let recorded = Recorded {
        recording: delivered.id,
        name: delivered.name.clone(),
        frames: rows.len(),
        report: html,
    };
    // The only recording of this program.
    let _first = shown.demonstration.recorded.set(recorded);
    Ok((
        line,
        compare::outcome(comparison.judgment.verdict),
        format!("report {}", page.display()),
    ))
}

/// The scene that is shown unless another is named, and the file beside it.
const NAME: &str = "living-room";
const SCENE: &str = include_str!("../../../scenes/living-room.toml");
const WAYS: [(&str, &str); 1] = [(
    "trajectories/living-room.csv",
    include_str!("../../../scenes/trajectories/living-room.csv"),
)];
/// Frames recorded in a static scene: ten seconds.
const STATIC_FRAMES: u64 = 100;
const FRAMES_MAX: u64 = 6_000;

enum Show {
    Scene(Box<SceneShow>),
    Replay(Vec<RecordedFrame>),
}

struct SceneShow {
    demonstration: Demonstration,
    /// The path of the scene file, also of the built-in one.
    origin: String,
    inputs: Vec<Input>,
    files: Vec<PathBuf>,
    warnings: Vec<String>,
    experiment: Option<u8>,
}

impl Show {
    fn prepare(options: &Demo) -> Result<Self> {
        if let Some(path) = &options.replay {
            let records = recordings::load_stream(path)?;
            recordings::say_what_stands_for_the_thermistor(&records);
            let frames = records
                .iter()
                .filter_map(|record| record.reading.frame().copied());
            return Ok(Self::Replay(frames.collect()));
        }
        let loaded = match &options.scene {
            Some(path) => grideye_inputs::scene(None, path),
            None => SceneText::built_in(NAME, SCENE, &WAYS).parse(None),
        };
        let loaded = loaded.map_err(bad_input)?;
        let scene = loaded.scene;
        let sensor = files::sensor_name(&scene, options.sensor.as_deref())?;
        let files = loaded.files.iter();
        let inputs = files
            .map(|path| hashed(path))
            .collect::<Result<Vec<_>, _>>();
        let mut inputs = inputs.map_err(bad_input)?;
        let origin = match &options.scene {
            Some(path) => path.display().to_string(),
            None => {
                let beside = WAYS.map(|(name, text)| (format!("scenes/{name}"), text));
                let own = (format!("scenes/{NAME}.toml"), SCENE);
                let held = std::iter::once(own.clone()).chain(beside);
                inputs.extend(held.map(|(name, text)| hashed_text(&name, text)));
                own.0
            }
        };
        let experiment = scene.paper_experiment();
        let demonstration = Demonstration {
            name: files::stem(Path::new(&origin)),
            title: format!("The emulated sensor sees this scene, {origin}."),
            scene,
            sensor,
            recorded: Arc::default(),
        };
        Ok(Self::Scene(Box::new(SceneShow {
            demonstration,
            origin,
            inputs,
            files: loaded.files,
            warnings: loaded.warnings,
            experiment,
        })))
    }

    fn scene(&self) -> Option<&SceneShow> {
        match self {
            Self::Scene(shown) => Some(shown),
            Self::Replay(_) => None,
        }
    }

    fn frames(&self) -> u64 {
        match self {
            Self::Scene(shown) if shown.demonstration.scene.is_static() => STATIC_FRAMES,
            // Once through: its end is the beginning of the next round.
            Self::Scene(shown) => {
                let (scene, tick) = (&shown.demonstration.scene, TICK.as_nanos());
                let ticks = u64::try_from(scene.duration().as_nanos().div_ceil(tick));
                ticks.map_or(FRAMES_MAX, |frames| frames.min(FRAMES_MAX))
            }
            Self::Replay(frames) => u64::try_from(frames.len()).unwrap_or(u64::MAX),
        }
    }

    fn source(&self, seed: u64) -> Result<Source> {
        match self {
            Self::Scene(shown) => {
                let Demonstration { scene, sensor, .. } = &shown.demonstration;
                let simulator = files::simulator(scene, Some(sensor))?;
                scene_source(scene, simulator, seed).map_err(bad_input)
            }
            Self::Replay(frames) => Ok(replay_source(frames)),
        }
    }
}

const DEVICE: &str = "demo";
/// The bus name that the agent reports.
const BUS: &str = "/dev/i2c-1";
const STORE: &str = "store.sqlite";
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// The demo fails after this long without a new frame.
const STALL_MAX: Duration = Duration::from_secs(30);
/// Longest wait for the last frames to be acknowledged.
const FLUSH_MAX: Duration = Duration::from_secs(20);

/// A recording that is complete on the collector's disk.
struct Delivered {
    id: i64,
    name: String,
    /// The boot of its frames.
    boot: String,
    /// Those that were asked for; a few more may have come.
    frames: usize,
}

impl Stage {
    /// Records the show; `None` after Ctrl-C. The agent keeps running unless it has nothing left to read.
    fn perform(
        &self,
        options: &Demo,
        frames: u64,
        source: Source,
    ) -> Result<(Option<Delivered>, Option<AgentHandle>)> {
        // The agent stops at the limit, so that the recording has exactly these frames.
        let has_an_end = options.once || options.replay.is_some();
        let start = Start {
            frames_limit: has_an_end.then_some(frames),
            ..Start::new(self.agent_config()?, DEVICE)
        };
        let boot = start.boot.clone();
        let name = format!("demo-{boot}");
        let id = self.client.start_recording(&name)?.id;
        let clock = Arc::new(PacedClock::new(options.speed));
        let bus = Bus::with_sensor(Arc::clone(&clock), Address::High, source);
        let bus = SharedBus::new(bus);
        let agent = start_agent(start, &bus, clock)?;
        let bar = progress::bar(frames, "recording");
        let is_complete = self.watch(&agent, frames, &bar)?;
        bar.finish_and_clear();
        say_traffic(&bus, frames);
        let agent = if has_an_end || !is_complete {
            let _summary = agent.stop(FLUSH_MAX);
            None
        } else {
            Some(agent)
        };
        self.client.stop_recording(id)?;
        let delivered = Delivered {
            id,
            name,
            boot,
            frames: usize::try_from(frames).unwrap_or(usize::MAX),
        };
        Ok((is_complete.then_some(delivered), agent))
    }

    fn audit(&self, delivered: &Delivered) -> Result<Account> {
        let rows = self.client.audit()?.streams;
        let row = rows.into_iter().find(|row| row.boot == delivered.boot);
        row.ok_or_else(|| anyhow!("the collector has no frames of this boot"))
    }

    fn agent_config(&self) -> Result<AgentConfig> {
        let text = format!(
            "device = \"{DEVICE}\"\ncollector = \"http://{}\"\n[[bus]]\npath = \"{BUS}\"\n[[bus.sensor]]\naddress = 0x69\n",
            self.address
        );
        AgentConfig::parse(&text, "the demonstration's own configuration")
            .context("cannot configure the agent")
    }

    /// Whether all frames were delivered; false after Ctrl-C.
    fn watch(&self, agent: &AgentHandle, frames: u64, bar: &ProgressBar) -> Result<bool> {
        let (mut seen, mut since) = (0, Instant::now());
        loop {
            let (mut read, mut delivered) = (0, 0);
            for account in agent.accounts().values() {
                let waiting = account.spooled + account.dropped.values().sum::<u64>();
                read += account.read;
                delivered += account.read.saturating_sub(waiting);
            }
            bar.set_position(read.min(frames));
            if agent.is_finished() || delivered >= frames {
                return Ok(true);
            }
            if *self.interrupted.borrow() {
                return Ok(false);
            }
            if read > seen {
                (seen, since) = (read, Instant::now());
            } else if since.elapsed() > STALL_MAX {
                let seconds = STALL_MAX.as_secs();
                return Err(anyhow!(
                    "no new frame for {seconds} s; {read} of {frames} were read"
                ));
            }
            std::thread::sleep(LOOK_EVERY);
        }
    }
}

fn start_agent(start: Start, bus: &SharedBus, clock: Arc<PacedClock>) -> Result<AgentHandle> {
    let bus_config = start.config.buses.first().cloned();
    let bus_config = bus_config.context("the demonstration has one bus")?;
    let log = Log::new(|level, line| {
        if level > Level::Info {
            progress::say(&format!("agent: {}: {line}", level.name()));
        }
    });
    let clock = Arc::new(AgentClock::new(clock));
    let buses = vec![(bus_config, AnyBus::new(bus.clone()))];
    Ok(Agent::start(start, buses, clock, log)?)
}

fn say_traffic(bus: &SharedBus, frames: u64) {
    let traffic = bus.with(|bus| bus.traffic());
    if let Some(bytes) = traffic.bytes.checked_div(frames) {
        progress::say(&format!(
            "bus        {} transactions, {bytes} bytes per recorded frame (including polls for the next update)",
            traffic.transactions
        ));
    }
}
