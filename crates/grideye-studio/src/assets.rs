//! The files of the pages that are about scenes; those that all pages share are the collector's.

use grideye_collector::Asset;

const CSS: &str = "text/css; charset=utf-8";
const JAVASCRIPT: &str = "text/javascript; charset=utf-8";

/// A file of `assets/` with its type.
macro_rules! file {
    ($name:literal, $kind:expr) => {
        Asset {
            name: $name,
            kind: $kind,
            text: include_str!(concat!("../assets/", $name)),
        }
    };
}

/// Of the panel beside a sensor, on the live page.
pub(crate) const BESIDE: [Asset; 6] = [
    file!("beside.css", CSS),
    file!("beside.js", JAVASCRIPT),
    file!("difference.js", JAVASCRIPT),
    file!("plan.js", JAVASCRIPT),
    file!("scores.js", JAVASCRIPT),
    file!("simulation.js", JAVASCRIPT),
];

/// Of the page on which scenes are edited, and the link to it.
pub(crate) const EDITOR: [Asset; 15] = [
    file!("editor.css", CSS),
    file!("cover.js", JAVASCRIPT),
    file!("draft.js", JAVASCRIPT),
    file!("editor.js", JAVASCRIPT),
    file!("fields.js", JAVASCRIPT),
    file!("floor-plan.js", JAVASCRIPT),
    file!("hatch.js", JAVASCRIPT),
    file!("names.js", JAVASCRIPT),
    file!("new-things.js", JAVASCRIPT),
    file!("room-view.js", JAVASCRIPT),
    file!("scene-text.js", JAVASCRIPT),
    file!("seen.js", JAVASCRIPT),
    file!("thing-list.js", JAVASCRIPT),
    file!("things.js", JAVASCRIPT),
    file!("to-editor.js", JAVASCRIPT),
];

/// What was recorded of the scene that the live page opens with.
pub(crate) const OPENING: [Asset; 1] = [file!("opening.js", JAVASCRIPT)];

/// What the live page has of it.
pub(crate) const OPENING_HEAD: &str =
    "<script type=\"module\" src=\"/assets/opening.js\"></script>\n";

/// What the live page has of the panel.
pub(crate) const BESIDE_HEAD: &str = include_str!("../assets/beside.html");

/// What the live page has of the editor.
pub(crate) const EDITOR_HEAD: &str =
    "<script type=\"module\" src=\"/assets/to-editor.js\"></script>\n";

/// The page on which scenes are edited.
pub(crate) const EDITOR_PAGE: &str = include_str!("../assets/editor.html");
