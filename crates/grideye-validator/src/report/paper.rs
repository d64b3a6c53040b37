//! The paper's published results, shown beside ours and marked as the paper's.
//!
//! Comai et al. 2025, PeerJ Computer Science 11:e3124, Tables 1 to 4 (CC BY 4.0). Its Table 5 gives experiment 4 other figures.

use crate::metrics::score::Measure;

/// The source of these figures.
pub const CITATION: &str =
    "Comai et al. 2025, PeerJ Computer Science 11:e3124, https://doi.org/10.7717/peerj-cs.3124";

/// The published figures of one experiment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Experiment {
    /// 1 to 4 as in the paper; also the number of its table.
    pub number: u8,
    /// The setup in a few words.
    pub title: &'static str,
    /// In the order of [`MEASURES`]: entropies and information in bits, IS as a share of 0 to 1.
    figures: [f64; 6],
}

/// The paper's measures: C, entropies, mutual information and IS.
pub const MEASURES: [Measure; 6] = [
    Measure::Correlation,
    Measure::EntropyReal,
    Measure::EntropySimulated,
    Measure::JointEntropy,
    Measure::MutualInformation,
    Measure::ImageSimilarity,
];

/// Experiments 1 to 4, in order.
pub const EXPERIMENTS: [Experiment; 4] = [
    Experiment {
        number: 1,
        title: "static, person centered below the sensor",
        figures: [0.79, 3.5, 5.2, 5.9, 2.8, 0.95],
    },
    Experiment {
        number: 2,
        title: "static, person in a corner of the view",
        figures: [0.71, 3.3, 4.5, 5.9, 1.9, 0.90],
    },
    Experiment {
        number: 3,
        title: "dynamic, person walking below the sensor",
        figures: [0.58, 3.2, 4.7, 5.9, 2.0, 0.94],
    },
    Experiment {
        number: 4,
        title: "dynamic, sensor at the left and tilted by 30 degrees",
        figures: [0.49, 2.9, 4.6, 5.9, 1.6, 0.92],
    },
];

/// The experiment with this number, 1 to 4.
#[must_use]
pub fn experiment(number: u8) -> Option<&'static Experiment> {
    EXPERIMENTS
        .iter()
        .find(|experiment| experiment.number == number)
}

impl Experiment {
    /// The paper's figure for a measure, if it published one.
    #[must_use]
    pub fn figure(&self, measure: Measure) -> Option<f64> {
        let mut figures = MEASURES.iter().zip(self.figures);
        let found = figures.find(|(of, _)| **of == measure);
        found.map(|(_, figure)| figure)
    }
}
