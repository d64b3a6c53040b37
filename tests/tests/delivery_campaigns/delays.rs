//! What this machine kept an agent from doing in time, as its kernel counts it: the time in which a thread of the agent, or
//! of the emulator behind its bus, was ready and had no processor, and in which one waited for the disk.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// From one look at the threads to the next.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// How far back a delay is looked for: much more than any campaign's agent may lose.
const WITHIN: Duration = Duration::from_secs(20);

/// Looks at an agent and its emulator until it is dropped.
pub(crate) struct Delays {
    seen: Arc<Mutex<Seen>>,
    is_over: Arc<AtomicBool>,
}

#[derive(Default)]
struct Seen {
    /// Seconds without a processor of each thread, as they were last seen.
    of_threads: BTreeMap<PathBuf, f64>,
    /// When all looks were, and the seconds of all threads by then.
    looks: Vec<(Instant, f64)>,
}

impl Delays {
    /// Follows the agent whose process number is in the file `pid`, whichever it is.
    pub(crate) fn follow(pid: PathBuf, emulator: u32) -> Self {
        let (seen, is_over) = (Arc::default(), Arc::new(AtomicBool::new(false)));
        let delays = Self {
            seen: Arc::clone(&seen),
            is_over: Arc::clone(&is_over),
        };
        std::thread::spawn(move || {
            while !is_over.load(Ordering::Relaxed) {
                let agent = std::fs::read_to_string(&pid).unwrap_or_default();
                seen.lock()
                    .unwrap()
                    .look([agent.trim(), &emulator.to_string()]);
                std::thread::sleep(LOOK_EVERY);
            }
        });
        delays
    }

    /// Up to now: for each look, how long ago it was, and the delays since.
    pub(crate) fn until_now(&self, agent: &str, emulator: u32) -> Vec<(f64, f64)> {
        let mut seen = self.seen.lock().unwrap();
        seen.look([agent, &emulator.to_string()]);
        let (now, all) = *seen.looks.last().unwrap();
        let looks = seen.looks.iter();
        looks
            .filter(|(then, _)| now - *then < WITHIN)
            .map(|(then, by_then)| ((now - *then).as_secs_f64(), all - by_then))
            .collect()
    }
}

impl Drop for Delays {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
    }
}

impl Seen {
    fn look(&mut self, processes: [&str; 2]) {
        let now = Instant::now();
        let (since, mut all) = self.looks.last().copied().unwrap_or((now, 0.0));
        for process in processes {
            let tasks = Path::new("/proc").join(process).join("task");
            // A process that is gone, or not there yet, waits for nothing.
            for task in std::fs::read_dir(tasks).into_iter().flatten().flatten() {
                let task = task.path();
                let waited_s = without_processor_s(&task).unwrap_or(0.0);
                let before = self.of_threads.insert(task.clone(), waited_s);
                all += (waited_s - before.unwrap_or(0.0)).max(0.0);
                if waits_for_disk(&task) {
                    all += (now - since).as_secs_f64();
                }
            }
        }
        self.looks.push((now, all));
    }
}

/// The second number of `schedstat`, nanoseconds (Linux, scheduler/sched-stats.rst).
fn without_processor_s(task: &Path) -> Option<f64> {
    let text = std::fs::read_to_string(task.join("schedstat")).ok()?;
    let ns: f64 = text.split(' ').nth(1)?.parse().ok()?;
    Some(ns / 1e9)
}

/// State `D` of `stat`, behind the program's name in brackets.
fn waits_for_disk(task: &Path) -> bool {
    let stat = std::fs::read_to_string(task.join("stat")).unwrap_or_default();
    stat.rsplit_once(") ")
        .is_some_and(|(_, fields)| fields.starts_with('D'))
}
