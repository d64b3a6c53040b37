//! Compares the last seconds of a sensor with a scene, once for all pages that ask.

use super::window::{Laid, Window, window};
use crate::catalogue::{LoadedScene, SceneEntry};
use crate::queue::Queue;
use crate::recently::Recently;
use axum::http::StatusCode;
use grideye_collector::store::{RecordingId, Span};
use grideye_collector::{Inside, Refusal};
use grideye_recording::Record;
use grideye_scene::Scene;
use grideye_validator::report::{self, Context};
use grideye_validator::{Joined, KnownScene, Options, Timeline};
use serde::Deserialize;
use serde_json::{Value, json};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Seconds compared: minimum, maximum and default.
const SECONDS: (f64, f64, f64) = (2.0, 60.0, 10.0);
/// Maximum frames of a recording examined before the requested one.
const FRAMES_MAX: u64 = 1200;
/// A comparison of a running sensor is computed again no sooner than this, …
pub(super) const AGAIN_AFTER_MIN: Duration = Duration::from_secs(2);
/// … nor before this many times its own computing time.
const REST: u32 = 3;
/// Comparisons in the cache.
const KEPT_MAX: usize = 64;
/// Scenes whose people stay rendered: some megabytes each.
const KNOWN_MAX: usize = 4;
const SEED: u64 = 2;

/// A page's question: which frames, and where the scene lies on their time axis.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Question {
    /// The device, and in `of` its sensor.
    device: String,
    of: String,
    /// The device's boot clock at the scene's start; a static scene needs none.
    origin_ns: Option<u64>,
    seconds: Option<f64>,
    /// Take the frames of this recording instead of recent ones, …
    recording: Option<i64>,
    /// … of this boot, …
    boot: Option<String>,
    /// … up to this number.
    through_seq: Option<u64>,
}

/// Scene, its edition, its sensor, and the question.
type Key = (String, u64, String, Question);
type Slot = Arc<tokio::sync::Mutex<Option<Made>>>;
/// By scene, its edition, and its sensor.
type Known = Recently<(String, u64, String), Arc<Mutex<KnownScene>>>;

pub(super) struct Verdicts {
    queue: Arc<Queue>,
    slots: Recently<Key, Slot>,
    known: Known,
}

#[derive(Clone)]
struct Made {
    at: Duration,
    took: Duration,
    newest_seq: Option<u64>,
    answer: Value,
}

impl Verdicts {
    pub(super) fn new() -> Self {
        Self {
            queue: Arc::new(Queue::new()),
            slots: Recently::new(KEPT_MAX),
            known: Recently::new(KNOWN_MAX),
        }
    }

    /// Answers a question; a comparison just computed serves all pages, but for frames that were sent with the question.
    pub(super) async fn answer(
        &self,
        inside: &Inside,
        (scene, sensor): (Arc<SceneEntry>, String),
        question: Question,
        sent: Option<Vec<Record>>,
    ) -> Result<Value, Refusal> {
        let loaded = scene.usable()?;
        check_origin(loaded, &question)?;
        let length = length(question.seconds)?;
        let key = (
            scene.name.clone(),
            scene.edition,
            sensor.clone(),
            question.clone(),
        );
        // What is live changes before advice is there.
        let advises = sent.is_some() || question.recording.is_some();
        let slot = match &sent {
            Some(_) => Slot::default(),
            None => self.slots.get_or(key, |_| Slot::default()),
        };
        // A page with the same question waits here, and finds it computed.
        let mut made = slot.lock().await;
        if let Some(made) = made.as_ref().filter(|made| made.is_new(inside)) {
            return Ok(made.answer.clone());
        }
        let records = match sent {
            Some(sent) => sent,
            None => records(inside, &question).await?,
        };
        let newest_seq = records.last().map(|record| record.seq);
        if let Some(made) = made.as_mut().filter(|made| made.newest_seq == newest_seq) {
            made.at = inside.clock.monotonic();
            return Ok(made.answer.clone());
        }
        let clock = Arc::clone(&inside.clock);
        let known = self.known(&scene, loaded, sensor);
        let fresh = self.queue.run(move || {
            let began = clock.monotonic();
            let answer = compared(&scene, &known, &question, (&records, length), advises);
            let at = clock.monotonic();
            Made {
                at,
                took: at.saturating_sub(began),
                newest_seq,
                answer,
            }
        });
        let fresh = fresh.await?;
        *made = Some(fresh.clone());
        Ok(fresh.answer)
    }

    fn known(
        &self,
        of: &SceneEntry,
        loaded: &LoadedScene,
        sensor: String,
    ) -> Arc<Mutex<KnownScene>> {
        let key = (of.name.clone(), of.edition, sensor);
        self.known.get_or(key, |(_, _, sensor)| {
            let known = KnownScene::new(loaded.scene.clone(), sensor);
            Arc::new(Mutex::new(known))
        })
    }
}

