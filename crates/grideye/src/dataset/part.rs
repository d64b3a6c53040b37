//! The frames of one part, array by array, and both kinds of files that they are written as.

use super::frames::{Labelled, Studio};
use super::plan::Plan;
use crate::cli::Table;
use crate::export::npz::{Archive, header, single};
use crate::export::parquet::{Column, Values};
use anyhow::Result;
use grideye_scene::variation::Value;
use std::io::Write;

/// The labelled frames of a part.
pub(super) struct Part {
    pub(super) number: u64,
    size: (usize, usize),
    frame: Vec<u64>,
    time_s: Vec<f64>,
    noise_seed: Vec<u64>,
    celsius: Vec<f32>,
    truth_c: Vec<f32>,
    agents: Vec<Agent>,
    varied: Vec<Varied>,
}

/// The labels of one agent, frame by frame.
struct Agent {
    name: String,
    position_m: [Vec<Option<f64>>; 3],
    present: Vec<bool>,
    visibility: Vec<Option<f64>>,
    pixels: Vec<Option<f64>>,
    mask: Vec<f32>,
}

/// One thing that varies, frame by frame.
struct Varied {
    name: String,
    values: Scalars,
}

enum Scalars {
    Numbers(Vec<f64>),
    Texts(Vec<String>),
}

impl Part {
    /// A part without frames yet.
    pub(super) fn new(studio: &Studio, plan: &Plan, number: u64) -> Self {
        let agents = studio.agents.iter().map(|name| Agent::new(name.clone()));
        let varied = studio.recipe.columns().iter().map(|column| Varied {
            name: column.name.clone(),
            values: if column.is_number {
                Scalars::Numbers(Vec::new())
            } else {
                Scalars::Texts(Vec::new())
            },
        });
        Self {
            number,
            size: (plan.columns, plan.rows),
            frame: Vec::new(),
            time_s: Vec::new(),
            noise_seed: Vec::new(),
            celsius: Vec::new(),
            truth_c: Vec::new(),
            agents: agents.collect(),
            varied: varied.collect(),
        }
    }

    /// One more frame.
    pub(super) fn add(&mut self, labelled: &Labelled) -> Result<()> {
        self.frame.push(labelled.index);
        self.time_s.push(labelled.time.as_secs_f64());
        self.noise_seed.push(labelled.noise_seed);
        self.celsius
            .extend(labelled.celsius.iter().copied().map(single));
        self.truth_c
            .extend(labelled.truth_c.iter().copied().map(single));
        let pixels = self.size.0 * self.size.1;
        for (agent, label) in self.agents.iter_mut().zip(&labelled.agents) {
            let label = label.as_ref();
            agent.present.push(label.is_some());
            for (axis, values) in agent.position_m.iter_mut().enumerate() {
                values.push(label.map(|label| label.position_m[axis]));
            }
            agent.visibility.push(label.map(|label| label.visibility));
            agent.pixels.push(label.map(|label| label.pixels));
            match label {
                Some(label) => agent.mask.extend(label.mask.iter().copied().map(single)),
                None => agent.mask.resize(agent.mask.len() + pixels, 0.0),
            }
        }
        for (varied, value) in self.varied.iter_mut().zip(&labelled.varied) {
            match (&mut varied.values, value) {
                (Scalars::Numbers(numbers), Value::Number(number)) => numbers.push(*number),
                (Scalars::Texts(texts), Value::Text(text)) => texts.push(text.clone()),
                (Scalars::Texts(texts), Value::Number(number)) => texts.push(number.to_string()),
                (Scalars::Numbers(numbers), Value::Text(_)) => numbers.push(f64::NAN),
            }
        }
        Ok(())
    }

    /// Writes it as that kind of file.
    pub(super) fn write(
        &self,
        table: Table,
        plan: &Plan,
        out: &mut (impl Write + Send),
    ) -> Result<()> {
        let about = serde_json::to_string(plan)?;
        match table {
            Table::Npz => self.npz(&about, out),
            Table::Parquet => {
                let about = [
                    ("grideye.dataset", about),
                    ("grideye.part", self.number.to_string()),
                ];
                crate::export::parquet::write(&self.columns(), &about, out)
            }
        }
    }

