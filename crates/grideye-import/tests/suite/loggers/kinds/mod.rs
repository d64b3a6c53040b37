//! The kinds of files, grouped by their difficulty.

mod beside;
mod blocks;
mod cloud;
mod console;
mod containers;
mod families;
mod habits;
mod lines;
mod mixed;
mod place;
mod refused;
mod times;
mod units;

use super::variant::{Kind, Variant};

pub(crate) fn all() -> Vec<Variant> {
    let kinds: [fn() -> Kind; 13] = [
        blocks::kind,
        units::kind,
        times::kind,
        place::kind,
        families::kind,
        beside::kind,
        console::kind,
        lines::kind,
        cloud::kind,
        containers::kind,
        refused::kind,
        habits::kind,
        mixed::kind,
    ];
    kinds.into_iter().flat_map(|kind| kind().variants).collect()
}
