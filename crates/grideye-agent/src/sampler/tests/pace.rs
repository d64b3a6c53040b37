//! When to read next, which frame a read shows, how much of a gap is listed: each rule alone.

use super::*;

const PERIOD: Ns = 100 * MS;

/// Follows a sensor with the update of frame 0 in `window`.
fn following(window: Window) -> Sampler {
    let mut sampler = Sampler::new(duration(PERIOD), Duration::ZERO, None);
    sampler.phase = Some(Phase::new(PERIOD, 0, window));
    sampler.state = State::Follow;
    sampler.quickest_read = 0;
    sampler
}

fn window(sampler: &Sampler, seq: u64) -> Window {
    sampler.phase.as_ref().unwrap().window(seq)
}

fn read(at: Ns, content: u64) -> Read {
    let frame = frame(content);
    Read {
        before: at,
        latched_until: at + 1,
        after: at + 1,
        frame,
        content: Content::of(&frame),
    }
}

/// The first record and its number.
fn first_row(sampler: &mut Sampler) -> Option<u64> {
    std::iter::from_fn(|| sampler.next_event()).find_map(|event| match event {
        Event::Record { seq, .. } => Some(seq),
        Event::Fault(_) => None,
    })
}

#[test]
fn a_window_is_narrow_up_to_2_ms_plus_twice_the_host_time_of_a_read() {
    let mut sampler = following(Window::new(0, MS));
    (sampler.quickest_read, sampler.transfer_min) = (13 * MS, 12 * MS);
    assert_eq!(sampler.narrow(), 4 * MS);
}

#[test]
fn only_the_seventeenth_frame_without_a_proof_is_read_before_its_window() {
    let mut sampler = following(Window::new(0, MS));
    for frame in 1..=17 {
        sampler.plan(Ns::MIN);
        let expected = if frame == 17 { -MS } else { MS + MS / 2 };
        assert_eq!(sampler.next_at, expected, "frame {frame}");
    }
    sampler.plan(Ns::MIN);
    assert_eq!(sampler.next_at, -MS, "until a read has proved it");
}

#[test]
fn a_near_update_is_read_half_a_millisecond_after_its_window() {
    let mut sampler = following(Window::new(0, MS));
    let read = read(50 * MS, 1);
    sampler.wait_for_update(&read, read.after + 2 * MS);
    assert_eq!(sampler.next_at, read.after + 2 * MS + MS / 2);
}

#[test]
fn a_still_scene_with_lost_bounds_is_awaited_until_half_a_period_after_the_estimate() {
    let mut sampler = following(Window::new(0, 95 * MS));
    sampler.next_seq = 1;
    sampler.repeats = STILL_FRAMES;
    let expected = window(&sampler, 1);
    assert!(sampler.is_lost(1), "{expected:?}");
    let read = read(expected.middle(), 1);
    sampler.unchanged(&read);
    // Half of the rest of half a period.
    assert_eq!(sampler.next_at, read.after + (50 * MS - 1) / 2);
}

#[test]
fn after_faults_within_one_frame_the_next_read_follows_the_next_window() {
    let mut sampler = following(Window::new(0, MS));
    sampler.next_seq = 1;
    sampler.retries = RETRIES_PER_FRAME;
    let behind = window(&sampler, 2).until + MS / 2;
    let now = behind - 150 * MS;
    assert_eq!(sampler.retry_pause(now), 150 * MS);
    assert_eq!(sampler.retry_pause(now), PERIOD / 8, "and then soon again");
    sampler.retries = RETRIES_PER_FRAME;
    assert_eq!(sampler.retry_pause(behind - 250 * MS), 2 * PERIOD);
}

#[test]
fn a_restart_takes_the_frame_with_the_nearest_estimate() {
    for (at, seq) in [(149, 1), (151, 2)] {
        let mut sampler = following(Window::new(0, 0));
        sampler.next_seq = 1;
        let read = read(at * MS, 7);
        sampler.start(&read, Window::new(at * MS, at * MS));
        assert_eq!(sampler.next_seq, seq + 1, "an update at {at} ms");
        assert_eq!(first_row(&mut sampler), Some(1));
    }
}

#[test]
fn an_equal_read_identifies_a_changed_frame_only_in_a_lively_scene() {
    for is_lively in [true, false] {
        let mut sampler = following(Window::new(0, MS));
        sampler.next_seq = 1;
        sampler.changes_in_a_row = if is_lively { LIVELY_FRAMES } else { 0 };
        let shown = window(&sampler, 2);
        let pending = Pending {
            read: read(shown.middle(), 5),
            seen_before: MS,
            low: 1,
            high: 2,
        };
        let next = read(shown.until + MS, 5);
        assert!(sampler.is_before_next(2, &next));
        sampler.resolve(&pending, Some(&next));
        assert_eq!(sampler.next_seq, if is_lively { 3 } else { 1 });
    }
}

#[test]
fn a_read_quicker_than_the_assumed_minimum_lowers_it() {
    let mut sampler = following(Window::new(0, MS));
    sampler.set_transfer_min(duration(12 * MS));
    let span = Span::new(duration(1000 * MS), duration(1010 * MS));
    sampler.frame_read(span, Ok(frame(3)));
    assert_eq!(sampler.transfer_min, 10 * MS);
}

/// The number of records and the faults for a gap of this many frames.
fn listed(frames: u64) -> (u64, Vec<&'static str>) {
    let mut sampler = Sampler::new(duration(100 * MS), Duration::ZERO, None);
    sampler.miss_until(frames, 0);
    let mut outcome = Outcome::default();
    outcome.take_events(&mut sampler);
    let rows = u64::try_from(outcome.records.len()).unwrap();
    (rows, outcome.faults)
}

#[test]
fn a_gap_of_exactly_the_limit_is_listed_whole_and_a_longer_one_is_counted() {
    let limit = ROWS_PER_GAP_MAX;
    assert_eq!(listed(limit), (limit, vec![]));
    assert_eq!(listed(limit + 1), (limit, vec![GAP_NOT_LISTED]));
}
