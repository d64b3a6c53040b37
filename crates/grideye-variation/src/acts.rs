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
        many if many > CHOICES_MAX => Err(Mistake::TooManyChoices(many)),
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
        return Err(Mistake::NoAct(word.to_owned()));
    };
    let lasts_s = match (seconds, lasts_s) {
        (None, lasts_s) => lasts_s.unwrap_or_default(),
        (Some(_), None) => return Err(Mistake::NoLasting(word.to_owned())),
        (Some(seconds), Some(_)) => {
            range(seconds).ok_or_else(|| Mistake::NoSeconds(text.to_owned()))?
        }
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
        return Err(Mistake::Nothing);
    }
    if acts.len() > ACTS_MAX {
        return Err(Mistake::TooManyActs(acts.len()));
    }
    let mut is_here = None;
    for act in acts {
        let wanted = match act.does {
            Does::Enter => Some(false),
            Does::Away => None,
            _ => Some(true),
        };
        if wanted.is_some() && is_here.is_some() && is_here != wanted {
            return Err(match act.does {
                Does::Enter => Mistake::Inside,
                _ => Mistake::Outside,
            });
        }
        if act.does == Does::Away && is_here == Some(true) {
            return Err(Mistake::Inside);
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
            ("", Mistake::Nothing),
            ("walk,", Mistake::Nothing),
            ("run", Mistake::NoAct("run".to_owned())),
            ("walk:3", Mistake::NoLasting("walk".to_owned())),
            ("sit:9..2", Mistake::NoSeconds("sit:9..2".to_owned())),
            ("sit:-1", Mistake::NoSeconds("sit:-1".to_owned())),
            ("sit:nan", Mistake::NoSeconds("sit:nan".to_owned())),
            ("walk enter", Mistake::Inside),
            ("walk away", Mistake::Inside),
            ("leave walk", Mistake::Outside),
            ("away sit", Mistake::Outside),
        ] {
            assert_eq!(choices(text), Err(mistake), "{text}");
        }
        let many = vec!["walk"; ACTS_MAX].join(" ");
        assert!(choices(&many).is_ok());
        let more = format!("{many} walk");
        assert_eq!(choices(&more), Err(Mistake::TooManyActs(ACTS_MAX + 1)));
    }
}