    /// A row for each frame.
    fn columns(&self) -> Vec<Column> {
        let pixels = self.size.0 * self.size.1;
        let singles = |values: &[f32]| Values::Singles {
            per_row: pixels,
            values: values.to_vec(),
        };
        let always = |values: &[f64]| Values::Double(values.iter().copied().map(Some).collect());
        let mut columns = vec![
            Column::new("frame", Values::Unsigned(self.frame.clone())),
            Column::new("time_s", always(&self.time_s)),
            Column::new("noise_seed", Values::Unsigned(self.noise_seed.clone())),
            Column::new("celsius", singles(&self.celsius)),
            Column::new("truth_c", singles(&self.truth_c)),
        ];
        for agent in &self.agents {
            let named = |what: &str| format!("agent.{}.{what}", agent.name);
            columns.push(Column::new(
                named("present"),
                Values::Flag(agent.present.clone()),
            ));
            for (axis, values) in ["x_m", "y_m", "z_m"].iter().zip(&agent.position_m) {
                columns.push(Column::new(named(axis), Values::Double(values.clone())));
            }
            let visibility = Values::Double(agent.visibility.clone());
            columns.push(Column::new(named("visibility"), visibility));
            columns.push(Column::new(
                named("pixels"),
                Values::Double(agent.pixels.clone()),
            ));
            columns.push(Column::new(named("mask"), singles(&agent.mask)));
        }
        for varied in &self.varied {
            let values = match &varied.values {
                Scalars::Numbers(numbers) => always(numbers),
                Scalars::Texts(texts) => Values::Text(texts.clone()),
            };
            columns.push(Column::new(format!("vary.{}", varied.name), values));
        }
        columns
    }

    /// An array for each label, over all frames.
    fn npz(&self, about: &str, out: &mut impl Write) -> Result<()> {
        let mut archive = Arrays(Archive::new(out));
        let (columns, rows) = self.size;
        let count = self.frame.len();
        archive.texts("metadata.npy", "()", &[about])?;
        archive.array(
            "frame.npy",
            "<u8",
            &[count],
            self.frame.iter().map(|value| value.to_le_bytes()),
        )?;
        archive.doubles("time_s.npy", &[count], self.time_s.iter().copied())?;
        archive.array(
            "noise_seed.npy",
            "<u8",
            &[count],
            self.noise_seed.iter().map(|value| value.to_le_bytes()),
        )?;
        archive.singles(
            "celsius.npy",
            &[count, rows, columns],
            &mut self.celsius.iter(),
        )?;
        archive.singles(
            "truth_c.npy",
            &[count, rows, columns],
            &mut self.truth_c.iter(),
        )?;
        self.agent_arrays(&mut archive)?;
        self.varied_arrays(&mut archive)?;
        archive.0.finish()
    }

    /// What is told of each agent, frame by frame: an array for each, and the names.
    fn agent_arrays(&self, archive: &mut Arrays<impl Write>) -> Result<()> {
        let (columns, rows) = self.size;
        let (count, agents) = (self.frame.len(), self.agents.len());
        let names: Vec<&str> = self
            .agents
            .iter()
            .map(|agent| agent.name.as_str())
            .collect();
        archive.texts("agents.npy", &shape(&[agents]), &names)?;
        let frames = || 0..count;
        let of_agents = |pick: fn(&Agent) -> &Vec<Option<f64>>| {
            frames().flat_map(move |frame| {
                let agents = self.agents.iter();
                agents.map(move |agent| pick(agent)[frame].unwrap_or(f64::NAN))
            })
        };
        let flags = frames().flat_map(|frame| {
            let agents = self.agents.iter();
            agents.map(move |agent| [u8::from(agent.present[frame])])
        });
        archive.array("present.npy", "|b1", &[count, agents], flags)?;
        let positions = frames().flat_map(|frame| {
            self.agents.iter().flat_map(move |agent| {
                let axes = agent.position_m.iter();
                axes.map(move |axis| axis[frame].unwrap_or(f64::NAN))
            })
        });
        archive.doubles("position_m.npy", &[count, agents, 3], positions)?;
        archive.doubles(
            "visibility.npy",
            &[count, agents],
            of_agents(|agent| &agent.visibility),
        )?;
        archive.doubles(
            "pixels.npy",
            &[count, agents],
            of_agents(|agent| &agent.pixels),
        )?;
        let pixels = columns * rows;
        let mut masks = frames().flat_map(|frame| {
            let agents = self.agents.iter();
            agents.flat_map(move |agent| &agent.mask[frame * pixels..(frame + 1) * pixels])
        });
        archive.singles("mask.npy", &[count, agents, rows, columns], &mut masks)
    }

