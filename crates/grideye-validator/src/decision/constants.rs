//! The decision's constants of judgement, each with its reason, and the test of `tests/decision` that exercises it.
//!
//! Thresholds that a user may set are in `thresholds.toml`, laws of people in `grideye_scene::Laws`.

// Simulated recordings
/// Simulated recordings of the scene that set location and scale of each statistic: with fewer, the scales of some blocks
/// would be too small.
/// Test: right_recordings_agree.
pub(super) const FOR_REFERENCE: usize = 260;
/// Those among which the recording is ranked: it and three of them are the .015 that are refused.
/// Test: the_p_of_right_recordings_is_uniform.
pub(super) const FOR_RANK: usize = 266;
/// Simulated recordings of each alternative; of one that is clear after the first, no more.
/// Test: wrong_recordings_do_not_agree.
pub(super) const OF_ALTERNATIVE: usize = 100;
/// Those that tell whether it is clear.
/// Test: wrong_recordings_do_not_agree.
pub(super) const AT_FIRST: usize = 40;
/// Of an alternative that recordings of the scene come near to: of those, one in a hundred may agree.
/// Test: wrong_recordings_do_not_agree.
pub(super) const OF_NEAR: usize = 400;
/// Of those, as many are looked at: the most like the scene.
/// Test: wrong_recordings_do_not_agree.
pub(super) const LOOKED_AT: usize = 60;
/// An alternative that more recordings of the scene than this share exclude is something else, however near it is. A few right
/// recordings then end in "cannot tell", which is better than to agree to it.
/// Test: wrong_recordings_do_not_agree.
pub(super) const CLEAR_POWER: f64 = 0.95;
/// Alternatives that are asked which law is too wide to tell them apart: as many as are named.
/// Test: people_who_hide_each_other_are_seen.
pub(super) const UNTOLD_MOST: usize = 3;
/// Simulated recordings of each offset that is tried.
/// Test: slightly_wrong_recordings_are_refused_more_and_more.
pub(super) const OF_OFFSET: usize = 30;
/// Offsets that are tried for `Decision::refused_aside_m`, meters.
/// Test: slightly_wrong_recordings_are_refused_more_and_more.
pub const OFFSETS_M: [f64; 6] = [0.1, 0.15, 0.2, 0.3, 0.4, 0.5];

// What is drawn
/// Standard deviation of the logarithm of the contrast of objects, in a scene without people.
/// Test: scenes_that_ship (tests/validator).
pub(super) const OBJECTS_SD: f64 = 0.2;

// Alternatives
/// How far aside a person must be told from the scene, meters.
/// Test: wrong_recordings_do_not_agree.
pub(super) const ASIDE_M: f64 = 0.5;
/// A delay that must be told from the scene, beyond three standard deviations of the delay that is allowed, seconds.
/// Test: wrong_recordings_do_not_agree.
pub(super) const LATE_S: f64 = 0.8;
/// People whose place is asked about one by one.
/// Test: people_who_hide_each_other_are_seen.
pub(super) const PEOPLE_MOST: usize = 4;
/// Part of the time, and of the time in view, that a person must be told to be there.
/// Test: wrong_recordings_do_not_agree.
pub(super) const PARTS: usize = 5;
/// Least share of what a person shows in a part of the time that is asked about.
/// Test: wrong_recordings_do_not_agree.
pub(super) const SHOWN: f64 = 0.03;
/// Shortest such part, seconds.
/// Test: wrong_recordings_do_not_agree.
pub(super) const PART_S: f64 = 1.0;

// Statistics
/// Delays that are tried each way, in standard deviations.
/// Test: wrong_recordings_do_not_agree.
pub(super) const DELAYS: i32 = 3;
/// Warmth that the scene lacks or has too much is sought in stretches of this length, seconds; of a long recording in as
/// many as these.
/// Test: wrong_recordings_do_not_agree.
pub(super) const STRETCH_S: f64 = 1.0;
/// Of a long recording there are at most so many stretches.
/// Test: wrong_recordings_do_not_agree.
pub(super) const STRETCHES_MOST: f64 = 300.0;
/// Weight of the scene's own contrast against what the recording says: as if it were known to a standard deviation of 1. It
/// decides only for people whom the recording does not show.
/// Test: wrong_recordings_do_not_agree.
pub(super) const PRIOR: f64 = 1.0;
/// Standard deviations of noise by which an alternative differs from the scene at least.
/// Test: right_recordings_agree.
pub(super) const ALIKE: f64 = 2.0;
/// So far aside a person is still where the scene has it, meters.
/// Test: people_who_hide_each_other_are_seen.
pub(super) const QUARTER_M: f64 = 0.25;
/// Root of the sum of squares over the pixels, °C, from which one more person who stands must be told from what any unit and
/// room may show: 10 times 0.38 °C, what pixels of real units and rooms differ by.
/// Test: right_recordings_agree.
pub(super) const CLEAR_C: f64 = 4.0;

