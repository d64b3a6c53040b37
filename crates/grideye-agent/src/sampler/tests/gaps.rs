//! How much of a gap is listed row by row.

use super::*;

/// The rows and the faults of a gap of so many frames.
fn listed(frames: u64) -> (u64, Vec<&'static str>) {
    let mut sampler = Sampler::new(duration(100 * MS), Duration::ZERO, None);
    sampler.miss_until(frames, 0);
    let (mut rows, mut faults) = (0, Vec::new());
    while let Some(event) = sampler.next_event() {
        match event {
            Event::Record { .. } => rows += 1,
            Event::Fault(kind) => faults.push(kind),
        }
    }
    (rows, faults)
}

#[test]
fn a_gap_of_exactly_the_limit_is_listed_whole_and_a_longer_one_is_counted() {
    let limit = ROWS_PER_GAP_MAX;
    assert_eq!(listed(limit), (limit, vec![]));
    assert_eq!(listed(limit + 1), (limit, vec![GAP_NOT_LISTED]));
}