    /// Numbers side by side in one array, texts in another, each with the names.
    fn varied_arrays(&self, archive: &mut Arrays<impl Write>) -> Result<()> {
        let (mut names, mut numbers) = (Vec::new(), Vec::new());
        let (mut text_names, mut texts) = (Vec::new(), Vec::new());
        for varied in &self.varied {
            match &varied.values {
                Scalars::Numbers(values) => {
                    names.push(varied.name.as_str());
                    numbers.push(values);
                }
                Scalars::Texts(values) => {
                    text_names.push(varied.name.as_str());
                    texts.push(values);
                }
            }
        }
        let count = self.frame.len();
        archive.texts("vary_names.npy", &shape(&[names.len()]), &names)?;
        let values = (0..count).flat_map(|frame| numbers.iter().map(move |values| values[frame]));
        archive.doubles("vary.npy", &[count, names.len()], values)?;
        archive.texts(
            "vary_text_names.npy",
            &shape(&[text_names.len()]),
            &text_names,
        )?;
        let all: Vec<&str> = (0..count)
            .flat_map(|frame| texts.iter().map(move |values| values[frame].as_str()))
            .collect();
        archive.texts("vary_text.npy", &shape(&[count, text_names.len()]), &all)
    }
}

impl Agent {
    const fn new(name: String) -> Self {
        Self {
            name,
            position_m: [Vec::new(), Vec::new(), Vec::new()],
            present: Vec::new(),
            visibility: Vec::new(),
            pixels: Vec::new(),
            mask: Vec::new(),
        }
    }
}

/// An archive that takes whole arrays.
struct Arrays<W>(Archive<W>);

impl<W: Write> Arrays<W> {
    fn array<const N: usize>(
        &mut self,
        name: &'static str,
        dtype: &str,
        axes: &[usize],
        values: impl Iterator<Item = [u8; N]>,
    ) -> Result<()> {
        self.0.begin(name, &header(dtype, &shape(axes)))?;
        for value in values {
            self.0.add(&value)?;
        }
        self.0.end()
    }

    fn doubles(
        &mut self,
        name: &'static str,
        axes: &[usize],
        values: impl Iterator<Item = f64>,
    ) -> Result<()> {
        self.array(name, "<f8", axes, values.map(f64::to_le_bytes))
    }

    fn singles(
        &mut self,
        name: &'static str,
        axes: &[usize],
        values: &mut dyn Iterator<Item = &f32>,
    ) -> Result<()> {
        self.array(name, "<f4", axes, values.map(|value| value.to_le_bytes()))
    }

    /// Texts of one length, in code points, with zeros behind shorter ones.
    fn texts(&mut self, name: &'static str, shape: &str, texts: &[&str]) -> Result<()> {
        let length = texts.iter().map(|text| text.chars().count()).max();
        let length = length.unwrap_or(1).max(1);
        self.0.begin(name, &header(&format!("<U{length}"), shape))?;
        for text in texts {
            let padding = std::iter::repeat_n('\0', length - text.chars().count());
            for character in text.chars().chain(padding) {
                self.0.add(&u32::from(character).to_le_bytes())?;
            }
        }
        self.0.end()
    }
}

/// A tuple as Python writes it.
fn shape(axes: &[usize]) -> String {
    match axes {
        [only] => format!("({only},)"),
        _ => {
            let axes: Vec<String> = axes.iter().map(ToString::to_string).collect();
            format!("({})", axes.join(", "))
        }
    }
}
