//! `grideye dataset`: labelled frames of a scene that differs from frame to frame.
//!
//! ```text
//!  scene + what varies + seed ──▶ plan (dataset.json) ──▶ parts 0, 1, 2 … of so many frames each
//!                                                          part k belongs to shard k mod n, is made by one thread,
//!                                                          and gets its name when it is whole and on the disk
//! ```
//!
//! Frame k is a function of (scene, seed, k), and a part of its frames: how many threads and shards there are, and
//! where the work was interrupted, cannot be told from the files.

mod folder;
mod frames;
mod part;
mod plan;

use crate::cli::Dataset;
use crate::exit::Outcome;
use crate::output::outln;
use crate::progress;
use anyhow::Result;
use folder::Folder;
use frames::Studio;
use indicatif::ProgressBar;
use plan::Plan;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

/// Makes the parts of the shard that are not there yet.
pub(crate) fn run(options: &Dataset) -> Result<Outcome> {
    let studio = Studio::new(options)?;
    let plan = Plan::new(options, &studio)?;
    let folder = Folder::open(&options.out, &plan)?;
    let mine = plan.parts_of(options.shard);
    let (mut missing, mut there, mut frames) = (Vec::new(), 0_u64, 0);
    for part in mine {
        frames += plan.count(part);
        if folder.has(&plan, part)? {
            there += 1;
        } else {
            missing.push(part);
        }
    }
    let bar = progress::bar(frames, "simulating");
    let todo: u64 = missing.iter().map(|part| plan.count(*part)).sum();
    bar.inc(frames - todo);
    bar.reset_eta();
    let made = u64::try_from(missing.len())?;
    missing.reverse();
    let work = Work {
        studio: &studio,
        plan: &plan,
        folder: &folder,
        bar: &bar,
        missing: Mutex::new(missing),
        failed: AtomicBool::new(false),
    };
    work.done_by(threads(options))?;
    bar.finish_and_clear();
    report(options, &plan, [made, there, frames])?;
    Ok(Outcome::Done)
}

fn threads(options: &Dataset) -> usize {
    options
        .threads
        .or_else(|| thread::available_parallelism().ok())
        .map_or(1, NonZeroUsize::get)
}

/// The parts that are to be made, for any number of threads.
struct Work<'a> {
    studio: &'a Studio,
    plan: &'a Plan,
    folder: &'a Folder,
    bar: &'a ProgressBar,
    /// The next one is the last.
    missing: Mutex<Vec<u64>>,
    failed: AtomicBool,
}

impl Work<'_> {
    /// Every part, or the first error: the other threads then end with the part that they are at.
    fn done_by(&self, threads: usize) -> Result<()> {
        thread::scope(|scope| {
            let workers: Vec<_> = (0..threads).map(|_| scope.spawn(|| self.work())).collect();
            let mut result = Ok(());
            for worker in workers {
                match worker.join() {
                    Ok(done) => result = result.and(done),
                    Err(panic) => std::panic::resume_unwind(panic),
                }
            }
            result
        })
    }

    fn work(&self) -> Result<()> {
        let mut camera = self.studio.camera();
        while let Some(part) = self.next() {
            let done = self.make(&mut camera, part);
            if done.is_err() {
                self.failed.store(true, Ordering::Relaxed);
                return done;
            }
        }
        Ok(())
    }

    fn next(&self) -> Option<u64> {
        if self.failed.load(Ordering::Relaxed) {
            return None;
        }
        let mut missing = self.missing.lock().unwrap_or_else(PoisonError::into_inner);
        missing.pop()
    }

    fn make(&self, camera: &mut frames::Camera<'_>, part: u64) -> Result<()> {
        let mut made = part::Part::new(self.studio, self.plan, part);
        for index in self.plan.frames_of(part) {
            if self.failed.load(Ordering::Relaxed) {
                return Ok(());
            }
            made.add(&camera.frame(index)?)?;
            self.bar.inc(1);
        }
        self.folder.put(self.plan, &made)
    }
}

fn report(options: &Dataset, plan: &Plan, [made, there, frames]: [u64; 3]) -> Result<()> {
    let shard = options.shard;
    if options.json {
        let answer = serde_json::json!({
            "shard": shard.number,
            "shards": shard.of,
            "parts_made": made,
            "parts_there": there,
            "frames": frames,
            "parts_of_dataset": plan.parts(),
            "frames_of_dataset": plan.frames,
            "fingerprint": plan.fingerprint,
        });
        return outln!("{answer}");
    }
    outln!(
        "shard {} of {}: {frames} of {} frames in {}; {made} parts made, {there} were there",
        shard.number,
        shard.of,
        plan.frames,
        options.out.display()
    )
}
