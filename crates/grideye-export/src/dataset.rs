//! Writes a part of a dataset as npz, npy or Parquet, each from one list of labels.
//!
//! An npy file is one array of records, one per frame, which `numpy.load(…, mmap_mode="r")` maps: larger types come first and
//! records are padded to eight bytes, so that every field is aligned.

use crate::error::ExportError;
use crate::npy::{self, Archive, header, tuple};
use crate::parquet::{self, Column, Values};
use grideye_dataset::{AgentLabels, Label as OfAgent, Part, Scalars, Table};
use std::fmt::Write as _;
use std::io::Write;

/// What is known of each frame, or of each agent in it.
#[derive(Clone, Copy)]
enum Label<'a> {
    Whole(&'a [u64]),
    Number(&'a [f64]),
    Whether(&'a [bool]),
    /// And the characters of the longest.
    Text(&'a [String], usize),
    Image(&'a [f32]),
    /// Each agent's, with their columns' names.
    Numbers(&'static [&'static str], fn(&OfAgent) -> Option<&[f64]>),
    /// Each agent's; 0 while absent.
    Amount(fn(&OfAgent) -> f64),
    Word(fn(&OfAgent) -> Option<&'static str>),
    Flag(fn(&OfAgent) -> bool),
    Mask,
}

const OF_AGENTS: [(&str, Label<'static>); 11] = [
    ("present", Label::Flag(|_| true)),
    (
        "position_m",
        Label::Numbers(&["x_m", "y_m", "z_m"], |of| Some(&of.position_m)),
    ),
    ("visibility", Label::Amount(|of| of.visibility)),
    ("pixels", Label::Amount(|of| of.pixels)),
    ("contrast_c", Label::Amount(|of| of.contrast_c)),
    ("counts", Label::Flag(|of| of.counts)),
    (
        "center_px",
        Label::Numbers(&["column", "row"], |of| Some(of.center_px.as_ref()?)),
    ),
    (
        "box_px",
        Label::Numbers(&["left", "top", "right", "bottom"], |of| {
            Some(of.box_px.as_ref()?)
        }),
    ),
    ("posture", Label::Word(|of| of.posture)),
    ("doing", Label::Word(|of| of.doing)),
    ("mask", Label::Mask),
];

/// Characters of a posture, and of what a person does.
const WORD: usize = 8;

fn of_frames(part: &Part) -> [(&'static str, Label<'_>); 10] {
    [
        ("frame", Label::Whole(&part.frame)),
        ("clip", Label::Whole(&part.clip)),
        ("time_s", Label::Number(&part.time_s)),
        ("noise_seed", Label::Whole(&part.noise_seed)),
        ("celsius", Label::Image(&part.celsius)),
        ("truth_c", Label::Image(&part.truth_c)),
        ("empty_c", Label::Image(&part.empty_c)),
        ("excess_c", Label::Image(&part.excess_c)),
        ("clear", Label::Whether(&part.clear)),
        ("people", Label::Whole(&part.people)),
    ]
}

fn of_all(part: &Part) -> impl Iterator<Item = (&'static str, Label<'_>)> {
    of_frames(part).into_iter().chain(OF_AGENTS)
}

/// What varies, by its key.
fn varied(part: &Part) -> Vec<(&str, Label<'_>)> {
    let labels = part.varied.iter().map(|varied| {
        let label = match &varied.values {
            Scalars::Numbers(numbers) => Label::Number(numbers),
            Scalars::Texts(texts) => {
                let lengths = texts.iter().map(|text| text.chars().count());
                Label::Text(texts, lengths.max().unwrap_or(0).max(1))
            }
        };
        (varied.name.as_str(), label)
    });
    labels.collect()
}

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
        Table::Npy => npy(part, about, out),
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

/// The columns of the Parquet files of parts like this one, as the YAML heading of a data set on the Hugging Face Hub lists
/// them: a line of JSON each, which is YAML too.
#[must_use]
pub fn features(part: &Part) -> Vec<String> {
    let columns = columns(part).into_iter();
    let features = columns.map(|column| {
        serde_json::json!({"name": column.name(), "dtype": column.feature()}).to_string()
    });
    features.collect()
}

/// One row per frame.
fn columns(part: &Part) -> Vec<Column> {
    let image = |values: &[f32]| Values::Singles {
        axes: vec![part.size.1, part.size.0],
        values: values.to_vec(),
    };
    // What each frame has one of has one column, and so has what each agent has.
    let column = |label: Label<'_>, agent: Option<&AgentLabels>| match (label, agent) {
        (Label::Whole(values), _) => Some(Values::Unsigned(values.to_vec())),
        (Label::Number(values), _) => {
            Some(Values::Double(values.iter().copied().map(Some).collect()))
        }
        (Label::Whether(values), _) => Some(Values::Flag(values.to_vec())),
        (Label::Text(texts, _), _) => Some(Values::Text(texts.to_vec())),
        (Label::Image(values), _) => Some(image(values)),
        (Label::Mask, Some(agent)) => {
            let frames = agent.labels.iter();
            Some(image(
                &frames
                    .flat_map(|of| mask(part, of.as_ref()))
                    .collect::<Vec<_>>(),
            ))
        }
        (Label::Flag(is), Some(agent)) => {
            let flags = agent.labels.iter().map(|of| of.as_ref().is_some_and(is));
            Some(Values::Flag(flags.collect()))
        }
        (Label::Amount(of), Some(agent)) => {
            let frames = agent.labels.iter();
            let amounts = frames.map(|label| Some(label.as_ref().map_or(0.0, of)));
            Some(Values::Double(amounts.collect()))
        }
        (Label::Word(word), Some(agent)) => {
            let words = agent.labels.iter();
            let words = words.map(|of| word(of.as_ref()?).map(str::to_owned));
            Some(Values::MaybeText(words.collect()))
        }
        (
            Label::Numbers(..) | Label::Amount(_) | Label::Mask | Label::Flag(_) | Label::Word(_),
            _,
        ) => None,
    };
    let mut columns = Vec::new();
    let mut add = |name: String, values: Option<Values>| {
        columns.extend(values.map(|values| Column::new(name, values)));
    };
    for (name, label) in of_frames(part) {
        add(name.to_owned(), column(label, None));
    }
    for agent in &part.agents {
        for (name, label) in OF_AGENTS {
            if let Label::Numbers(names, of) = label {
                for (place, name) in names.iter().enumerate() {
                    let frames = agent.labels.iter();
                    let values = frames.map(|label| Some(of(label.as_ref()?)?[place]));
                    let values = Values::Double(values.collect());
                    add(format!("agent.{}.{name}", agent.name), Some(values));
                }
            }
            add(
                format!("agent.{}.{name}", agent.name),
                column(label, Some(agent)),
            );
        }
    }
    for (name, label) in varied(part) {
        add(format!("vary.{name}"), column(label, None));
    }
    columns
}

/// One array per label, over all frames.
fn npz(part: &Part, about: &str, out: &mut impl Write) -> Result<(), ExportError> {
    let mut archive = Archive::new(out);
    let count = part.frame.len();
    // First, so that the folder finds its own files.
    archive.texts("metadata", &[], &[about])?;
    let names: Vec<&str> = part.agents.iter().map(|agent| &*agent.name).collect();
    archive.texts("agents", &[names.len()], &names)?;
    let mut array = |name: &str, axes: &[usize], labels: &[Label<'_>]| {
        let dtype = labels
            .first()
            .map_or("<f8".to_owned(), |label| label.dtype().0);
        let mut bytes = Vec::new();
        for frame in 0..count {
            labels
                .iter()
                .for_each(|label| label.put(part, frame, &mut bytes));
        }
        archive.array(name, &dtype, &[&[count], axes].concat(), &bytes)
    };
    for (name, label) in of_all(part) {
        array(name, &label.axes(part), &[label])?;
    }
    // Varied numbers in one array, texts in another, each with their names.
    let is_text = |(_, label): &(&str, Label<'_>)| matches!(label, Label::Text(..));
    let (texts, numbers): (Vec<_>, Vec<_>) = varied(part).into_iter().partition(is_text);
    let (names, labels): (Vec<&str>, Vec<Label<'_>>) = numbers.into_iter().unzip();
    array("vary", &[labels.len()], &labels)?;
    archive.texts("vary_names", &[names.len()], &names)?;
    let (names, labels): (Vec<&str>, Vec<Label<'_>>) = texts.into_iter().unzip();
    archive.texts("vary_text_names", &[names.len()], &names)?;
    let texts = (0..count).flat_map(|frame| {
        labels.iter().filter_map(move |label| match label {
            Label::Text(texts, _) => Some(&texts[frame]),
            _ => None,
        })
    });
    let texts: Vec<&String> = texts.collect();
    archive.texts("vary_text", &[count, labels.len()], &texts)?;
    archive.finish()
}

/// One record per frame.
fn npy(part: &Part, about: &str, out: &mut impl Write) -> Result<(), ExportError> {
    let about: serde_json::Value = serde_json::from_str(about).unwrap_or_default();
    let fingerprint = about["fingerprint"].as_str().unwrap_or_default();
    let labels = of_all(part).map(|(name, label)| (name.to_owned(), label));
    let varied = varied(part).into_iter();
    let varied = varied.map(|(name, label)| (format!("vary.{name}"), label));
    let mut labels: Vec<(String, Label<'_>)> = labels.chain(varied).collect();
    labels.sort_by_key(|(_, label)| label.rank());
    let bytes: usize = labels.iter().map(|(_, label)| label.bytes(part)).sum();
    let padding = bytes.next_multiple_of(ALIGNED) - bytes;
    let frames = part.frame.len();
    let whole = frames * (bytes + padding);
    // A title is another name of a field: the folder finds its own files by it, and those that were cut.
    let title = quoted(&format!("grideye {fingerprint} {whole} bytes"));
    let mut descr = "[".to_owned();
    for (number, (name, label)) in labels.iter().enumerate() {
        let name = match number {
            0 => format!("({title}, {})", quoted(name)),
            _ => quoted(name),
        };
        let (dtype, axes) = (label.dtype().0, label.axes(part));
        let axes = if axes.is_empty() {
            String::new()
        } else {
            format!(", {}", tuple(&axes))
        };
        descr.push_str(&format!("({name}, '{dtype}'{axes}), "));
    }
    if padding > 0 {
        descr.push_str(&format!("('', '|V{padding}'), "));
    }
    descr.push(']');
    out.write_all(&header(&descr, &[frames])?)?;
    let mut record = Vec::with_capacity(bytes + padding);
    for frame in 0..frames {
        record.clear();
        labels
            .iter()
            .for_each(|(_, label)| label.put(part, frame, &mut record));
        record.resize(bytes + padding, 0);
        out.write_all(&record)?;
    }
    Ok(())
}

/// The bytes that begin a record, and its fields.
const ALIGNED: usize = 8;

impl Label<'_> {
    /// Larger types come first.
    fn rank(&self) -> u8 {
        match self {
            Self::Whole(_) | Self::Number(_) | Self::Numbers(..) | Self::Amount(_) => 0,
            Self::Image(_) | Self::Mask => 1,
            Self::Word(_) | Self::Text(..) => 2,
            Self::Flag(_) | Self::Whether(_) => 3,
        }
    }

    /// The type in numpy's notation, and its bytes.
    fn dtype(&self) -> (String, usize) {
        let characters = |most: usize| (format!("<U{most}"), 4 * most);
        match self {
            Self::Whole(_) => ("<u8".to_owned(), 8),
            Self::Number(_) | Self::Numbers(..) | Self::Amount(_) => ("<f8".to_owned(), 8),
            Self::Image(_) | Self::Mask => ("<f4".to_owned(), 4),
            Self::Flag(_) | Self::Whether(_) => ("|b1".to_owned(), 1),
            Self::Word(_) => characters(WORD),
            Self::Text(_, longest) => characters(*longest),
        }
    }

    /// The shape of one frame's.
    fn axes(&self, part: &Part) -> Vec<usize> {
        let ((columns, rows), agents) = (part.size, part.agents.len());
        match self {
            Self::Whole(_) | Self::Number(_) | Self::Whether(_) | Self::Text(..) => Vec::new(),
            Self::Image(_) => vec![rows, columns],
            Self::Amount(_) | Self::Word(_) | Self::Flag(_) => vec![agents],
            Self::Numbers(names, _) => vec![agents, names.len()],
            Self::Mask => vec![agents, rows, columns],
        }
    }

    fn bytes(&self, part: &Part) -> usize {
        self.dtype().1 * self.axes(part).iter().product::<usize>()
    }

    /// Appends one frame's.
    fn put(&self, part: &Part, frame: usize, bytes: &mut Vec<u8>) {
        let pixels = part.size.0 * part.size.1;
        let agents = part.agents.iter().map(|agent| agent.labels[frame].as_ref());
        match self {
            Self::Whole(values) => bytes.extend(values[frame].to_le_bytes()),
            Self::Number(values) => bytes.extend(values[frame].to_le_bytes()),
            Self::Whether(values) => bytes.push(values[frame].into()),
            Self::Text(texts, longest) => bytes.extend(npy::text(&texts[frame], *longest)),
            Self::Image(values) => {
                let values = &values[frame * pixels..][..pixels];
                bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
            }
            Self::Numbers(names, of) => {
                let value = |agent: Option<&OfAgent>, place| Some(of(agent?)?[place]);
                for agent in agents {
                    let values = (0..names.len()).map(|place| value(agent, place));
                    bytes.extend(values.flat_map(|value| value.unwrap_or(f64::NAN).to_le_bytes()));
                }
            }
            Self::Amount(of) => {
                let amounts = agents.map(|agent| agent.map_or(0.0, of));
                bytes.extend(amounts.flat_map(f64::to_le_bytes));
            }
            Self::Word(of) => agents.for_each(|agent| {
                bytes.extend(npy::text(agent.and_then(of).unwrap_or_default(), WORD));
            }),
            Self::Flag(is) => bytes.extend(agents.map(|agent| u8::from(agent.is_some_and(is)))),
            Self::Mask => {
                let values = agents.flat_map(|agent| mask(part, agent));
                bytes.extend(values.flat_map(f32::to_le_bytes));
            }
        }
    }
}

/// An agent's share of each pixel: 0 while it is absent.
fn mask(part: &Part, agent: Option<&OfAgent>) -> impl Iterator<Item = f32> {
    (0..part.size.0 * part.size.1).map(move |pixel| agent.map_or(0.0, |of| of.mask[pixel]))
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
