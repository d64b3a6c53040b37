//! Both kinds of files that a part of a dataset is written as.

use anyhow::Result;
use grideye_dataset::{AgentLabels, Part, Scalars, Table};
use grideye_export::npz::{Archive, header};
use grideye_export::parquet::{Column, Values};
use std::io::Write;

/// Writes a part as that kind of file, with these words about its dataset.
pub(super) fn write(
    part: &Part,
    table: Table,
    about: &str,
    out: &mut (impl Write + Send),
) -> Result<()> {
    match table {
        Table::Npz => npz(part, about, out),
        Table::Parquet => {
            let about = [
                ("grideye.dataset", about.to_owned()),
                ("grideye.part", part.number.to_string()),
            ];
            Ok(grideye_export::parquet::write(&columns(part), &about, out)?)
        }
    }
}

/// A row for each frame.
fn columns(part: &Part) -> Vec<Column> {
    let pixels = part.size.0 * part.size.1;
    let singles = |values: &[f32]| Values::Singles {
        per_row: pixels,
        values: values.to_vec(),
    };
    let always = |values: &[f64]| Values::Double(values.iter().copied().map(Some).collect());
    let mut columns = vec![
        Column::new("frame", Values::Unsigned(part.frame.clone())),
        Column::new("time_s", always(&part.time_s)),
        Column::new("noise_seed", Values::Unsigned(part.noise_seed.clone())),
        Column::new("celsius", singles(&part.celsius)),
        Column::new("truth_c", singles(&part.truth_c)),
    ];
    for agent in &part.agents {
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
    for varied in &part.varied {
        let values = match &varied.values {
            Scalars::Numbers(numbers) => always(numbers),
            Scalars::Texts(texts) => Values::Text(texts.clone()),
        };
        columns.push(Column::new(format!("vary.{}", varied.name), values));
    }
    columns
}

/// An array for each label, over all frames.
fn npz(part: &Part, about: &str, out: &mut impl Write) -> Result<()> {
    let mut archive = Arrays(Archive::new(out));
    let (columns, rows) = part.size;
    let count = part.frame.len();
    archive.texts("metadata.npy", "()", &[about])?;
    archive.array(
        "frame.npy",
        "<u8",
        &[count],
        part.frame.iter().map(|value| value.to_le_bytes()),
    )?;
    archive.doubles("time_s.npy", &[count], part.time_s.iter().copied())?;
    archive.array(
        "noise_seed.npy",
        "<u8",
        &[count],
        part.noise_seed.iter().map(|value| value.to_le_bytes()),
    )?;
    archive.singles(
        "celsius.npy",
        &[count, rows, columns],
        &mut part.celsius.iter(),
    )?;
    archive.singles(
        "truth_c.npy",
        &[count, rows, columns],
        &mut part.truth_c.iter(),
    )?;
    agent_arrays(part, &mut archive)?;
    varied_arrays(part, &mut archive)?;
    Ok(archive.0.finish()?)
}

/// What is told of each agent, frame by frame: an array for each, and the names.
fn agent_arrays(part: &Part, archive: &mut Arrays<impl Write>) -> Result<()> {
    let (columns, rows) = part.size;
    let (count, agents) = (part.frame.len(), part.agents.len());
    let names: Vec<&str> = part
        .agents
        .iter()
        .map(|agent| agent.name.as_str())
        .collect();
    archive.texts("agents.npy", &shape(&[agents]), &names)?;
    let frames = || 0..count;
    let of_agents = |pick: fn(&AgentLabels) -> &Vec<Option<f64>>| {
        frames().flat_map(move |frame| {
            let agents = part.agents.iter();
            agents.map(move |agent| pick(agent)[frame].unwrap_or(f64::NAN))
        })
    };
    let flags = frames().flat_map(|frame| {
        let agents = part.agents.iter();
        agents.map(move |agent| [u8::from(agent.present[frame])])
    });
    archive.array("present.npy", "|b1", &[count, agents], flags)?;
    let positions = frames().flat_map(|frame| {
        part.agents.iter().flat_map(move |agent| {
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
        let agents = part.agents.iter();
        agents.flat_map(move |agent| &agent.mask[frame * pixels..(frame + 1) * pixels])
    });
    archive.singles("mask.npy", &[count, agents, rows, columns], &mut masks)
}

/// Numbers side by side in one array, texts in another, each with the names.
fn varied_arrays(part: &Part, archive: &mut Arrays<impl Write>) -> Result<()> {
    let (mut names, mut numbers) = (Vec::new(), Vec::new());
    let (mut text_names, mut texts) = (Vec::new(), Vec::new());
    for varied in &part.varied {
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
    let count = part.frame.len();
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
        Ok(self.0.end()?)
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
        Ok(self.0.end()?)
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
