//! Parses what a person does one after another: `enter sit:5..20 leave`, `walk fall`.
//!
//! ```text
//! choices = acts *("," acts)               one of them, all equally likely
//! acts    = act *(" " act)
//! act     = "enter" | "walk" | "leave" | lasting [":" SECONDS | ":" LOW..HIGH]
//! lasting = "stand" | "sit" | "lie" | "fall" | "away"
//! ```

use crate::error::{ACTS_MAX, CHOICES_MAX, Mistake};

/// Limit on the seconds of one act.
const SECONDS_MAX: f64 = 86_400.0;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Does {
    Enter,
    Walk,
    Stand,
    Sit,
    Lie,
    Fall,
    Leave,
    Away,
}

/// Words, and for how many seconds each lasts by default; `None` for what ends at a place.
const WORDS: [(&str, Does, Option<[f64; 2]>); 8] = [
    ("enter", Does::Enter, None),
    ("walk", Does::Walk, None),
    ("stand", Does::Stand, Some([1.0, 4.0])),
    ("sit", Does::Sit, Some([3.0, 10.0])),
    ("lie", Does::Lie, Some([3.0, 10.0])),
    ("fall", Does::Fall, Some([2.0, 10.0])),
    ("leave", Does::Leave, None),
    ("away", Does::Away, Some([1.0, 5.0])),
];

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Act {
    pub(crate) does: Does,
    /// The seconds that it lasts once the posture is reached, from and to.
    pub(crate) lasts_s: [f64; 2],
}

/// What one person may do.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Choice {
    pub(crate) text: String,
    pub(crate) acts: Vec<Act>,
}

pub(crate) fn choices(text: &str) -> Result<Vec<Choice>, Mistake> {
    let choices = text.split(',').map(|text| {
        let acts = text.split_whitespace().map(act);
        let acts = acts.collect::<Result<Vec<_>, _>>()?;
        check_order(&acts)?;
        let words: Vec<&str> = text.split_whitespace().collect();
        Ok(Choice {
            text: words.join(" "),
            acts,
        })
    });
    let choices = choices.collect::<Result<Vec<_>, Mistake>>()?;
    match choices.len() {
        many if many > CHOICES_MAX => Err(Mistake::too_many_choices(many)),
        _ => Ok(choices),
    }
}

fn act(text: &str) -> Result<Act, Mistake> {
    let (word, seconds) = match text.split_once(':') {
        Some((word, seconds)) => (word, Some(seconds)),
        None => (text, None),
    };
    let known = WORDS.iter().find(|(known, ..)| *known == word);
    let Some((_, does, lasts_s)) = known else {
        return Err(Mistake(format!(
            "`{word}` is no act\nhint: write enter, walk, stand, sit, lie, fall, leave or away, as in \"enter walk sit:5..20 leave\""
        )));
    };
    let lasts_s = match (seconds, lasts_s) {
        (None, lasts_s) => lasts_s.unwrap_or_default(),
        (Some(_), None) => {
            return Err(Mistake(format!(
                "`{word}` takes as long as its way\nhint: write {word} without seconds; stand, sit, lie, fall and away take them, as in sit:5..20"
            )));
        }
        (Some(seconds), Some(_)) => range(seconds).ok_or_else(|| {
            Mistake(format!(
                "`{text}` does not say how many seconds\nhint: write seconds or LOW..HIGH up to 86400, as in sit:5..20"
            ))
        })?,
    };
    Ok(Act {
        does: *does,
        lasts_s,
    })
}

fn range(text: &str) -> Option<[f64; 2]> {
    let (low, high) = text.split_once("..").unwrap_or((text, text));
    let number = |text: &str| {
        let number = text.parse().ok();
        number.filter(|number: &f64| (0.0..=SECONDS_MAX).contains(number))
    };
    let (low, high) = (number(low)?, number(high)?);
    (low <= high).then_some([low, high])
}

fn check_order(acts: &[Act]) -> Result<(), Mistake> {
    if acts.is_empty() {
        return Err(Mistake::nothing());
    }
    if acts.len() > ACTS_MAX {
        let found = acts.len();
        return Err(Mistake(format!(
            "{found} acts are more than {ACTS_MAX}\nhint: make several clips of fewer acts"
        )));
    }
    let mut is_here = None;
    for act in acts {
        let wanted = match act.does {
            Does::Enter => Some(false),
            Does::Away => None,
            _ => Some(true),
        };
        let is_wrong = wanted.is_some() && is_here.is_some() && is_here != wanted;
        if is_wrong && act.does != Does::Enter {
            let outside = "the person is not in the room\nhint: write enter after leave or away";
            return Err(Mistake(outside.to_owned()));
        }
        if is_wrong || act.does == Does::Away && is_here == Some(true) {
            let inside = "the person is in the room already\nhint: write enter or away first, or after leave";
            return Err(Mistake(inside.to_owned()));
        }
        is_here = Some(!matches!(act.does, Does::Leave | Does::Away));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn acts_have_seconds_or_their_defaults() {
        let read = choices("enter  sit:5..20 leave away:2 enter,walk fall").unwrap();
        assert_eq!(read.len(), 2);
        assert_eq!(read[0].text, "enter sit:5..20 leave away:2 enter");
        let lasts: Vec<[f64; 2]> = read[0].acts.iter().map(|act| act.lasts_s).collect();
        assert_eq!(
            lasts,
            [[0.0, 0.0], [5.0, 20.0], [0.0, 0.0], [2.0, 2.0], [0.0, 0.0]]
        );
        assert_eq!(read[1].acts[1].does, Does::Fall);
        assert_eq!(read[1].acts[1].lasts_s, [2.0, 10.0]);
    }

    #[test]
    fn contradictions_and_unknown_words_are_named() {
        for (text, mistake) in [
            ("", "a value is missing"),
            ("walk,", "a value is missing"),
            ("run", "`run` is no act"),
            ("walk:3", "`walk` takes as long as its way"),
            ("sit:9..2", "`sit:9..2` does not say how many seconds"),
            ("sit:-1", "`sit:-1` does not say how many seconds"),
            ("sit:nan", "`sit:nan` does not say how many seconds"),
            ("walk enter", "the person is in the room already"),
            ("walk away", "the person is in the room already"),
            ("leave walk", "the person is not in the room"),
            ("away sit", "the person is not in the room"),
        ] {
            let error = choices(text).unwrap_err().to_string();
            assert_eq!(error.lines().next(), Some(mistake), "{text}");
        }
        let many = vec!["walk"; ACTS_MAX].join(" ");
        assert!(choices(&many).is_ok());
        let more = format!("{many} walk");
        let error = choices(&more).unwrap_err().to_string();
        assert!(error.starts_with("101 acts are more than 100\n"), "{error}");
    }
}
