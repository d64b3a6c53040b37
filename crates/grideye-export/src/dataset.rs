//! Writes a part of a dataset as npz, npy or Parquet.

use crate::error::ExportError;
use crate::npz::Archive;
use crate::parquet::{self, Column, Values};
use crate::records::{self, WORDS};
use grideye_dataset::{AgentLabels, Part, Scalars, Table};
use std::io::Write;

/// Writes a part as `table`, with the dataset's description `about`.
///
/// # Errors
/// If writing fails, or the format has no room for so many frames.
pub fn write(
    part: &Part,
    table: Table,
    about: &str,
    out: &mut (impl Write + Send),
) -> Result<(), ExportError> {
    match table {
        Table::Npz => npz(part, about, out),
        Table::Npy => {
            let about: serde_json::Value = serde_json::from_str(about).unwrap_or_default();
            let fingerprint = about["fingerprint"].as_str().unwrap_or_default();
            records::write(part, fingerprint, out)
        }
        Table::Parquet => {
            let about = [
                ("grideye.dataset", about.to_owned()),
                ("grideye.part", part.number.to_string()),
            ];
            let columns = columns(part);
            let mut table = parquet::Table::new(&columns, &about, out)?;
            table.add(&columns)?;
            table.finish()
        }
    }
}

/// One row per frame.
fn columns(part: &Part) -> Vec<Column> {
    let per_row = part.size.0 * part.size.1;
    let singles = |values: &[f32]| Values::Singles {
        per_row,
        values: values.to_vec(),
    };
    let always = |values: &[f64]| Values::Double(values.iter().copied().map(Some).collect());
    let mut columns = vec![
        Column::new("frame", Values::Unsigned(part.frame.clone())),
        Column::new("clip", Values::Unsigned(part.clip.clone())),
        Column::new("time_s", always(&part.time_s)),
        Column::new("noise_seed", Values::Unsigned(part.noise_seed.clone())),
        Column::new("celsius", singles(&part.celsius)),
        Column::new("truth_c", singles(&part.truth_c)),
        Column::new("people", Values::Unsigned(part.people.clone())),
    ];
    for agent in &part.agents {
        let [x_m, y_m, z_m] = agent.position_m.clone().map(Values::Double);
        let [column, row] = agent.center_px.clone().map(Values::Double);
        let [left, top, right, bottom] = agent.box_px.clone().map(Values::Double);
        let names = |names: &[Option<&str>]| {
            let names = names.iter().map(|name| name.map(str::to_owned));
            Values::MaybeText(names.collect())
        };
        let labels = [
            ("present", Values::Flag(agent.present.clone())),
            ("x_m", x_m),
            ("y_m", y_m),
            ("z_m", z_m),
            ("visibility", Values::Double(agent.visibility.clone())),
            ("pixels", Values::Double(agent.pixels.clone())),
            ("contrast_c", Values::Double(agent.contrast_c.clone())),
            ("counts", Values::Flag(agent.counts.clone())),
            ("column", column),
            ("row", row),
            ("left", left),
            ("top", top),
            ("right", right),
            ("bottom", bottom),
            ("posture", names(&agent.posture)),
            ("doing", names(&agent.doing)),
            ("mask", singles(&agent.mask)),
        ];
        let name = |what| format!("agent.{}.{what}", agent.name);
        columns.extend(labels.map(|(what, values)| Column::new(name(what), values)));
    }
    columns.extend(part.varied.iter().map(|varied| {
        let values = match &varied.values {
            Scalars::Numbers(numbers) => always(numbers),
            Scalars::Texts(texts) => Values::Text(texts.clone()),
        };
        Column::new(format!("vary.{}", varied.name), values)
    }));
    columns
}

/// One array per label, over all frames.
fn npz(part: &Part, about: &str, out: &mut impl Write) -> Result<(), ExportError> {
    let mut archive = Archive::new(out);
    let (columns, rows) = part.size;
    let count = part.frame.len();
    let whole = |values: &[u64]| -> Vec<[u8; 8]> {
        values.iter().map(|value| value.to_le_bytes()).collect()
    };
    let image = [count, rows, columns];
    archive.texts("metadata.npy", &[], &[about])?;
    archive.array("frame.npy", "<u8", &[count], whole(&part.frame))?;
    archive.array("clip.npy", "<u8", &[count], whole(&part.clip))?;
    archive.array(
        "time_s.npy",
        "<f8",
        &[count],
        doubles(part.time_s.iter().copied()),
    )?;
    archive.array("noise_seed.npy", "<u8", &[count], whole(&part.noise_seed))?;
    archive.array("celsius.npy", "<f4", &image, singles(&part.celsius))?;
    archive.array("truth_c.npy", "<f4", &image, singles(&part.truth_c))?;
    archive.array("people.npy", "<u8", &[count], whole(&part.people))?;
    agent_arrays(part, &mut archive)?;
    varied_arrays(part, &mut archive)?;
    archive.finish()
}

