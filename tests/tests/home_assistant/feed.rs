//! A collector that publishes to a broker, and an agent that posts to it.

use grideye_tests::live_page::{batch, frame};
use grideye_tests::programs::{RunningCollector, grideye, run};
use serde_json::Value;
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

/// Must never change: Home Assistant identifies entities by it.
pub(crate) const ID: &str = "grideye_pi_1_s1_f56786d4";
pub(crate) const TELLING: [&str; 4] = ["--mqtt-every", "0.5", "--mqtt-image-every", "0.5"];

/// A collector that publishes to a broker, with its store in a folder.
pub(crate) fn collector(at: &Path, url: &str, more: &[&str]) -> RunningCollector {
    let broker = ["--mqtt", url];
    let all = broker.iter().chain(&TELLING).chain(more);
    let arguments: Vec<&OsStr> = all.map(OsStr::new).collect();
    RunningCollector::start_with(at.join("store.sqlite"), &arguments)
}

/// An agent that posts twice a second: the frames of one of several scenes, in a loop.
pub(crate) struct Feed {
    scene: Arc<AtomicUsize>,
    posted: Arc<Mutex<BTreeMap<u64, Value>>>,
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<u64>>,
}

impl Feed {
    pub(crate) fn start(
        collector: &RunningCollector,
        first_seq: u64,
        scenes: Vec<Vec<Value>>,
    ) -> Self {
        let scene = Arc::<AtomicUsize>::default();
        let posted = Arc::<Mutex<BTreeMap<u64, Value>>>::default();
        let is_over = Arc::<AtomicBool>::default();
        let shared = (scene.clone(), posted.clone(), is_over.clone());
        let url = format!("{}/v1/frames", collector.url());
        let thread = std::thread::spawn(move || {
            let (scene, posted, is_over) = shared;
            let mut seq = first_seq;
            while !is_over.load(Ordering::SeqCst) {
                let frames = &scenes[scene.load(Ordering::SeqCst)];
                let from = usize::try_from(seq).unwrap() % frames.len();
                let next: Vec<Value> = frames.iter().cycle().skip(from).take(5).cloned().collect();
                posted.lock().unwrap().extend((seq..).zip(next.clone()));
                // The test may have killed the collector.
                let _ = ureq::post(&url).send_json(batch("s1", seq, &next));
                seq += 5;
                std::thread::sleep(Duration::from_millis(400));
            }
            seq
        });
        let thread = Some(thread);
        Self {
            scene,
            posted,
            is_over,
            thread,
        }
    }

    pub(crate) fn show(&self, scene: usize) {
        self.scene.store(scene, Ordering::SeqCst);
    }

    /// Raw words of a posted frame: pixels and thermistor.
    pub(crate) fn posted(&self, seq: u64) -> (Vec<u16>, u16) {
        let posted = self.posted.lock().unwrap();
        let frame = &posted[&seq];
        (
            serde_json::from_value(frame["pixels_raw"].clone()).unwrap(),
            serde_json::from_value(frame["thermistor_raw"].clone()).unwrap(),
        )
    }

    /// Stops, and returns the number of the next frame.
    pub(crate) fn stop(mut self) -> u64 {
        self.is_over.store(true, Ordering::SeqCst);
        self.thread.take().unwrap().join().unwrap()
    }
}

impl Drop for Feed {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Frames in which every pixel differs from its neighbor, and each frame from the next.
pub(crate) fn varied() -> Vec<Value> {
    let varied = |number: u16| {
        let pixels: Vec<u16> = (0..64)
            .map(|pixel| 80 + (pixel * 7 + number * 3) % 40)
            .collect();
        frame(&pixels, 0x1A0 + number)
    };
    (0..20).map(varied).collect()
}

/// Frames of a scene's sensor with noise, made by the real simulator.
pub(crate) fn simulated(at: &Path, scene: &str) -> Vec<Value> {
    let (file, out) = (at.join("scene.toml"), at.join("scene.csv"));
    std::fs::write(&file, scene).unwrap();
    let ended = run(grideye()
        .arg("simulate")
        .arg(&file)
        .args(["--seed", "7", "--frames", "40", "--out"])
        .arg(&out));
    assert_eq!(ended.code, 0, "{}", ended.stderr);
    let rows = grideye_recording::csv::Reader::new(std::fs::File::open(out).unwrap()).unwrap();
    rows.map(|row| {
        let row = row.unwrap();
        let raw = row.record.reading.frame().copied().unwrap();
        let words: Vec<u16> = raw.pixels.iter().map(|word| word.0).collect();
        frame(&words, raw.thermistor.unwrap().0)
    })
    .collect()
}
