//! Constants of judgment: what counts, and from where on. Where no other source is named, the number is chosen, and the tests
//! of the file that uses it hold it. Limits of size and steps of searches stand where they are used; those of the verdict, in
//! `thresholds.toml`.

// Which frames are compared.

/// Duplicates in a row that make a stall, half a second at 10 Hz.
pub(crate) const STALL_FRAMES: usize = 5;
/// If more frames than this share look torn by chance, torn frames and duplicates are kept.
pub(crate) const BY_CHANCE_MAX: f64 = 0.02;
/// Of frames that are left out as torn, chance makes at most this share; LINAIGE has .06 to .09 of runs of 8.
pub(crate) const TORN_BY_CHANCE_MAX: f64 = 0.1;
/// Fewest consecutive pixels equal to the frame before that make a frame torn; chance makes 0.03 to 0.3 % of the frames so (LINAIGE).
pub const TORN_RUN_MIN: usize = 8;
/// A pixel of exactly 0.0 °C is a glitch if its frame's median is at least this far from 0, °C.
pub(crate) const GLITCH_OFF_MIN_C: f64 = 4.0;
/// With more such pixels the frame has no single-pixel glitches.
pub(crate) const GLITCH_PIXELS_MAX: usize = 8;
/// Frames that judge a scene that was fitted to others: five seconds at 10 Hz.
pub(crate) const REST_ENOUGH: usize = 50;

// How a recording lies in time and in the image.

/// The search reaches this many times as far as the bounds: a better fit beyond them is seen.
pub(crate) const BEYOND: f64 = 1.6;
/// Less likeness than this counts as none, whatever chance reaches.
pub(crate) const LIKENESS_MIN: f64 = 0.3;
/// A rate counts if it exceeds this many standard errors.
pub(crate) const ERRORS_TOLD: f64 = 3.0;
/// A decoy at least this like the scene is the scene.
pub(crate) const KIN_MIN: f64 = 0.7;
/// From this likeness on two series or images count as the same.
pub(crate) const SAME_MIN: f64 = 0.9;
/// What stands still weighs less than what moves: rooms have warm objects that a scene does not know.
pub(crate) const STILL_WEIGHT: f64 = 0.3;
/// Another orientation must beat the upright one by this much likeness.
pub(crate) const ORIENTATION_MARGIN: f64 = 0.1;
/// With less likeness a recording does not tell the offset of its image.
pub(crate) const OFFSET_LIKENESS_MIN: f64 = 0.4;

// What is warm.

/// Noise of a sensor of which nothing is known, °C: the median of AMG88xx units at 10 Hz.
pub(crate) const NOISE_SIGMA_C: f64 = 0.24;
/// Steps that a warm pixel must stand out by, however little noise there is.
pub(crate) const WARM_STEPS_MIN: f64 = 2.0;
/// Warmth below this is none, °C: just above the sensor's step (AMG88 specification, 0.25 °C), which rounding can hide.
/// Chosen on the paper's experiment 2, where the person makes 2 x 2 pixels in a corner of the view 0.45 °C warmer.
pub(crate) const UNCLAIMED_MIN_C: f64 = 0.3;
/// The warmest of 49 blocks exceeds this many standard deviations of a pixel in less than one pattern of 1,000
/// (Gumbel).
pub(crate) const PATTERN_BLOCK_MAX: f64 = 2.2;
/// A pixel farther from a room's slope than this many times the median distance is no part of it.
pub(crate) const PLANE_KEPT: f64 = 4.0;

// What a recording shows of its sensor.

/// The peak of a cycle must reach this many times the spectrum's median.
pub(crate) const CONTRAST_MIN: f64 = 3.0;
/// It must also exceed the median by this share over the root of the number of segments, as spectra of noise scatter.
pub(crate) const SCATTER: f64 = 9.0;
/// Possible rates of a 10 Hz sensor; a cycle outside tells no rate.
pub(crate) const SENSOR_HZ: core::ops::RangeInclusive<f64> = 8.0..=12.0;
/// A cycle this close to five frames means that the reading is in step with the sensor, recorded frames.
pub(crate) const IN_STEP: f64 = 0.02;
/// Fewest means for an empty room, half a minute (in LINAIGE, people move 0.65 °C or more in that time).
pub(crate) const MEANS_MIN: usize = 30;
/// Sigmas from which a change is not noise, which makes as much once in a hundred days.
pub(crate) const MOVED_SIGMAS: f64 = 6.0;
/// An interval longer than this many medians is a stall.
pub(crate) const STALL_PERIODS: f64 = 2.5;
/// Smallest jump of the wall clock against the boot clock between two frames, nanoseconds.
pub(crate) const JUMP_MIN_NS: i128 = 500_000_000;

