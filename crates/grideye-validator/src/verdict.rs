use crate::metrics::SENSOR_ACCURACY_C;
use crate::text::{fixed, frames};
use crate::{Measure, Score, Scores};
use std::fmt;

/// What the comparison says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Verdict {
    /// The simulated scene explains what the sensor saw.
    Agrees,
    /// It does not.
    Disagrees,
    /// The recording does not hold what an answer would need.
    CannotTell,
}

impl Verdict {
    /// The stable name for files and programs: `agrees`, `disagrees` or `cannot_tell`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Agrees => "agrees",
            Self::Disagrees => "disagrees",
            Self::CannotTell => "cannot_tell",
        }
    }
}

impl fmt::Display for Verdict {
    /// In words: `agrees`, `disagrees`, `cannot tell`.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(match self {
            Self::Agrees => "agrees",
            Self::Disagrees => "disagrees",
            Self::CannotTell => "cannot tell",
        })
    }
}

/// What the verdict is measured against. Skills are shares of the way from the recording's own floor to its own
/// ceiling, so that the same thresholds serve a strong scene and a weak one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thresholds {
    /// Least skill in C, 0 to 1. Default 0.6: nearer to what the sensor's own repeat reaches than to chance. On the
    /// paper's experiments, simulated, the right scene reaches 0.69 and more; of the wrong ones the hardest (a person
    /// in the corner of the view who is not claimed) reaches 0.60.
    pub correlation_skill_min: f64,
    /// Least skill in the gain over the blank frame, 0 to 1. Default 0.6; there 0.75 and more against up to 0.61. A
    /// scene has to reach both.
    pub gain_skill_min: f64,
    /// Largest common offset in degrees. Default [`SENSOR_ACCURACY_C`]: what the datasheet allows a unit to be off.
    pub offset_max_c: f64,
    /// How far the ceilings of C and gain must rise above chance before anything is said. Default 0.1.
    pub headroom_min: f64,
    /// Least number of warm pixels a frame, on average, before a recording counts as holding something warm. Default
    /// 0.3: empty rooms of the LINAIGE recordings show 0 to 0.05, rooms with one person 1.4 to 4.3.
    pub warm_pixels_min: f64,
    /// A pixel is warm when it lies above the background by more than this many sigma of the sensor's noise.
    /// Default 4: at 3, noise and fixed pattern of an empty room already show up to 0.9 warm pixels a frame.
    pub warm_sigma: f64,
    /// Least number of real frames. Default 2.
    pub frames_min: usize,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self {
            correlation_skill_min: 0.6,
            gain_skill_min: 0.6,
            offset_max_c: SENSOR_ACCURACY_C,
            headroom_min: 0.1,
            warm_pixels_min: 0.3,
            warm_sigma: 4.0,
            frames_min: 2,
        }
    }
}

/// The verdict and what it rests on.
#[derive(Debug, Clone, PartialEq)]
pub struct Judgement {
    /// The verdict.
    pub verdict: Verdict,
    /// The verdict in one sentence.
    pub headline: String,
    /// What it rests on, each a sentence with the numbers.
    pub reasons: Vec<String>,
    /// What would have changed it, in a sentence.
    pub would_change: String,
}

/// The numbers that the verdict rests on.
pub(crate) struct Evidence<'a> {
    pub(crate) scores: &'a Scores,
    pub(crate) real_frames: usize,
    pub(crate) offset_c: f64,
    pub(crate) warm: WarmPixels,
    pub(crate) warm_above_c: f64,
    pub(crate) lag_frames: usize,
}

/// Warm pixels a frame, on average: both counts by the same rule, so that they can be set side by side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WarmPixels {
    /// In the real frames, above the median of their own pixels.
    pub real: f64,
    /// In the noise-free simulated frames, above the median of their own pixels: what the scene claims.
    pub claimed: f64,
    /// Of the pixels that the gain is taken over, the share that is warm on both sides, 0 to 1; `None` if there are
    /// none. The gain asks less of the claim than of the real side, so that the right scene does not reach 1.
    pub overlap: Option<f64>,
}

/// Weighs the evidence.
pub(crate) fn judge(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Judgement {
    if let Some(reason) = nothing_to_tell_from(evidence, thresholds) {
        return cannot_tell(reason);
    }
    let findings = [
        skill(
            evidence,
            Measure::Correlation,
            thresholds.correlation_skill_min,
        ),
        skill(evidence, Measure::Gain, thresholds.gain_skill_min),
        offset(evidence, thresholds),
    ];
    let agrees = findings.iter().all(|finding| finding.passed);
    let verdict = if agrees {
        Verdict::Agrees
    } else {
        Verdict::Disagrees
    };
    // What failed comes first: it is what the reader has to act on.
    let (failed, passed): (Vec<_>, Vec<_>) =
        findings.into_iter().partition(|finding| !finding.passed);
    Judgement {
        verdict,
        headline: headline(verdict).to_owned(),
        reasons: failed
            .into_iter()
            .chain(passed)
            .map(|finding| finding.sentence)
            .collect(),
        would_change: would_change(verdict, thresholds),
    }
}

struct Finding {
    passed: bool,
    sentence: String,
}

const fn headline(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Agrees => "The simulated scene agrees with the recording.",
        Verdict::Disagrees => "The simulated scene disagrees with the recording.",
        Verdict::CannotTell => "This recording cannot tell whether the simulated scene is right.",
    }
}