// Displacement
/// Time for which a wander counts as constant, in its correlation times; of a long recording it is longer.
/// Test: wrong_recordings_do_not_agree.
pub(super) const WINDOW: f64 = 2.0;
/// Of a long recording there are at most so many windows.
/// Test: wrong_recordings_do_not_agree.
pub(super) const WINDOWS_MOST: f64 = 40.0;

// Distances
/// Likeness below which nothing is said any more: the contrast is too low to divide by.
/// Test: wrong_recordings_do_not_agree.
pub(super) const UNLIKE: f64 = -20.0;
/// A contrast below this share is none: beyond three of the widest standard deviations (0.5, of its logarithm) that a scene
/// may give.
/// Test: no_contrast_is_another_place_or_time.
pub(super) const ABSENT: f64 = 0.2;
/// Likeness below which a recording looks more like an alternative than like the scene.
/// Test: tests/sensor.
pub(super) const LIKE: f64 = 0.3;
/// The farthest that set the scale of a value by their mean. The very farthest varies by a seventh, and in a few of so many
/// blocks it is half too far.
/// Test: right_recordings_agree.
pub(super) const FARTHEST: usize = 8;
/// How far these are in the mean, of 260 draws of a normal law, in standard deviations.
/// Test: right_recordings_agree.
pub(super) const FARTHEST_SDS: f64 = 2.23;

// Pictures
/// Shortest time between pictures of a recording that has many, seconds: a walking person moves half a pixel.
/// Test: a_bad_frame_changes_no_verdict.
pub(super) const PICTURE_S: f64 = 0.2;
/// Longest: longer pictures would show a walk as a smear, and nothing of its delay.
/// Test: tests/recordings/long.rs.
pub(super) const PICTURE_MOST_S: f64 = 1.0;
/// More frames than this are averaged.
/// Test: a_bad_frame_changes_no_verdict.
pub(super) const FEW: usize = 150;
/// Pictures that are judged at most.
/// Test: tests/recordings/long.rs.
pub(super) const PICTURES_MOST: usize = 2_000;
/// Of a recording with more pictures, runs of this many are judged.
/// Test: tests/recordings/long.rs.
pub(super) const RUN: usize = 100;
/// No picture is of frames that are this many periods apart or more.
/// Test: a_bad_frame_changes_no_verdict.
pub(super) const GAP: f64 = 3.5;

// The unit
/// Share of a pixel's steps from frame to frame that count for its noise: the largest may be a person's.
/// Test: other_noise_is_no_reason_to_refuse.
pub(super) const KEPT_SHARE: f64 = 0.8;
/// Fewest frames that show whether noise is correlated.
/// Test: other_noise_is_no_reason_to_refuse.
pub(super) const CORRELATED_FRAMES_MIN: usize = 60;

// Rendering
/// Spacing of the places that a person is rendered at, meters: less than half of a pixel's width at a head below a ceiling.
/// Test: slightly_wrong_recordings_are_refused_more_and_more.
pub(super) const SPACING_M: f64 = 0.1;
/// The same of what is no parametric person: its parts take longer to render.
/// Test: right_recordings_agree.
pub(super) const COARSE_M: f64 = 0.25;

// Advice
/// Changes that are judged, those that explain most first.
/// Test: the_change_that_would_agree_is_named.
pub(super) const JUDGED: usize = 2;
/// How much less a change must leave than without it to be judged, or to be part of one.
/// Test: what_is_wrong_together_is_named.
pub(super) const CLEARLY: f64 = 0.9;
/// Changes that are named although none agrees, and the least share of the difference that each takes away.
/// Test: what_is_wrong_together_is_named.
pub(super) const NAMED: usize = 3;
/// Least share of the difference that a named change takes away.
/// Test: what_is_wrong_together_is_named.
pub(super) const GAIN_MIN: f64 = 0.1;
/// Longest delay that is tried, and steps of it, seconds.
/// Test: the_change_that_would_agree_is_named.
pub(super) const DELAY_MAX_S: f64 = 10.0;
/// Steps of it, seconds.
/// Test: the_change_that_would_agree_is_named.
pub(super) const DELAY_STEP_S: f64 = 0.2;
/// Contrasts that people's laws leave open: two standard deviations of 0.35 each way.
/// Test: the_change_that_would_agree_is_named.
pub(super) const CONTRASTS: [f64; 2] = [0.5, 2.0];
/// What chance explains of one picture by somebody anywhere: of some 40 places the best, in squared standard deviations.
/// Test: tests/decision.
pub(super) const ANYWHERE: f64 = 8.0;
