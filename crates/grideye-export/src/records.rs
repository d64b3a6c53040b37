//! A part of a dataset as one `.npy` file of records, one per frame, which `numpy.load(…, mmap_mode="r")` maps.
//!
//! Larger types come first and records are padded to eight bytes, so that every field is aligned.

use crate::error::ExportError;
use crate::npz::{header_of, tuple};
use grideye_dataset::{AgentLabels, Part, Scalars};
use std::fmt::Write as _;
use std::io::Write;

/// One field of all records.
struct Field<'a> {
    name: String,
    dtype: String,
    axes: Vec<usize>,
    bytes: usize,
    /// Appends the field of a frame.
    put: Put<'a>,
}

type Put<'a> = Box<dyn Fn(usize, &mut Vec<u8>) + 'a>;

/// Characters of a posture, and of what a person does.
const WORD: usize = 8;
const ALIGNED: usize = 8;

pub(crate) fn write(
    part: &Part,
    fingerprint: &str,
    out: &mut impl Write,
) -> Result<(), ExportError> {
    let fields = fields(part);
    let bytes: usize = fields.iter().map(|field| field.bytes).sum();
    let padding = bytes.next_multiple_of(ALIGNED) - bytes;
    let frames = part.frame.len();
    let whole = frames * (bytes + padding);
    // A title is another name of a field: the folder finds its own files by it, and those that were cut.
    let title = format!("grideye {fingerprint} {whole} bytes");
    let mut descr = "[".to_owned();
    for (number, field) in fields.iter().enumerate() {
        let name = match number {
            0 => format!("({}, {})", quoted(&title), quoted(&field.name)),
            _ => quoted(&field.name),
        };
        // Writing to a string cannot fail.
        let _ = match field.axes.is_empty() {
            true => write!(descr, "({name}, '{}'), ", field.dtype),
            false => write!(
                descr,
                "({name}, '{}', {}), ",
                field.dtype,
                tuple(&field.axes)
            ),
        };
    }
    if padding > 0 {
        let _ = write!(descr, "('', '|V{padding}'), ");
    }
    descr.push(']');
    let header = header_of(&descr, &[frames]);
    // Version 1.0 counts a header's bytes in sixteen bits.
    u16::try_from(header.len())?;
    out.write_all(&header)?;
    let mut record = Vec::with_capacity(bytes + padding);
    for frame in 0..frames {
        record.clear();
        for field in &fields {
            (field.put)(frame, &mut record);
        }
        record.resize(bytes + padding, 0);
        out.write_all(&record)?;
    }
    Ok(())
}

fn fields(part: &Part) -> Vec<Field<'_>> {
    let (columns, rows) = part.size;
    let (agents, pixels) = (part.agents.len(), columns * rows);
    let mut fields = vec![
        whole("frame", &part.frame),
        whole("clip", &part.clip),
        doubles("time_s", &[], |frame| vec![part.time_s[frame]]),
        whole("noise_seed", &part.noise_seed),
        whole("people", &part.people),
    ];
    let or_nan = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let mut of_agents = |name, length: usize, pick: fn(&AgentLabels) -> Vec<&Vec<Option<f64>>>| {
        let axes = if length == 1 {
            vec![agents]
        } else {
            vec![agents, length]
        };
        let field = doubles(name, &axes, move |frame| {
            let each = part.agents.iter().flat_map(pick);
            each.map(|values| or_nan(values[frame])).collect()
        });
        fields.push(field);
    };
    of_agents("position_m", 3, |agent| agent.position_m.iter().collect());
    of_agents("visibility", 1, |agent| vec![&agent.visibility]);
    of_agents("pixels", 1, |agent| vec![&agent.pixels]);
    of_agents("contrast_c", 1, |agent| vec![&agent.contrast_c]);
    of_agents("center_px", 2, |agent| agent.center_px.iter().collect());
    of_agents("box_px", 4, |agent| agent.box_px.iter().collect());
    for varied in &part.varied {
        if let Scalars::Numbers(numbers) = &varied.values {
            let name = format!("vary.{}", varied.name);
            fields.push(doubles(&name, &[], |frame| vec![numbers[frame]]));
        }
    }
    let image = move |values: &[f32], frame: usize, record: &mut Vec<u8>| {
        let values = &values[frame * pixels..][..pixels];
        record.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    };
    let size = vec![rows, columns];
    fields.push(singles("celsius", size.clone(), move |frame, record| {
        image(&part.celsius, frame, record);
    }));
    fields.push(singles("truth_c", size, move |frame, record| {
        image(&part.truth_c, frame, record);
    }));
    let masks = vec![agents, rows, columns];
    fields.push(singles("mask", masks, move |frame, record| {
        for agent in &part.agents {
            image(&agent.mask, frame, record);
        }
    }));
    fields.extend(words(part));
    fields
}

