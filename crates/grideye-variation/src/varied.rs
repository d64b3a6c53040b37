//! One key that varies: its choices, where their values are written, and what is drawn.

use crate::asked::Asked;
use crate::error::{Mistake, VariationError};
use crate::grammar;
use crate::grammar::{Choice, Piece};
use crate::target::Edit;
use grideye_scene::limits;

/// A key and its possible values.
#[derive(Debug, Clone)]
pub(crate) struct Varied {
    pub(crate) asked: Asked,
    pub(crate) choices: Vec<Choice>,
    pub(crate) place: Place,
    /// Which other key it goes with, and the middle of that one's law.
    pub(crate) with: Option<(usize, f64)>,
}

/// Where a value is written.
#[derive(Debug, Clone)]
pub(crate) enum Place {
    /// The time of the frame is not in the text.
    Time,
    Key(Edit),
    /// Whether each agent is there.
    People(Vec<Edit>),
}

impl Place {
    pub(crate) fn edits(&self) -> &[Edit] {
        match self {
            Self::Time => &[],
            Self::Key(edit) => std::slice::from_ref(edit),
            Self::People(edits) => edits,
        }
    }

    /// What is written for a value.
    pub(crate) fn written(&self, text: &str, numbers: &[f64]) -> Vec<String> {
        match self {
            Self::Time => Vec::new(),
            Self::Key(_) => vec![text.to_owned()],
            Self::People(edits) => (0_u32..)
                .zip(edits)
                .map(|(agent, _)| (Some(&f64::from(agent)) < numbers.first()).to_string())
                .collect(),
        }
    }
}

impl Varied {
    /// The middle of its law, if it has one: of that of the scene's table, if an option replaces it.
    pub(crate) fn middle(&self) -> Option<f64> {
        let replaced = self.asked.replaced.as_ref();
        let replaced = replaced.and_then(|values| grammar::choices(values).ok());
        match replaced.as_ref().unwrap_or(&self.choices).as_slice() {
            [Choice(pieces)] => match pieces.as_slice() {
                [Piece::Range(low, high)] => Some(0.5 * (low + high)),
                [Piece::Normal(law, _)] => Some(law.mean),
                _ => None,
            },
            _ => None,
        }
    }
}

pub(crate) fn check_time(asked: &Asked, numbers: &[f64]) -> Result<(), VariationError> {
    match numbers {
        [time_s] if (0.0..=limits::TIME_MAX_S).contains(time_s) => Ok(()),
        _ => Err(asked.mistaken(Mistake(
            "the time of a frame must be 0 to 31622400 seconds\nhint: write a number or a range, as in time_s=0..12".to_owned(),
        ))),
    }
}

/// Choices of whole numbers up to the agents, a range as the numbers in it.
pub(crate) fn people(choices: Vec<Choice>, agents: usize) -> Result<Vec<Choice>, Mistake> {
    let whole = |number: f64| (0..=agents).find(|whole| whole.to_string() == number.to_string());
    let mut all = Vec::new();
    for choice in choices {
        let (from, to) = match choice.0.as_slice() {
            [Piece::Number(_, number)] => (whole(*number), whole(*number)),
            [Piece::Range(low, high)] => (whole(*low), whole(*high)),
            _ => (None, None),
        };
        let (Some(from), Some(to)) = (from, to) else {
            return Err(Mistake(format!(
                "the number of people must be whole, and at most {agents}, the agents of the scene\nhint: write 0..{agents} or 0,1; so many of the file's agents are there, the first ones first"
            )));
        };
        all.extend((from..=to).map(Choice::of_count));
    }
    Ok(all)
}

pub(crate) fn are_numbers(choices: &[Choice]) -> bool {
    let first = choices.first().and_then(Choice::numbers);
    first.is_some() && choices.iter().all(|choice| choice.numbers() == first)
}

/// A choice as TOML, with a number drawn from each law, and its numbers.
pub(crate) fn as_toml(choice: &Choice, share: &mut dyn FnMut() -> f64) -> (String, Vec<f64>) {
    let (mut text, mut numbers) = (String::new(), Vec::new());
    for piece in &choice.0 {
        let mut drawn = None;
        match piece {
            Piece::Mark(mark) if mark == "," => text.push_str(", "),
            Piece::Mark(mark) => text.push_str(mark),
            Piece::Text(content) => text.push_str(&toml::Value::from(content.as_str()).to_string()),
            Piece::Flag(flag) => {
                text.push_str(if *flag { "true" } else { "false" });
                numbers.push(f64::from(u8::from(*flag)));
            }
            Piece::Number(written, number) => {
                text.push_str(written);
                numbers.push(*number);
            }
            Piece::Range(low, high) => {
                drawn = Some((low + (high - low) * share()).clamp(*low, *high));
            }
            Piece::Normal(law, bounds) => drawn = Some(law.quantile(*bounds, share())),
        }
        if let Some(number) = drawn {
            text.push_str(&format!("{number:?}"));
            numbers.push(number);
        }
    }
    (text, numbers)
}
