//! The results that the paper published, to stand beside ours, always marked as the paper's.
//!
//! Source: Comai et al. 2025, "A configurable simulator for low-resolution infrared thermal sensors: accuracy
//! assessment and practical applications in indoor environments", PeerJ Computer Science 11:e3124,
//! Tables 1 to 4 (CC BY 4.0). Its Table 5 repeats experiment 4 with C 0.48 and mutual information 2.9; the figures
//! here are those of the experiments' own tables.

use crate::metrics::score::Measure;

/// How to cite the source of these figures.
pub const CITATION: &str =
    "Comai et al. 2025, PeerJ Computer Science 11:e3124, https://doi.org/10.7717/peerj-cs.3124";

/// The published figures of one experiment. Entropies and information are in bits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Experiment {
    /// 1 to 4, as the paper counts; also the number of its table.
    pub number: u8,
    /// The set-up in a few words.
    pub title: &'static str,
    /// C, Pearson's correlation.
    pub correlation: f64,
    /// Entropy of the real images.
    pub entropy_real: f64,
    /// Entropy of the simulated images.
    pub entropy_simulated: f64,
    /// Joint entropy.
    pub joint_entropy: f64,
    /// Mutual information.
    pub mutual_information: f64,
    /// IS, a share of 0 to 1.
    pub image_similarity: f64,
}

/// Experiments 1 to 4, in order.
pub const EXPERIMENTS: [Experiment; 4] = [
    Experiment {
        number: 1,
        title: "static, person centred below the sensor",
        correlation: 0.79,
        entropy_real: 3.5,
        entropy_simulated: 5.2,
        joint_entropy: 5.9,
        mutual_information: 2.8,
        image_similarity: 0.95,
    },
    Experiment {
        number: 2,
        title: "static, person in a corner of the view",
        correlation: 0.71,
        entropy_real: 3.3,
        entropy_simulated: 4.5,
        joint_entropy: 5.9,
        mutual_information: 1.9,
        image_similarity: 0.90,
    },
    Experiment {
        number: 3,
        title: "dynamic, person walking below the sensor",
        correlation: 0.58,
        entropy_real: 3.2,
        entropy_simulated: 4.7,
        joint_entropy: 5.9,
        mutual_information: 2.0,
        image_similarity: 0.94,
    },
    Experiment {
        number: 4,
        title: "dynamic, sensor at the left and tilted by 30 degrees",
        correlation: 0.49,
        entropy_real: 2.9,
        entropy_simulated: 4.6,
        joint_entropy: 5.9,
        mutual_information: 1.6,
        image_similarity: 0.92,
    },
];

/// The experiment of a number from 1 to 4.
#[must_use]
pub fn experiment(number: u8) -> Option<&'static Experiment> {
    EXPERIMENTS
        .iter()
        .find(|experiment| experiment.number == number)
}

impl Experiment {
    /// The paper's figure for one of our measures, where it published one.
    #[must_use]
    pub const fn figure(&self, measure: Measure) -> Option<f64> {
        match measure {
            Measure::Correlation => Some(self.correlation),
            Measure::EntropyRealGrey => Some(self.entropy_real),
            Measure::EntropySimulatedGrey => Some(self.entropy_simulated),
            Measure::JointEntropyGrey => Some(self.joint_entropy),
            Measure::MutualInformationGrey => Some(self.mutual_information),
            Measure::ImageSimilarity => Some(self.image_similarity),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_those_of_tables_1_to_4() {
        let measures = [
            Measure::Correlation,
            Measure::EntropyRealGrey,
            Measure::EntropySimulatedGrey,
            Measure::JointEntropyGrey,
            Measure::MutualInformationGrey,
            Measure::ImageSimilarity,
        ];
        let row =
            |number| measures.map(|measure| experiment(number).unwrap().figure(measure).unwrap());
        assert_eq!(row(1), [0.79, 3.5, 5.2, 5.9, 2.8, 0.95]);
        assert_eq!(row(2), [0.71, 3.3, 4.5, 5.9, 1.9, 0.90]);
        assert_eq!(row(3), [0.58, 3.2, 4.7, 5.9, 2.0, 0.94]);
        assert_eq!(row(4), [0.49, 2.9, 4.6, 5.9, 1.6, 0.92]);
        assert_eq!(experiment(5), None);
        assert_eq!(EXPERIMENTS[0].figure(Measure::Rmse), None);
    }
}