impl Made {
    fn is_new(&self, inside: &Inside) -> bool {
        let rest = AGAIN_AFTER_MIN.max(REST * self.took);
        inside.clock.monotonic().saturating_sub(self.at) < rest
    }
}

fn check_origin(loaded: &LoadedScene, question: &Question) -> Result<(), Refusal> {
    let scene = &loaded.scene;
    if scene.is_static() || scene.starts_utc().is_some() || question.origin_ns.is_some() {
        return Ok(());
    }
    let what = "this scene moves, so its start time is needed";
    let refusal = Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, "no_origin_ns", what);
    Err(refusal
        .field("origin_ns")
        .hint("add origin_ns, the device's boot clock at the scene's start in nanoseconds"))
}

/// By UTC if scene and device know it, else from the question's origin.
fn laid(scene: &Scene, question: &Question, records: &[Record]) -> Result<Laid, String> {
    if scene.is_static() {
        return Ok(Laid::Anywhere);
    }
    let takes = scene.duration();
    let timeline = Timeline::new(records, scene, None).map_err(|apart| apart.to_string())?;
    let timeline = match (timeline.joined(), question.origin_ns) {
        (Joined::Utc, _) => timeline,
        (_, Some(origin_ns)) => Timeline::from_boot(origin_ns),
        (_, None) => return Err("no frame with a set clock has arrived yet".to_owned()),
    };
    Ok(Laid::At { timeline, takes })
}

fn length(seconds: Option<f64>) -> Result<Duration, Refusal> {
    let (least, most, usual) = SECONDS;
    let seconds = seconds.unwrap_or(usual);
    if !(least..=most).contains(&seconds) {
        let what = format!("expected seconds from {least} to {most}, found {seconds}");
        let refusal = Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, "wrong_value", what);
        return Err(refusal.field("seconds"));
    }
    Ok(Duration::from_secs_f64(seconds))
}

/// The requested frames, oldest first; none if none are known.
async fn records(inside: &Inside, question: &Question) -> Result<Vec<Record>, Refusal> {
    let Some(id) = question.recording else {
        let recent = inside.recent.of(&question.device, &question.of);
        return Ok(recent.map(|(_, records)| records).unwrap_or_default());
    };
    let members = inside.store.members(RecordingId(id)).await?;
    let is_meant = |span: &Span| {
        let stream = &span.stream;
        let boot = question.boot.as_ref();
        stream.device == question.device
            && stream.sensor == question.of
            && boot.is_none_or(|boot| stream.boot == *boot)
    };
    let span = members.spans.into_iter().find(is_meant).ok_or_else(|| {
        let what = format!("recording {id} has no frames of this sensor and boot");
        Refusal::new(StatusCode::NOT_FOUND, "no_such_stream", what).field("of")
    })?;
    let through = question.through_seq.unwrap_or(u64::MAX);
    let after = through
        .checked_sub(FRAMES_MAX)
        .filter(|_| question.through_seq.is_some());
    let rows = usize::try_from(FRAMES_MAX).unwrap_or(usize::MAX);
    let stored = inside.store.page(span, after, rows).await?;
    let records = stored.into_iter().map(|stored| stored.record);
    Ok(records.filter(|record| record.seq <= through).collect())
}

/// The comparison of a window of frames, or why there is none.
fn compared(
    scene: &SceneEntry,
    known: &Mutex<KnownScene>,
    question: &Question,
    (records, length): (&[Record], Duration),
    advises: bool,
) -> Value {
    let none = |why: &str| json!({ "why": why, "comparison": null });
    let Ok(loaded) = &scene.loaded else {
        return none("the scene cannot be used");
    };
    let laid = match laid(&loaded.scene, question, records) {
        Ok(laid) => laid,
        Err(why) => return none(&why),
    };
    let Some(Window {
        records,
        start,
        length,
    }) = window(records, laid, length)
    else {
        return none("no frame from the time of the scene has arrived yet");
    };
    let origin_ns = match laid {
        Laid::Anywhere => None,
        Laid::At { timeline, .. } => timeline.origin_ns(),
    };
    let from_s = start.as_secs_f64();
    let context = Context {
        experiment: loaded.scene.paper_experiment(),
        ..Context::default()
    };
    let how = Options {
        seed: SEED,
        start_s: Some(from_s),
        advises,
        ..Options::default()
    };
    let mut known = known.lock().unwrap_or_else(PoisonError::into_inner);
    let result = known.compare(&records, &how);
    let why = result.as_ref().err().map(ToString::to_string);
    let comparison = result
        .ok()
        .map(|comparison| report::summary(&comparison, &context));
    json!({
        "origin_ns": origin_ns,
        "from_s": from_s,
        "to_s": from_s + length.as_secs_f64(),
        "seconds": length.as_secs_f64(),
        "frames": records.len(),
        "why": why,
        "comparison": comparison,
    })
}
