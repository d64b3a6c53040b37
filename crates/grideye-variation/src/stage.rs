//! Gives people who do something their ways through a scene: they meet neither objects nor one another.

use crate::acts::Choice;
use crate::asked::Asked;
use crate::chance::generator;
use crate::error::Mistake;
use crate::target::Edit;
use crate::way::{Stage, Way, size_m};
use grideye_scene::Scene;
use grideye_scene::key::Table;
use toml::Spanned;
use toml::de::DeTable;

/// Ways tried for one person before all people start again, and how often they do.
const WAYS_MAX: usize = 50;
const STARTS_MAX: usize = 200;

/// A person who does something.
#[derive(Debug, Clone)]
pub(crate) struct Actor {
    pub(crate) asked: Asked,
    pub(crate) agent: String,
    pub(crate) choices: Vec<Choice>,
    /// What the way replaces in the scene's text.
    pub(crate) replaces: Vec<Edit>,
}

/// What a way replaces in an agent's table.
const REPLACED: [&str; 7] = [
    "position_mm",
    "trajectory",
    "speed_mm_per_s",
    "motion",
    "acceleration_mm_per_s2",
    "faces",
    "yaw_deg",
];

impl Actor {
    pub(crate) fn new(
        (text, document): (&str, &Spanned<DeTable<'_>>),
        (asked, agent): (&Asked, &str),
        choices: Vec<Choice>,
    ) -> Result<Self, Mistake> {
        let path = format!("agent.{agent}.yaw_deg");
        let (table, ..) = Table::root(text, document.get_ref()).find(&path)?;
        if table.entry("person").is_none() {
            let what = "only a person can do something\nhint: write agent.NAME.acts for an agent with person = {}";
            return Err(Mistake(what.to_owned()));
        }
        if table.is_inline {
            return Err(Mistake::not_addable("trajectory"));
        }
        let replaced = REPLACED.iter().filter_map(|key| table.entry(key));
        let replaces =
            replaced.map(|(key, value)| Edit::in_place(key.span().start..value.span().end));
        Ok(Self {
            asked: asked.clone(),
            agent: agent.to_owned(),
            choices,
            replaces: replaces.collect(),
        })
    }
}

/// One way for each actor who is in the scene; `Err` is the actor who found none.
pub(crate) fn ways(
    scene: &Scene,
    actors: &[(&Actor, &Choice)],
    is_placed: &dyn Fn(&str) -> bool,
    (seed, index): (u64, u64),
) -> Result<Vec<Option<Way>>, usize> {
    let acts = |name: &str| actors.iter().any(|(actor, _)| actor.agent == name);
    let others = scene.agents().iter();
    let others: Vec<_> = others
        .filter(|agent| !acts(&agent.name) && !is_placed(&agent.name))
        .collect();
    let stage = Stage::of(scene, &others);
    let others = others.iter();
    let walkers: Vec<_> = others.filter(|agent| agent.trajectory.is_some()).collect();
    let mut generators: Vec<_> = actors
        .iter()
        .map(|(actor, _)| generator(seed, &format!("{} way", actor.asked.key), index))
        .collect();
    let sizes = actors.iter().map(|(actor, _)| {
        let mut agents = scene.agents().iter();
        agents
            .find(|agent| agent.name == actor.agent)
            .and_then(size_m)
    });
    let sizes: Vec<Option<[f64; 2]>> = sizes.collect();
    let mut stuck = 0;
    for _ in 0..STARTS_MAX {
        let mut ways: Vec<Option<Way>> = Vec::new();
        for (number, (_, choice)) in actors.iter().enumerate() {
            let Some(size_m) = sizes[number] else {
                ways.push(None);
                continue;
            };
            let found = (0..WAYS_MAX).find_map(|_| {
                let way = stage.way(size_m, &choice.acts, &mut generators[number])?;
                let mut earlier = ways.iter().flatten();
                let meets = earlier.any(|other| way.meets(other))
                    || walkers.iter().any(|other| way.meets_agent(other));
                (!meets).then_some(way)
            });
            if found.is_none() {
                stuck = number;
                break;
            }
            ways.push(found);
        }
        if ways.len() == actors.len() {
            return Ok(ways);
        }
    }
    Err(stuck)
}

/// How many ways were tried for who found none.
pub(crate) const TRIES_MAX: usize = WAYS_MAX * STARTS_MAX;
