//! Makes missing parts on any number of threads.

use crate::error::DatasetError;
use crate::folder::Folder;
use crate::frames::{Frames, Maker};
use crate::manifest::Manifest;
use crate::part::Part;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

/// Makes these parts; every thread calls `after_each` after each frame.
///
/// # Errors
/// The first error; the other threads then stop without finishing their parts.
pub fn make(
    (frames, manifest): (&Frames, &Manifest),
    folder: &Folder<'_>,
    mut missing: Vec<u64>,
    threads: usize,
    after_each: &(dyn Fn() + Sync),
) -> Result<(), DatasetError> {
    missing.reverse();
    let work = Work {
        frames,
        manifest,
        folder,
        after_each,
        missing: Mutex::new(missing),
        failed: AtomicBool::new(false),
    };
    work.done_by(threads)
}

struct Work<'a> {
    frames: &'a Frames,
    manifest: &'a Manifest,
    folder: &'a Folder<'a>,
    after_each: &'a (dyn Fn() + Sync),
    /// The last one is next.
    missing: Mutex<Vec<u64>>,
    failed: AtomicBool,
}

impl Work<'_> {
    /// Makes every part or returns the first error.
    fn done_by(&self, threads: usize) -> Result<(), DatasetError> {
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

    fn work(&self) -> Result<(), DatasetError> {
        let mut maker = self.frames.maker();
        while let Some(part) = self.next() {
            let done = self.make(&mut maker, part);
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

    fn make(&self, maker: &mut Maker<'_>, part: u64) -> Result<(), DatasetError> {
        let mut made = Part::new(self.frames, self.manifest, part);
        for index in self.manifest.frames_of(part) {
            if self.failed.load(Ordering::Relaxed) {
                return Ok(());
            }
            made.add(maker.frame(index)?);
            (self.after_each)();
        }
        self.folder.put(self.manifest, &made)
    }
}