fn doubles(values: impl Iterator<Item = f64>) -> impl Iterator<Item = [u8; 8]> {
    values.map(f64::to_le_bytes)
}

fn singles<'a>(values: impl IntoIterator<Item = &'a f32>) -> impl Iterator<Item = [u8; 4]> {
    values.into_iter().map(|value| value.to_le_bytes())
}

/// The labels of all agents per frame: one array per label, and the names.
fn agent_arrays(part: &Part, archive: &mut Archive<impl Write>) -> Result<(), ExportError> {
    let (columns, rows) = part.size;
    let (count, agents) = (part.frame.len(), part.agents.len());
    let pixels = columns * rows;
    let names: Vec<&str> = part
        .agents
        .iter()
        .map(|agent| agent.name.as_str())
        .collect();
    archive.texts("agents.npy", &[agents], &names)?;
    let each = || (0..count).flat_map(|frame| part.agents.iter().map(move |agent| (agent, frame)));
    let or_nan = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let of_agents = |pick: fn(&AgentLabels) -> &Vec<Option<f64>>| {
        doubles(each().map(move |(agent, frame)| or_nan(pick(agent)[frame])))
    };
    let flags = each().map(|(agent, frame)| [u8::from(agent.present[frame])]);
    archive.array("present.npy", "|b1", &[count, agents], flags)?;
    let positions = each().flat_map(|(agent, frame)| {
        let axes = agent.position_m.iter();
        axes.map(move |axis| or_nan(axis[frame]))
    });
    archive.array(
        "position_m.npy",
        "<f8",
        &[count, agents, 3],
        doubles(positions),
    )?;
    let visibility = of_agents(|agent| &agent.visibility);
    archive.array("visibility.npy", "<f8", &[count, agents], visibility)?;
    let filled = of_agents(|agent| &agent.pixels);
    archive.array("pixels.npy", "<f8", &[count, agents], filled)?;
    let contrasts = of_agents(|agent| &agent.contrast_c);
    archive.array("contrast_c.npy", "<f8", &[count, agents], contrasts)?;
    let counts = each().map(|(agent, frame)| [u8::from(agent.counts[frame])]);
    archive.array("counts.npy", "|b1", &[count, agents], counts)?;
    let centers = each().flat_map(|(agent, frame)| {
        let axes = agent.center_px.iter();
        axes.map(move |axis| or_nan(axis[frame]))
    });
    let centers = doubles(centers);
    archive.array("center_px.npy", "<f8", &[count, agents, 2], centers)?;
    let boxes = each().flat_map(|(agent, frame)| {
        let edges = agent.box_px.iter();
        edges.map(move |edge| or_nan(edge[frame]))
    });
    archive.array("box_px.npy", "<f8", &[count, agents, 4], doubles(boxes))?;
    for (name, (_, of)) in ["posture.npy", "doing.npy"].into_iter().zip(WORDS) {
        let names = each().map(|(agent, frame)| of(agent)[frame].unwrap_or_default());
        archive.texts(name, &[count, agents], &names.collect::<Vec<_>>())?;
    }
    let masks = each().flat_map(|(agent, frame)| &agent.mask[frame * pixels..][..pixels]);
    archive.array(
        "mask.npy",
        "<f4",
        &[count, agents, rows, columns],
        singles(masks),
    )
}

/// Varied numbers in one array, texts in another, each with their names.
fn varied_arrays(part: &Part, archive: &mut Archive<impl Write>) -> Result<(), ExportError> {
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
    archive.texts("vary_names.npy", &[names.len()], &names)?;
    let values = (0..count).flat_map(|frame| numbers.iter().map(move |values| values[frame]));
    archive.array("vary.npy", "<f8", &[count, names.len()], doubles(values))?;
    archive.texts("vary_text_names.npy", &[text_names.len()], &text_names)?;
    let all = (0..count).flat_map(|frame| texts.iter().map(move |values| &values[frame]));
    let all: Vec<&String> = all.collect();
    archive.texts("vary_text.npy", &[count, text_names.len()], &all)
}
