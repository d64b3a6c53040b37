//! What would make a refused scene agree, and else what would bring it nearest.

use crate::advice::change::{Compared, Kind};
use crate::advice::search::{Search, Tried};
use crate::align::Orientation;
use crate::constants::{AS_MUCH, GAIN_MIN, MORE_GAIN, MORE_SHARE, TRIED_SHARE};
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

/// Changes that are named, and changes that are tried.
const NAMED: usize = 3;
const TRIED: usize = 4;

/// What makes the scene agree, and else what takes most of the difference away. What was rendered is left for the next.
pub(crate) fn remedy(
    compared: &Compared<'_>,
    view: View,
    rendered: &mut Rendered,
) -> Result<Option<Remedy>, SceneError> {
    let mut search = Search::new(compared, view)?;
    let found = found(compared, &mut search);
    *rendered = search.into_rendered();
    found
}

/// The difference between recording and scene, beyond noise, in squared standard deviations.
struct Difference {
    own: f64,
    most: f64,
}

impl Difference {
    /// Share of it that a change takes away; more than all if noise goes too.
    fn share(&self, one: &Tried) -> f64 {
        (self.own - one.left) / self.most
    }

    /// The same as it counts against what agrees when tried.
    fn gain(&self, one: &Tried) -> f64 {
        let share = self.share(one).min(1.0);
        match one.change.kind {
            Kind::More => MORE_SHARE * share,
            _ => share,
        }
    }
}

fn found(compared: &Compared<'_>, search: &mut Search<'_>) -> Result<Option<Remedy>, SceneError> {
    let own = search.own;
    let difference = Difference {
        own: own.left,
        most: (own.left - search.noise()).max(1.0),
    };
    let possible = compared.possible(&own, &search.tried).into_iter();
    let possible =
        possible.filter(|one| !one.change.is_usual() && !compared.looks_the_same(one.turned));
    let is_of_two =
        |one: &Tried| one.turned != Orientation::Upright && one.change.kind != Kind::None;
    let (twos, mut singles): (Vec<Tried>, Vec<Tried>) = possible.partition(is_of_two);
    if let Some(agreed) = compared.agreed(&mut singles, &difference)? {
        return Ok(Some(agreed));
    }
    let share = |one: &Tried| difference.share(one);
    singles.retain(|one| share(one) >= GAIN_MIN);
    likeliest_first(&mut singles, share, |_| false);
    let Some(best) = singles.first().map(|one| difference.gain(one)) else {
        return Ok(None);
    };
    let two = twos.into_iter().min_by(|a, b| a.left.total_cmp(&b.left));
    if let Some(two) = two {
        let two = search.halved(two)?;
        let least = best + MORE_GAIN * (1.0 - best);
        if !two.change.is_usual() && difference.gain(&two) > least {
            if compared.agrees_with(&two)? {
                return Ok(Some(compared.told(&[two], share, true)));
            }
            singles.insert(0, two);
        }
    }
    singles.truncate(NAMED);
    Ok(Some(compared.told(&singles, share, false)))
}

/// Those that explain most first; of those that explain as much, and of those that come first anyway, in the table's order.
fn likeliest_first(
    all: &mut [Tried],
    gain: impl Fn(&Tried) -> f64,
    is_first: impl Fn(&Tried) -> bool,
) {
    all.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
    let best = all.first().map_or(0.0, &gain);
    all.sort_by_key(|one| match gain(one) >= AS_MUCH * best || is_first(one) {
        true => one.change.order(),
        false => usize::MAX,
    });
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

    /// The first that makes the scene agree, of the best of each kind, which stay.
    fn agreed(
        &self,
        singles: &mut Vec<Tried>,
        difference: &Difference,
    ) -> Result<Option<Remedy>, SceneError> {
        let gain = |one: &Tried| difference.gain(one);
        // Who stands explains little of a recording: any unit's pattern may be as warm.
        let is_absent =
            |one: &Tried| one.change.kind == Kind::Without && self.is_absent(one.change.of);
        singles.retain(|one| gain(one) >= GAIN_MIN || is_absent(one));
        singles.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
        let mut kinds = Vec::new();
        singles.retain(|one| {
            let kind = (one.change.kind, one.change.of);
            let is_new = !kinds.contains(&kind);
            kinds.push(kind);
            is_new
        });
        let best = singles.first().map_or(0.0, gain);
        likeliest_first(singles, gain, is_absent);
        let is_tried = |one: &&Tried| gain(one) >= TRIED_SHARE * best || is_absent(one);
        for (index, one) in singles.iter().filter(is_tried).take(TRIED).enumerate() {
            if self.agrees_with(one)? {
                // What was tried before does not agree.
                let others = singles[index + 1..].iter();
                let others = others.filter(|other| gain(other) >= AS_MUCH * best);
                let all = std::iter::once(one).chain(others).take(NAMED);
                let share = |one: &Tried| difference.share(one);
                let told = self.told(&all.copied().collect::<Vec<_>>(), share, true);
                return Ok(Some(told));
            }
        }
        Ok(None)
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
            let how = "compare with `--align orientation`".to_owned();
            let is_alone = tried.change.kind == Kind::None;
            let azimuth_deg = self.azimuth_of(tried.turned).filter(|_| is_alone);
            let pose = azimuth_deg
                .map(|degrees| format!("set `azimuth_deg = {degrees:.0}` of the sensor, or {how}"));
            (what, pose.unwrap_or(how))
        });
        let change = (tried.change.kind != Kind::None).then(|| tried.change.says(self));
        turned.into_iter().chain(change).collect()
    }

    pub(super) fn told(
        &self,
        all: &[Tried],
        share: impl Fn(&Tried) -> f64,
        is_agreed: bool,
    ) -> Remedy {
        let in_words = |one: &Tried| {
            let (whats, hows): (Vec<String>, Vec<String>) = self.parts(one).into_iter().unzip();
            let part = match fixed(100.0 * share(one).clamp(0.0, 1.0), 0).as_str() {
                "100" if !is_agreed => "nearly all".to_owned(),
                percent => format!("{percent} %"),
            };
            (whats.join(" and "), hows.join(", and "), part)
        };
        let (what, how, part) = in_words(&all[0]);
        let explains = match is_agreed && share(&all[0]) < GAIN_MIN {
            true => String::new(),
            false => format!(", which explains {part} of the difference"),
        };
        let others = all[1..].iter().map(|one| {
            let (what, how, part) = in_words(one);
            format!(" Less likely, {what} ({part} of the difference): {how}.")
        });
        let then = match is_agreed {
            true => "the scene then agrees",
            false => "the scene then comes nearest, but no single change makes it agree",
        };
        Remedy {
            found: format!("Most likely {what}{explains}."),
            step: format!("{}: {then}.{}", upper(&how), others.collect::<String>()),
        }
    }
}
