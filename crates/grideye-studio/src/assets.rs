//! The files of the pages about scenes; files that all pages share belong to the collector.

use grideye_collector::Asset;

const CSS: &str = "text/css; charset=utf-8";
const JAVASCRIPT: &str = "text/javascript; charset=utf-8";

macro_rules! file {
    ($name:literal, $kind:expr) => {
        Asset {
            name: $name,
            kind: $kind,
            text: include_str!(concat!("../assets/", $name)),
        }
    };
}

/// Files of the panel beside a sensor, on the live page.
pub(crate) const BESIDE: [Asset; 10] = [
    file!("beside.css", CSS),
    file!("beside.js", JAVASCRIPT),
    file!("difference.js", JAVASCRIPT),
    file!("names.js", JAVASCRIPT),
    file!("offers.js", JAVASCRIPT),
    file!("room-view.js", JAVASCRIPT),
    file!("scores.js", JAVASCRIPT),
    file!("simulation.js", JAVASCRIPT),
    file!("solids.js", JAVASCRIPT),
    file!("things.js", JAVASCRIPT),
];

/// Files of the scene editor's page, and the link to it.
pub(crate) const EDITOR: [Asset; 11] = [
    file!("editor.css", CSS),
    file!("cover.js", JAVASCRIPT),
    file!("draft.js", JAVASCRIPT),
    file!("editor.js", JAVASCRIPT),
    file!("fields.js", JAVASCRIPT),
    file!("hatch.js", JAVASCRIPT),
    file!("new-things.js", JAVASCRIPT),
    file!("scene-text.js", JAVASCRIPT),
    file!("seen.js", JAVASCRIPT),
    file!("thing-list.js", JAVASCRIPT),
    file!("to-editor.js", JAVASCRIPT),
];

pub(crate) const OPENING: [Asset; 1] = [file!("opening.js", JAVASCRIPT)];

pub(crate) const OPENING_HEAD: &str =
    "<script type=\"module\" src=\"/assets/opening.js\"></script>\n";

pub(crate) const BESIDE_HEAD: &str = include_str!("../assets/beside.html");

pub(crate) const EDITOR_HEAD: &str =
    "<script type=\"module\" src=\"/assets/to-editor.js\"></script>\n";

pub(crate) const EDITOR_PAGE: &str = include_str!("../assets/editor.html");