// What a calibration tells.

/// A stronger correlation between two estimates is a warning.
pub(crate) const CORRELATION_TOLD: f64 = 0.95;
/// A larger factor on a variance is a warning; chance makes a little less.
pub(crate) const WIDENED_TOLD: f64 = 1.5;
/// If so many starts all reach the same end, there are no more.
pub(crate) const ALIKE: usize = 4;
/// Starts within this share of the best cost, and some steps' gain, reached the same end.
pub(crate) const SAME_COST: f64 = 0.01;
/// Some steps' gain, in half of chi-squared.
pub(crate) const SAME_GAIN: f64 = 0.2;
/// An eigenvector's components above this are tangled, or named.
pub(crate) const PART_MIN: f64 = 0.1;
/// The 99.9 % quantile of chi-squared with ten degrees of freedom (Ljung and Box 1978, Biometrika 65:297).
pub(crate) const LJUNG_BOX: f64 = 29.588;

// What a recording says of a scene and of its alternatives.

/// How far aside a person must be told from the scene, meters: the width of a person's shoulders.
pub(crate) const ASIDE_M: f64 = 0.5;
/// A delay that must be told from the scene, beyond three standard deviations of the delay that is allowed, seconds.
pub(crate) const LATE_S: f64 = 0.8;
/// Part of the time, and of the time in view, that a person must be told to be there.
pub(crate) const PARTS: usize = 5;
/// A part of the time is asked about from this share of a person's warmth on.
pub(crate) const SHOWN_MIN: f64 = 0.03;
/// Shortest such part, seconds.
pub(crate) const PART_S: f64 = 1.0;
/// An alternative that more right worlds than this share exclude is something else, however near it is. A few right
/// recordings then end in "cannot tell", which is better than to agree to it.
pub(crate) const CLEAR_POWER: f64 = 0.95;
/// Standard deviations of noise by which an alternative differs from the scene at least.
pub(crate) const ALIKE_SDS: f64 = 2.0;
/// So far aside a person is still where the scene has it, meters: half of [`ASIDE_M`].
pub(crate) const QUARTER_M: f64 = 0.25;
/// Root of the sum of squares over the pixels, °C, from which one more person who stands must be told from what any unit and
/// room may show: 10 times 0.38 °C, what pixels of real units and rooms differ by.
pub(crate) const CLEAR_C: f64 = 4.0;
/// Weight of the scene's own contrast against what the recording says: as if it were known to a standard deviation of 1. It
/// decides only for people whom the recording does not show.
pub(crate) const PRIOR: f64 = 1.0;
/// Likeness below which nothing is said any more: the contrast is too low to divide by.
pub(crate) const LIKENESS_LEAST: f64 = -20.0;
/// A contrast below this share is none: beyond three of the widest standard deviations (0.5, of its logarithm) that a scene
/// may give.
pub(crate) const ABSENT: f64 = 0.2;
/// Likeness below which a recording looks more like an alternative than like the scene.
pub(crate) const LIKE_MIN: f64 = 0.3;
/// Share of what the scene's subjects show, as a square, from which on somebody is there: of the default law of contrast, all
/// but 4 % of people show more.
pub(crate) const FAINT: f64 = 0.3;
/// Standard deviation of the logarithm of the contrast of objects, in a scene without people.
pub(crate) const OBJECTS_SD: f64 = 0.2;
/// Warmth that the scene lacks or has too much is sought in stretches of this length, seconds: the shortest time that somebody
/// is there.
pub(crate) const STRETCH_S: f64 = 1.0;
/// How far aside people's laws let them be, meters: 2.6 standard deviations of the default place (0.07 m).
pub(crate) const WITHIN_M: f64 = 0.18;

// What would make a refused scene agree.

/// Share of the difference that a change must take away to be named.
pub(crate) const GAIN_MIN: f64 = 0.1;
/// A change with this share of the best one's gain explains as much: the first in the table is named first.
pub(crate) const AS_MUCH: f64 = 0.97;
/// A change with this share of the best one's gain is tried with the full verdict.
pub(crate) const TRIED_SHARE: f64 = 0.5;
/// What two changes must take away beyond one, as a share of what is left.
pub(crate) const MORE_GAIN: f64 = 0.15;
/// Share of what one more person explains that counts: who may go anywhere explains part of nearly everything.
pub(crate) const MORE_SHARE: f64 = 0.85;
