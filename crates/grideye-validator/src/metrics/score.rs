//! The measures, and each score with its floors and ceiling.

use serde::Serialize;
use std::fmt;

/// Whether higher or lower values mean more alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
#[expect(missing_docs, reason = "the names say it")]
pub enum Better {
    Higher,
    Lower,
    Neither,
}

macro_rules! measures {
    ($($group:literal, $class:literal {
        $($variant:ident = $name:literal, $title:literal, $unit:literal, $better:ident;)+
    })+) => {
        /// A measure of likeness; the README has a glossary. The names are stable.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Measure {
            $($(#[doc = $title] $variant,)+)+
        }

        impl Measure {
            /// Every measure, in the order of the report.
            pub const ALL: &'static [Self] = &[$($(Self::$variant),+),+];

            /// The measures grouped as in the report, each group with its title and its class on the page.
            pub(crate) const GROUPS: &'static [(&'static str, &'static str, &'static [Self])] =
                &[$(($group, $class, &[$(Self::$variant),+])),+];

            /// Index in [`Measure::ALL`].
            #[expect(clippy::as_conversions, reason = "an enum without fields, numbered from 0 in the order of ALL")]
            pub(crate) const fn place(self) -> usize {
                self as usize
            }

            /// The stable name, lower case with underscores.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $($(Self::$variant => $name),+),+ }
            }

            /// The name for people.
            #[must_use]
            pub const fn title(self) -> &'static str {
                match self { $($(Self::$variant => $title),+),+ }
            }

            /// The unit: `°C`, `bit`, `px`, `°`, `%` (the value is a share of 0 to 1), or empty for a plain number.
            #[must_use]
            pub const fn unit(self) -> &'static str {
                match self { $($(Self::$variant => $unit),+),+ }
            }

            /// Which direction is better.
            #[must_use]
            pub const fn better(self) -> Better {
                match self { $($(Self::$variant => Better::$better),+),+ }
            }
        }
    };
}

measures! {
    "Likeness of warm shapes", "first" {
        Correlation = "correlation", "C, correlation", "", Higher;
        Gain = "gain", "Gain over the blank frame", "", Higher;
    }
    "Distances", "more" {
        ImageSimilarity = "image_similarity", "IS, image similarity", "%", Higher;
        Rmse = "rmse", "RMSE", "°C", Lower;
        Mae = "mae", "MAE", "°C", Lower;
        Bias = "bias", "Bias, simulated minus real", "°C", Neither;
        GainWithOffset = "gain_with_offset", "Gain, offset included", "", Higher;
    }
    "Places, structure and noise", "more" {
        ForegroundRmse = "foreground_rmse", "Foreground RMSE", "°C", Lower;
        ContrastSlope = "contrast_slope", "Contrast, real over simulated", "", Neither;
        CentroidErrorPixels = "centroid_error_pixels", "Centroid error", "px", Lower;
        CentroidErrorDegrees = "centroid_error_degrees", "Centroid error, angle", "°", Lower;
        WarmOverlap = "warm_overlap", "IoU of warm pixels", "", Higher;
        StructuralSimilarity = "structural_similarity", "SSIM, structural similarity", "", Higher;
        ChiSquaredPerDegree = "chi_squared_per_degree", "χ² per degree of freedom", "", Lower;
    }
    "Entropy and mutual information", "more" {
        EntropyRealGrey = "entropy_real_grey", "H real, 256 levels", "bit", Neither;
        EntropySimulatedGrey = "entropy_simulated_grey", "H simulated, 256 levels", "bit", Neither;
        JointEntropyGrey = "joint_entropy_grey", "Joint H, 256 levels", "bit", Neither;
        MutualInformationGrey = "mutual_information_grey", "MI, 256 levels", "bit", Higher;
        MutualInformationGreyCorrected = "mutual_information_grey_corrected", "MI, 256 levels, bias removed", "bit", Higher;
        EntropyRealBinned = "entropy_real_binned", "H real, chosen bins", "bit", Neither;
        EntropySimulatedBinned = "entropy_simulated_binned", "H simulated, chosen bins", "bit", Neither;
        JointEntropyBinned = "joint_entropy_binned", "Joint H, chosen bins", "bit", Neither;
        MutualInformationBinned = "mutual_information_binned", "MI, chosen bins", "bit", Higher;
        MutualInformationBinnedCorrected = "mutual_information_binned_corrected", "MI, chosen bins, bias removed", "bit", Higher;
    }
}

