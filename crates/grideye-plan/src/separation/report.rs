//! The distances as a table and as JSON.

use super::distance::{D_PRIME_MIN, Distance, Separation};
use serde_json::json;

impl Separation {
    /// Whether all sensors together distinguish every two situations, ignoring changes that all pixels share.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        let everything: Vec<usize> = (0..self.sensors.len()).collect();
        smallest(self, &everything, |distance| distance.d_prime_of_shape) >= D_PRIME_MIN
    }

    /// The table for people, with these names of the situations.
    #[must_use]
    pub fn text(&self, names: &[String]) -> String {
        let mut text = String::from(
            "distance of situations in units of the noise, d' (5: one frame in 160 is mistaken)\n",
        );
        let width = names
            .iter()
            .map(|name| name.chars().count())
            .max()
            .unwrap_or(0);
        for (index, name) in names.iter().enumerate() {
            text.push_str(&format!("  {}  {name:<width$}\n", index + 1));
        }
        let measures: [(&str, Measure); 3] = [
            ("all that differs", |distance| distance.d_prime),
            ("less what all pixels have in common", |distance| {
                distance.d_prime_of_shape
            }),
            ("the warmest pixel alone", |distance| {
                distance.d_prime_of_warmest
            }),
        ];
        for (title, of) in measures {
            text.push_str(&format!("\n{title}\n  {:<16}", "sensors"));
            for pair in &self.pairs {
                let (one, other) = pair.situations;
                text.push_str(&format!("{:>10}", format!("{}-{}", one + 1, other + 1)));
            }
            text.push_str("  told apart\n");
            for group in groups(self.sensors.len()) {
                let sensors: Vec<&str> = group
                    .iter()
                    .map(|sensor| self.sensors[*sensor].as_str())
                    .collect();
                text.push_str(&format!("  {:<16}", sensors.join(" + ")));
                for pair in &self.pairs {
                    text.push_str(&format!("{:>10.1}", pair.together(&group, of)));
                }
                let are_apart = smallest(self, &group, of) >= D_PRIME_MIN;
                text.push_str(if are_apart { "  all\n" } else { "  not all\n" });
            }
        }
        text
    }

    /// All results, for programs.
    #[must_use]
    pub fn json(&self, names: &[String]) -> String {
        let pairs: Vec<serde_json::Value> = self
        .pairs
        .iter()
        .map(|pair| {
            let sensors: serde_json::Map<String, serde_json::Value> = self
                .sensors
                .iter()
                .zip(&pair.distances)
                .map(|(name, distance)| {
                    let value = json!({
                        "d_prime": distance.d_prime,
                        "d_prime_of_shape": distance.d_prime_of_shape,
                        "d_prime_of_warmest": distance.d_prime_of_warmest,
                    });
                    (name.clone(), value)
                })
                .collect();
            json!({"situations": [names[pair.situations.0], names[pair.situations.1]], "sensors": sensors})
        })
        .collect();
        format!(
            "{:#}\n",
            json!({"d_prime_min": D_PRIME_MIN, "pairs": pairs})
        )
    }
}

fn groups(sensors: usize) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = (0..sensors).map(|sensor| vec![sensor]).collect();
    for one in 0..sensors {
        groups.extend((one + 1..sensors).map(|other| vec![one, other]));
    }
    if sensors > 2 {
        groups.push((0..sensors).collect());
    }
    groups
}

fn smallest(found: &Separation, group: &[usize], of: impl Fn(&Distance) -> f64 + Copy) -> f64 {
    let distances = found.pairs.iter().map(|pair| pair.together(group, of));
    distances.fold(f64::INFINITY, f64::min)
}

type Measure = fn(&Distance) -> f64;
