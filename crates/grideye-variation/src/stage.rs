//! Gives people who do something their ways through a scene: they meet neither objects nor one another.

use crate::acts::Choice;
use crate::asked::Asked;
use crate::chance::generator;
use crate::error::Mistake;
use crate::target::Edit;
use crate::way::{Stage, Way};
use grideye_scene::key::Table;
use grideye_scene::{Files, Scene};
use std::collections::BTreeMap;
use std::io;
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
    /// The first writes the trajectory, the others remove what it replaces.
    pub(crate) edits: Vec<Edit>,
    file: String,
}

/// What a trajectory replaces in an agent's table.
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
        let edits = replaced.map(|(key, value)| Edit {
            range: key.span().start..value.span().end,
            before: String::new(),
            after: String::new(),
        });
        Ok(Self {
            asked: asked.clone(),
            agent: agent.to_owned(),
            choices,
            edits: edits.collect(),
            // No file on a disk has this name, and no other agent this key.
            file: format!("drawn: {}", asked.key.replace(['/', '\\'], "_")),
        })
    }

    /// The edits that give it this way.
    pub(crate) fn edited(&self, way: &Way) -> Vec<(&Edit, String)> {
        let file = toml::Value::from(self.file.as_str());
        let keys = format!("trajectory = {file}\nyaw_deg = {:?}", way.yaw_deg);
        let values = std::iter::once(keys).chain(std::iter::repeat(String::new()));
        self.edits.iter().zip(values).collect()
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
    let walkers: Vec<_> = others
        .iter()
        .filter(|agent| agent.trajectory.is_some())
        .collect();
    let mut generators: Vec<_> = actors
        .iter()
        .map(|(actor, _)| generator(seed, &format!("{} way", actor.asked.key), index))
        .collect();
    let mut stuck = 0;
    for _ in 0..STARTS_MAX {
        let mut ways: Vec<Option<Way>> = Vec::new();
        for (number, (actor, choice)) in actors.iter().enumerate() {
            let agent = scene
                .agents()
                .iter()
                .find(|agent| agent.name == actor.agent);
            let Some(agent) = agent else {
                ways.push(None);
                continue;
            };
            let found = (0..WAYS_MAX).find_map(|_| {
                let way = stage.way(agent, &choice.acts, &mut generators[number])?;
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

/// The files of a scene, and the trajectories drawn for it.
pub(crate) struct Drawn<'a> {
    files: &'a dyn Files,
    ways: BTreeMap<&'a str, String>,
}

impl<'a> Drawn<'a> {
    pub(crate) fn new(
        files: &'a dyn Files,
        ways: impl Iterator<Item = (&'a Actor, &'a Way)>,
    ) -> Self {
        Self {
            files,
            ways: ways
                .map(|(actor, way)| (actor.file.as_str(), way.csv()))
                .collect(),
        }
    }
}

impl Files for Drawn<'_> {
    fn read(&self, relative: &str) -> io::Result<String> {
        match self.ways.get(relative) {
            Some(way) => Ok(way.clone()),
            None => self.files.read(relative),
        }
    }
}