fn cannot_tell((reason, remedy): (String, &str)) -> Judgement {
    Judgement {
        verdict: Verdict::CannotTell,
        headline: headline(Verdict::CannotTell).to_owned(),
        reasons: vec![reason],
        would_change: remedy.to_owned(),
    }
}

fn nothing_to_tell_from(
    evidence: &Evidence<'_>,
    thresholds: &Thresholds,
) -> Option<(String, &'static str)> {
    if evidence.real_frames < thresholds.frames_min {
        let reason = format!(
            "The recording holds {} to compare; at least {} are needed to know what the sensor's noise is worth.",
            frames(evidence.real_frames),
            thresholds.frames_min
        );
        return Some((reason, "A longer recording of the same scene."));
    }
    if evidence.warm.real < thresholds.warm_pixels_min {
        return Some((
            nothing_warm(evidence),
            "A recording with a person, or another warm thing of the scene, in view.",
        ));
    }
    [Measure::Correlation, Measure::Gain]
        .into_iter()
        .find_map(|measure| no_headroom(evidence, measure, thresholds.headroom_min))
}

fn nothing_warm(evidence: &Evidence<'_>) -> String {
    let claim = if evidence.warm.claimed > 0.0 {
        format!(
            "the scene claims {:.1} such pixels a frame, which an empty recording neither proves nor refutes",
            evidence.warm.claimed
        )
    } else {
        "the scene claims none either, and any two empty rooms look alike".to_owned()
    };
    format!(
        "The recording shows nothing warm: {:.2} pixels a frame lie more than {:.2} °C above the background; {claim}.",
        evidence.warm.real, evidence.warm_above_c
    )
}

fn no_headroom(
    evidence: &Evidence<'_>,
    measure: Measure,
    least: f64,
) -> Option<(String, &'static str)> {
    let score = evidence.scores.get(measure);
    let remedy =
        "A recording of at least a second at 10 Hz without gaps, with more contrast or less noise.";
    let Some(ceiling) = score.ceiling else {
        let reason = format!(
            "The recording has no frame {} after another to measure its own repeat with, so {measure} has no ceiling.",
            frames(evidence.lag_frames)
        );
        return Some((reason, remedy));
    };
    let chance = score.chance()?;
    // Written so that a value that is not a number falls on the side of "cannot tell".
    let rises = ceiling - chance >= least;
    (!rises).then(|| {
        let reason = format!(
            "The recording does not even resemble itself {} later: {measure} reaches {} where chance reaches {}.",
            frames(evidence.lag_frames), fixed(ceiling, 2), fixed(chance, 2)
        );
        (reason, remedy)
    })
}

fn offset(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Finding {
    let (offset_c, limit) = (evidence.offset_c, fixed(thresholds.offset_max_c, 1));
    let passed = offset_c.abs() <= thresholds.offset_max_c;
    let size = fixed(offset_c.abs(), 2);
    let relation = if passed { "within" } else { "beyond" };
    let sentence = match size.as_str() {
        "0.00" => "The recording is as warm as the scene all over.".to_owned(),
        _ => {
            let direction = if offset_c < 0.0 { "colder" } else { "warmer" };
            format!(
                "The recording is {size} °C {direction} than the scene all over, {relation} the {limit} °C that are allowed."
            )
        }
    };
    Finding { passed, sentence }
}

fn skill(evidence: &Evidence<'_>, measure: Measure, least: f64) -> Finding {
    let score = evidence.scores.get(measure);
    let skill = skill_or_nothing(&score);
    let passed = skill >= least;
    let relation = if passed { "at least" } else { "less than" };
    let value = score
        .value
        .map_or_else(|| "not defined".to_owned(), |value| fixed(value, 2));
    let sentence = format!(
        "{measure} is {value}, {} of the way from the floor ({}) to the ceiling ({}), {relation} the {} asked for.",
        fixed(skill, 2),
        fixed(score.floor().unwrap_or(0.0), 2),
        fixed(score.ceiling.unwrap_or(0.0), 2),
        fixed(least, 2)
    );
    Finding { passed, sentence }
}

/// An image without any contrast has no correlation, and so has explained nothing.
fn skill_or_nothing(score: &Score) -> f64 {
    score.skill().unwrap_or(0.0)
}

fn would_change(verdict: Verdict, thresholds: &Thresholds) -> String {
    let (c, gain, offset) = (
        thresholds.correlation_skill_min,
        thresholds.gain_skill_min,
        thresholds.offset_max_c,
    );
    if verdict == Verdict::Agrees {
        format!(
            "A skill in C below {c:.2}, a skill in gain below {gain:.2}, or a common offset beyond {offset:.1} °C."
        )
    } else {
        format!(
            "A skill in C of {c:.2} and a skill in gain of {gain:.2}, with a common offset within {offset:.1} °C."
        )
    }
}
