//! How far a scene may be from the room and still be right: the laws of its file, or defaults.

use crate::model::scene::Scene;
use crate::model::uncertain::{Claim, OF_PEOPLE, Uncertain};

/// How well a scene is known.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Laws {
    /// One for each of [`Scene::agents`], in their order.
    pub agents: Vec<AgentLaws>,
    /// Standard deviation of the delay that stays unknown, seconds.
    pub lag_sd_s: f64,
    /// Standard deviation of the unknown constant difference of each pixel, °C, if the file gives it.
    pub background_sd_c: Option<f64>,
    /// Numbers of the file that have a normal law.
    pub numbers: Vec<Uncertain>,
    /// Which law comes from where, a sentence each: a line of the file, or a default with its source.
    pub source: Vec<String>,
}

/// How well one agent is known.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct AgentLaws {
    /// Standard deviation of its constant unknown offset, in x and in y, meters.
    pub place_sd_m: f64,
    /// Standard deviation of its wander about its way, in x and in y, meters; 0 if it stands and no table
    /// names it.
    pub wander_sd_m: f64,
    /// Correlation time of the wander, seconds.
    pub wander_over_s: f64,
    /// Standard deviation of the natural logarithm of its warmth over the room.
    pub contrast_sd: f64,
    /// Standard deviation of how each pixel of what it shows differs from its model, as a share, over the time of the wander.
    pub looks_sd: f64,
}

/// A tracked place is good to 5 to 10 cm; between two clothed people the contrast differs 1.5 to 1.7 times, whose
/// logarithm is about √2 times this standard deviation. Each pixel of what they show differs by .2 of it from their model with
/// each frame's own place and contrast; part of that is the tracker's. Measured on two people of open-thermopile-dataset.
const DEFAULT: AgentLaws = AgentLaws {
    place_sd_m: 0.07,
    wander_sd_m: 0.07,
    wander_over_s: WANDER_OVER_S,
    contrast_sd: 0.35,
    looks_sd: 0.15,
};
pub(crate) const WANDER_OVER_S: f64 = 0.7;
const LAG_SD_S: f64 = 0.07;
const MEASURED: &str =
    "measured on two people of open-thermopile-dataset, doi 10.1109/JIOT.2022.3161646";

impl Scene {
    /// What the scene does not know exactly: its `[[uncertain]]` tables, in the order of the file.
    #[must_use]
    pub fn uncertain(&self) -> &[Uncertain] {
        &self.uncertain
    }

    /// How well the scene is known. A table of one agent comes before one of `*`, and both before the defaults.
    #[must_use]
    pub fn laws(&self) -> Laws {
        let mut source = Vec::new();
        let given = self.uncertain.iter();
        let given = given.filter_map(|one| Some((one, one.known()?.sd)));
        source.extend(given.clone().map(|(one, sd)| told(one, sd)));
        let start = given
            .clone()
            .find(|(one, _)| Claim::of(&one.key) == Some(Claim::Start));
        let background = given
            .clone()
            .find(|(one, _)| Claim::of(&one.key) == Some(Claim::Background));
        let numbers = given.filter(|(one, _)| one.value_span.is_some());
        if start.is_none() {
            source.push(format!(
                "delay: sd {LAG_SD_S} s by default, less than a frame's time at 10 Hz"
            ));
        }
        Laws {
            agents: self.agent_laws(&mut source),
            lag_sd_s: start.map_or(LAG_SD_S, |(_, sd)| sd),
            background_sd_c: background.map(|(_, sd)| sd),
            numbers: numbers.map(|(one, _)| one.clone()).collect(),
            source,
        }
    }

    fn agent_laws(&self, source: &mut Vec<String>) -> Vec<AgentLaws> {
        let mut by_default: [Vec<&str>; 3] = Default::default();
        let laws = self.agents.iter().map(|agent| {
            let name = agent.name.as_str();
            let stands = agent.trajectory.is_none();
            let mut sds = [None; 3];
            let mut over_s = DEFAULT.wander_over_s;
            for owner in ["*", name] {
                for one in &self.uncertain {
                    let (law, which) = match Claim::of(&one.key) {
                        Some(Claim::Aside(of)) => (0, of),
                        Some(Claim::Wander(of)) => (1, of),
                        Some(Claim::Contrast(of)) => (2, of),
                        _ => continue,
                    };
                    let is_for_walkers = law == 1 && stands && owner == "*";
                    if which == owner && !is_for_walkers {
                        sds[law] = one.law.map(|law| law.sd).or(sds[law]);
                        over_s = one.over_s.unwrap_or(over_s);
                    }
                }
            }
            if stands {
                // Without a way there is nothing to wander about, unless the file says so of this agent.
                sds[1] = sds[1].or(Some(0.0));
            }
            for (sd, names) in sds.iter().zip(&mut by_default) {
                if sd.is_none() {
                    names.push(name);
                }
            }
            AgentLaws {
                place_sd_m: sds[0].unwrap_or(DEFAULT.place_sd_m),
                wander_sd_m: sds[1].unwrap_or(DEFAULT.wander_sd_m),
                wander_over_s: over_s,
                contrast_sd: sds[2].unwrap_or(DEFAULT.contrast_sd),
                ..DEFAULT
            }
        });
        let laws: Vec<AgentLaws> = laws.collect();
        let AgentLaws {
            place_sd_m,
            wander_sd_m,
            wander_over_s,
            contrast_sd,
            looks_sd,
        } = DEFAULT;
        let told = [
            format!(
                "place: sd {place_sd_m} m in x and in y by default; a tracked place is good to 5 to 10 cm"
            ),
            format!(
                "wander about its way: sd {wander_sd_m} m over {wander_over_s} s by default; a tracked place is good to 5 to 10 cm"
            ),
            format!(
                "contrast: sd {contrast_sd} of its logarithm by default; two clothed people differ 1.5 to 1.7 times"
            ),
        ];
        for (names, told) in by_default.iter().zip(told) {
            if !names.is_empty() {
                source.push(format!("`{}`, {told} ({MEASURED})", names.join("`, `")));
            }
        }
        if !laws.is_empty() {
            source.push(format!(
                "looks: each pixel of what people show, sd {looks_sd} of it; two people differ by .2 from their models ({MEASURED})"
            ));
        }
        laws
    }
}

/// Where the file has a law.
fn told(one: &Uncertain, sd: f64) -> String {
    let (key, file, line) = (&one.key, &one.place.file, one.place.line);
    if one.found_sd.is_some() {
        return format!("`{key}`: sd {sd}, as calibrated ({file}:{line})");
    }
    let mut of_people = OF_PEOPLE.iter();
    if of_people.any(|(end, law)| key.ends_with(end) && one.law == Some(*law)) {
        return format!("`{key}`: sd {sd}, as of adults (ANSUR II, ISO 9920; {file}:{line})");
    }
    match one.over_s {
        Some(over_s) => format!("`{key}`: sd {sd} over {over_s} s ({file}:{line})"),
        None => format!("`{key}`: sd {sd} ({file}:{line})"),
    }
}