type Words = fn(&AgentLabels) -> &Vec<Option<&'static str>>;
/// The words that label an agent.
pub(crate) const WORDS: [(&str, Words); 2] = [
    ("posture", |agent| &agent.posture),
    ("doing", |agent| &agent.doing),
];

type OfAgent<T> = fn(&AgentLabels) -> &Vec<T>;
const FLAGS: [(&str, OfAgent<bool>); 2] = [
    ("present", |agent| &agent.present),
    ("counts", |agent| &agent.counts),
];

/// Texts and flags.
fn words(part: &Part) -> Vec<Field<'_>> {
    let agents = part.agents.len();
    let mut fields = Vec::new();
    for (name, of) in WORDS {
        fields.push(texts(name, (vec![agents], WORD), move |frame| {
            let words = part
                .agents
                .iter()
                .map(|agent| of(agent)[frame].unwrap_or_default());
            words.map(str::to_owned).collect()
        }));
    }
    for varied in &part.varied {
        if let Scalars::Texts(values) = &varied.values {
            let name = format!("vary.{}", varied.name);
            let longest = values.iter().map(|text| text.chars().count()).max();
            let longest = longest.unwrap_or(0).max(1);
            fields.push(texts(&name, (Vec::new(), longest), |frame| {
                vec![values[frame].clone()]
            }));
        }
    }
    for (name, of) in FLAGS {
        fields.push(Field {
            name: name.to_owned(),
            dtype: "|b1".to_owned(),
            axes: vec![agents],
            bytes: agents,
            put: Box::new(move |frame, record| {
                record.extend(part.agents.iter().map(|agent| u8::from(of(agent)[frame])));
            }),
        });
    }
    fields
}

fn whole<'a>(name: &str, values: &'a [u64]) -> Field<'a> {
    Field {
        name: name.to_owned(),
        dtype: "<u8".to_owned(),
        axes: Vec::new(),
        bytes: 8,
        put: Box::new(|frame, record| record.extend(values[frame].to_le_bytes())),
    }
}

fn doubles<'a>(name: &str, axes: &[usize], values: impl Fn(usize) -> Vec<f64> + 'a) -> Field<'a> {
    Field {
        name: name.to_owned(),
        dtype: "<f8".to_owned(),
        axes: axes.to_vec(),
        bytes: 8 * axes.iter().product::<usize>(),
        put: Box::new(move |frame, record| {
            record.extend(values(frame).into_iter().flat_map(f64::to_le_bytes));
        }),
    }
}

fn singles<'a>(name: &str, axes: Vec<usize>, put: impl Fn(usize, &mut Vec<u8>) + 'a) -> Field<'a> {
    Field {
        name: name.to_owned(),
        dtype: "<f4".to_owned(),
        bytes: 4 * axes.iter().product::<usize>(),
        axes,
        put: Box::new(put),
    }
}

fn texts<'a>(
    name: &str,
    (axes, longest): (Vec<usize>, usize),
    values: impl Fn(usize) -> Vec<String> + 'a,
) -> Field<'a> {
    Field {
        name: name.to_owned(),
        dtype: format!("<U{longest}"),
        bytes: 4 * longest * axes.iter().product::<usize>(),
        axes,
        put: Box::new(move |frame, record| {
            for text in values(frame) {
                let characters = text.chars().map(u32::from).chain(std::iter::repeat(0));
                record.extend(characters.take(longest).flat_map(u32::to_le_bytes));
            }
        }),
    }
}

/// As Python's text in ASCII.
fn quoted(text: &str) -> String {
    let mut quoted = "'".to_owned();
    for letter in text.chars() {
        // Writing to a string cannot fail.
        let _ = match letter {
            '\'' | '\\' => write!(quoted, "\\{letter}"),
            ' '..='~' => write!(quoted, "{letter}"),
            _ => write!(quoted, "\\U{:08x}", u32::from(letter)),
        };
    }
    quoted.push('\'');
    quoted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_texts_of_python() {
        assert_eq!(quoted("vary.room.ambient_c"), "'vary.room.ambient_c'");
        // Python's ascii() of the same gives '\xe9' for é; both are the same text.
        assert_eq!(quoted("a'b\\é"), "'a\\'b\\\\\\U000000e9'");
    }
}
