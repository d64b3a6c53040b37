//! Error rates of the verdict, on recordings drawn by other code than the validator's.
//!
//! `GRIDEYE_WORLDS=N` draws N of each kind; by default a few.

mod worlds;

use grideye_validator::{Comparison, Options, Verdict, compare_scene};
use std::sync::atomic::{AtomicU64, Ordering};
use worlds::{SENSOR, Truth, Unit, Way, record, scene};

const STAND: &[Way] = &[Way::Stands(0.55, 0.22)];
const WALK: &[Way] = &[Way::Walks { ahead_s: 0.0 }];
const TWO: &[Way] = &[Way::Walks { ahead_s: 0.0 }, Way::Walks { ahead_s: 9.0 }];
const UNIT: Unit = Unit {
    pattern_c: 0.38,
    noise_c: 0.22,
};

fn number(usual: u64) -> u64 {
    let asked = std::env::var("GRIDEYE_WORLDS").ok();
    asked.and_then(|asked| asked.parse().ok()).unwrap_or(usual)
}

fn options() -> Options {
    Options {
        shuffles: 1,
        frames: Some(10),
        ..Options::default()
    }
}

/// Compares this many recordings on all processors.
fn compared<T: Send>(number: u64, one: impl Fn(u64) -> T + Sync) -> Vec<T> {
    let next = AtomicU64::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= number {
                return done;
            }
            done.push((seed, one(seed)));
        }
    };
    let mut all: Vec<(u64, T)> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..2).map(|_| scope.spawn(work)).collect();
        threads
            .into_iter()
            .flat_map(|thread| thread.join().unwrap())
            .collect()
    });
    all.sort_by_key(|one| one.0);
    all.into_iter().map(|one| one.1).collect()
}

fn verdicts(ways: &[Way], frames: usize, truth: Truth, unit: Unit, number: u64) -> Vec<Comparison> {
    let scene = scene(ways, frames, "");
    compared(number, |seed| {
        let records = record(ways, frames, truth, unit, 1.0, 77 + seed);
        compare_scene(&records, &scene, SENSOR, &options()).unwrap()
    })
}

fn count(all: &[Comparison], verdict: Verdict) -> usize {
    all.iter()
        .filter(|one| one.judgment.verdict == verdict)
        .count()
}

#[test]
#[ignore]
fn explore() {
    let number = number(40);
    let which = std::env::var("WHICH").unwrap_or_default();
    let frames: Vec<usize> = std::env::var("FRAMES")
        .unwrap_or("50,300".to_owned())
        .split(',')
        .map(|one| one.parse().unwrap())
        .collect();
    for (name, ways) in [("stand", STAND), ("walk", WALK), ("two", TWO)] {
        if !which.contains(name) && which.contains('@') {
            continue;
        }
        for &frames in &frames {
            for truth in [
                Truth::Right,
                Truth::Nobody,
                Truth::Missing,
                Truth::More,
                Truth::Gone,
                Truth::MirroredX,
                Truth::MirroredY,
                Truth::Quarter,
                Truth::Aside(0.2),
                Truth::Aside(0.3),
                Truth::Aside(0.5),
                Truth::Late(1.0),
                Truth::Late(5.0),
                Truth::Backwards,
                Truth::Contrast(0.45),
                Truth::Contrast(2.2),
                Truth::Drift(2.0),
                Truth::Stray(0.37),
                Truth::Correlated,
            ] {
                if name == "stand" && matches!(truth, Truth::Late(_) | Truth::Backwards) {
                    continue;
                }
                let kind = format!("{truth:?}");
                if !which.is_empty()
                    && !which
                        .split('@')
                        .next()
                        .unwrap()
                        .split(',')
                        .any(|one| kind.starts_with(one))
                {
                    continue;
                }
                let began = std::time::Instant::now();
                let all = verdicts(ways, frames, truth, UNIT, number);
                let verdict = |verdict| count(&all, verdict);
                let mut why = std::collections::BTreeMap::new();
                for one in &all {
                    for criterion in &one.judgment.criteria {
                        if matches!(
                            criterion.state,
                            grideye_validator::State::Failed | grideye_validator::State::Open
                        ) {
                            *why.entry(criterion.name).or_insert(0) += 1;
                        }
                    }
                    if one.judgment.verdict == Verdict::CannotTell {
                        for one in &one.decision.as_ref().unwrap().alternatives {
                            if !one.is_told() && one.counts() {
                                *why.entry(Box::leak(one.what.clone().into_boxed_str()))
                                    .or_insert(0) += 1;
                            }
                        }
                    }
                }
                let decisions: Vec<_> =
                    all.iter().filter_map(|one| one.decision.as_ref()).collect();
                let low = decisions.iter().filter(|one| one.right <= 0.1).count();
                println!(
                    "{name} {frames} {kind}: {}/{}/{} p<=.1 {low} aside {:?} {:.2} s each {why:?}",
                    verdict(Verdict::Agrees),
                    verdict(Verdict::Disagrees),
                    verdict(Verdict::CannotTell),
                    decisions.first().map(|one| one.refused_aside_m),
                    2.0 * began.elapsed().as_secs_f64() / number as f64
                );
            }
        }
    }
}
