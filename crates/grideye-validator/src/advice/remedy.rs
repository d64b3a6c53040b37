//! What would make a refused scene agree, and else what would bring it nearest.

use crate::advice::change::{Compared, Kind};
use crate::advice::search::{Search, Tried};
use crate::align::Orientation;
use crate::constants::{AS_MUCH, GAIN_MIN, MORE_GAIN, MORE_SHARE};
use crate::decision::decide::decide;
use crate::decision::view::{Rendered, View};
use grideye_draw::text::{fixed, upper};
use grideye_scene::SceneError;

/// What is wrong most, and what to do about it.
#[derive(Debug, Clone)]
pub(crate) struct Remedy {
    pub(crate) found: String,
    pub(crate) step: String,
}

/// Changes that are named.
const NAMED: usize = 3;

/// What takes most of the difference away, and whether the scene then agrees. What was rendered is left for the next.
pub(crate) fn remedy(
    compared: &Compared<'_>,
    view: View,
    rendered: &mut Rendered,
) -> Result<Option<Remedy>, SceneError> {
    let mut search = Search::new(compared, view)?;
    let own = search.own;
    let most = (own.left - search.noise()).max(1.0);
    let gain = |tried: &Tried| {
        let share = ((own.left - tried.left) / most).clamp(0.0, 1.0);
        match tried.change.kind {
            Kind::More => MORE_SHARE * share,
            _ => share,
        }
    };
    let is_of_two =
        |one: &Tried| one.turned != Orientation::Upright && one.change.kind != Kind::None;
    let mut singles = compared.possible(&own, &search.tried);
    singles.retain(|one| !is_of_two(one) && !one.change.is_usual() && gain(one) >= GAIN_MIN);
    singles.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
    let mut kinds = Vec::new();
    singles.retain(|one| {
        let kind = (
            one.change.kind,
            one.change.of,
            one.turned != Orientation::Upright,
        );
        let is_new = !kinds.contains(&kind);
        kinds.push(kind);
        is_new
    });
    let Some(best) = singles.first().copied() else {
        *rendered = search.into_rendered();
        return Ok(None);
    };
    let as_much = singles
        .iter()
        .take_while(|one| gain(one) >= AS_MUCH * gain(&best))
        .count();
    singles[..as_much].sort_by_key(|one| one.change.order());
    let twos = compared.possible(&own, &search.tried).into_iter();
    let two = twos
        .filter(|one| is_of_two(one) && !one.change.is_usual())
        .min_by(|a, b| a.left.total_cmp(&b.left));
    if let Some(two) = two {
        let two = search.halved(two)?;
        if !two.change.is_usual() && gain(&two) > gain(&best) + MORE_GAIN * (1.0 - gain(&best)) {
            singles.insert(0, two);
        }
    }
    singles.truncate(NAMED);
    *rendered = search.into_rendered();
    let is_agreed = compared.agrees_with(&singles[0])?;
    let first = singles[0];
    // What explains less than what agrees is of no interest.
    singles.retain(|one| !is_agreed || gain(one) >= AS_MUCH * gain(&first));
    Ok(Some(compared.told(&singles, gain, is_agreed)))
}

impl Compared<'_> {
    /// Those that leave the level where it may be, or bring it there; if none does, those that bring it nearer.
    fn possible(&self, own: &Tried, tried: &[Tried]) -> Vec<Tried> {
        let within = |most_c: f64| {
            let all = tried.iter().filter(|one| one.level_c.abs() <= most_c);
            all.copied().collect::<Vec<Tried>>()
        };
        let nearest = within(self.level_max_c);
        match nearest.is_empty() {
            true => within(own.level_c.abs()),
            false => nearest,
        }
    }

    fn agrees_with(&self, tried: &Tried) -> Result<bool, SceneError> {
        let Some((recording, mut view, scene)) = tried.change.made(self, tried.turned)? else {
            return Ok(false);
        };
        if view.level_c(&recording.pictures).abs() > self.level_max_c {
            return Ok(false);
        }
        let decision = decide(&mut view, &recording, &scene.laws(), self.how);
        // Stopped, nobody asks.
        Ok(decision.is_some_and(|decision| decision.is_agreed(self.how.right_min)))
    }

    /// What is so in the recording, and what to do about it.
    fn parts(&self, tried: &Tried) -> Vec<(String, String)> {
        let turned = (tried.turned != Orientation::Upright).then(|| {
            let what = format!("the image is {}", tried.turned);
            (what, "compare with `--align orientation`".to_owned())
        });
        let change = (tried.change.kind != Kind::None).then(|| tried.change.says(self));
        turned.into_iter().chain(change).collect()
    }

    pub(super) fn told(
        &self,
        all: &[Tried],
        gain: impl Fn(&Tried) -> f64,
        is_agreed: bool,
    ) -> Remedy {
        let in_words = |one: &Tried| {
            let (whats, hows): (Vec<String>, Vec<String>) = self.parts(one).into_iter().unzip();
            let percent = fixed(100.0 * gain(one), 0);
            (whats.join(" and "), hows.join(", and "), percent)
        };
        let (what, how, percent) = in_words(&all[0]);
        let others = all[1..].iter().map(|one| {
            let (what, how, percent) = in_words(one);
            format!(" Less likely, {what} ({percent} % of the difference): {how}.")
        });
        let then = match is_agreed {
            true => "the scene then agrees",
            false => "the scene then comes nearest, but no single change makes it agree",
        };
        Remedy {
            found: format!("Most likely {what}, which explains {percent} % of the difference."),
            step: format!("{}: {then}.{}", upper(&how), others.collect::<String>()),
        }
    }
}
