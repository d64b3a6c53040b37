//! The measures, and each score with its floors and ceiling.

use crate::names::named;
use serde::Serialize;

/// Whether higher or lower values mean more alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
#[expect(missing_docs, reason = "the names say it")]
pub enum Better {
    Higher,
    Lower,
    Neither,
}

named! {
    /// A measure of likeness; the README has a glossary. Entropies are named after the paper's bins.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
    #[expect(missing_docs, reason = "the words say it")]
    pub enum Measure {
        Correlation = "correlation", "C, correlation";
        EntropyReal = "entropy_real_grey", "H real, entropy";
        EntropySimulated = "entropy_simulated_grey", "H simulated";
        JointEntropy = "joint_entropy_grey", "Joint H";
        MutualInformation = "mutual_information_grey", "MI, mutual information";
        ImageSimilarity = "image_similarity", "IS, image similarity";
        Rmse = "rmse", "RMSE";
        Bias = "bias", "Bias, real minus simulated";
        CentroidError = "centroid_error_pixels", "Centroid error";
    }
}

/// One value of each measure, in the order of [`Measure::ALL`]; `None` where undefined.
pub type Values = [Option<f64>; Measure::ALL.len()];

impl Measure {
    /// Index in [`Measure::ALL`].
    #[expect(
        clippy::as_conversions,
        reason = "an enum without fields, numbered from 0 in the order of ALL"
    )]
    pub(crate) const fn place(self) -> usize {
        self as usize
    }

    /// The unit: `°C`, `bit`, `px`, `%` (the value is a share of 0 to 1), or empty for a plain number.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Correlation => "",
            Self::ImageSimilarity => "%",
            Self::Rmse | Self::Bias => "°C",
            Self::CentroidError => "px",
            Self::EntropyReal
            | Self::EntropySimulated
            | Self::JointEntropy
            | Self::MutualInformation => "bit",
        }
    }

    /// Which direction is better.
    #[must_use]
    pub const fn better(self) -> Better {
        match self {
            Self::Correlation | Self::MutualInformation | Self::ImageSimilarity => Better::Higher,
            Self::Rmse | Self::CentroidError => Better::Lower,
            Self::EntropyReal | Self::EntropySimulated | Self::JointEntropy | Self::Bias => {
                Better::Neither
            }
        }
    }
}

/// The measure with the simulated pixels in random order, over many orders.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Shuffled {
    /// The mean over the orders.
    pub mean: f64,
    /// The value that 95 % of the orders do not beat.
    pub p95: f64,
}

/// The score of one measure with its floors and ceiling; `None` where undefined.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Score {
    pub measure: Measure,
    pub value: Option<f64>,
    /// Floor: a blank frame at ambient temperature in place of the simulation.
    pub blank: Option<f64>,
    /// Floor: the simulation's own pixels in random order.
    pub shuffled: Option<Shuffled>,
    /// Ceiling: the real sequence against itself some frames later, its noise counted once where a correction exists.
    pub ceiling: Option<f64>,
}

impl Score {
    /// How far the value is from the better floor (0) to the ceiling (1): the blank frame's or the shuffles' mean. `None` if the
    /// ceiling is no better than the blank frame and 95 % of the shuffles.
    #[must_use]
    pub fn skill(&self) -> Option<f64> {
        let sign = match self.measure.better() {
            Better::Higher => 1.0,
            Better::Lower => -1.0,
            Better::Neither => return None,
        };
        let best = |shuffled: Option<f64>| {
            let floors = [self.blank, shuffled].into_iter().flatten();
            floors.map(|floor| sign * floor).reduce(f64::max)
        };
        let ceiling = sign * self.ceiling?;
        let chance = best(self.shuffled.map(|shuffled| shuffled.p95))?;
        let floor = best(self.shuffled.map(|shuffled| shuffled.mean))?;
        if ceiling <= chance {
            return None;
        }
        let skill = (sign * self.value? - floor) / (ceiling - floor);
        skill.is_finite().then(|| skill.clamp(0.0, 1.0))
    }
}

/// The scores of a comparison, one for each [`Measure`].
#[derive(Debug, Clone, PartialEq)]
pub struct Scores(pub(crate) [Score; Measure::ALL.len()]);

impl Scores {
    /// The score of one measure.
    #[must_use]
    pub const fn get(&self, measure: Measure) -> Score {
        self.0[measure.place()]
    }

    /// Every score, in the order of [`Measure::ALL`].
    pub fn iter(&self) -> impl Iterator<Item = &Score> {
        self.0.iter()
    }
}