impl fmt::Display for Measure {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.title())
    }
}

/// The measure with the simulated pixels in random order, over many orders.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Shuffled {
    /// The mean over the orders.
    pub mean: f64,
    /// The value that 95 % of the orders do not beat.
    pub p95: f64,
    /// Permutation p-value: share of orders, including the true one, that do at least as well; `None` if neither way is
    /// better.
    pub p: Option<f64>,
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
    /// Floor: images of sensor noise around ambient temperature.
    pub noise: Option<f64>,
    /// Ceiling: the real sequence against itself some frames later, its noise counted once where a correction exists.
    pub ceiling: Option<f64>,
}

impl Score {
    pub(crate) const fn undefined(measure: Measure) -> Self {
        Self {
            measure,
            value: None,
            blank: None,
            shuffled: None,
            noise: None,
            ceiling: None,
        }
    }

    /// The best of blank frame, noise images and the shuffles' mean: skill 0.
    #[must_use]
    pub fn floor(&self) -> Option<f64> {
        self.best_with(self.shuffled.map(|shuffled| shuffled.mean))
    }

    /// What chance reaches: the best of blank frame, noise images and the shuffles' best 5 %.
    #[must_use]
    pub fn chance(&self) -> Option<f64> {
        self.best_with(self.shuffled.map(|shuffled| shuffled.p95))
    }

    /// How far the ceiling rises above chance; negative if it does not.
    #[must_use]
    pub fn headroom(&self) -> Option<f64> {
        let rise = self.ceiling? - self.chance()?;
        match self.measure.better() {
            Better::Higher => Some(rise),
            Better::Lower => Some(-rise),
            Better::Neither => None,
        }
    }

    /// The position between floor (0) and ceiling (1); `None` if the ceiling does not rise above chance.
    #[must_use]
    pub fn skill(&self) -> Option<f64> {
        if self.headroom()? <= 0.0 {
            return None;
        }
        let (floor, ceiling) = (self.floor()?, self.ceiling?);
        let skill = (self.value? - floor) / (ceiling - floor);
        skill.is_finite().then(|| skill.clamp(0.0, 1.0))
    }

    fn best_with(&self, shuffled: Option<f64>) -> Option<f64> {
        if self.measure.better() == Better::Neither {
            return None;
        }
        self.best(self.best(self.blank, self.noise), shuffled)
    }

    fn best(&self, a: Option<f64>, b: Option<f64>) -> Option<f64> {
        let (Some(x), Some(y)) = (a, b) else {
            return a.or(b);
        };
        match self.measure.better() {
            Better::Higher => Some(x.max(y)),
            Better::Lower => Some(x.min(y)),
            Better::Neither => None,
        }
    }
}

/// The scores of a comparison, one for each [`Measure`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scores(Vec<Score>);

impl Scores {
    pub(crate) const fn new(scores: Vec<Score>) -> Self {
        Self(scores)
    }

    /// The score of one measure.
    #[must_use]
    pub fn get(&self, measure: Measure) -> Score {
        self.iter()
            .copied()
            .find(|score| score.measure == measure)
            .unwrap_or(Score::undefined(measure))
    }

    /// Every score, in the order of [`Measure::ALL`].
    pub fn iter(&self) -> impl Iterator<Item = &Score> {
        self.0.iter()
    }
}
