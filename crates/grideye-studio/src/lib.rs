//! Scenes on the collector's page: the editor, and a real sensor beside a simulated one.
//!
//! ```text
//!    folder of scenes ─▶ catalogue ─┬─▶ beside: frames, plan, verdict ─▶ the panel on the live page
//!                                   └─▶ editor: draft, map, save ─────▶ /editor
//! ```
//!
//! Annexes of the collector, which knows nothing of scenes: routes, and the pages' files (`assets/`). With a [`Demonstration`] the
//! page opens with a scene, as in `grideye demo`.
//!
//! ```no_run
//! use grideye_studio::{Disk, annexes};
//! use std::io::{Read as _, Write as _};
//!
//! let disk = Disk {
//!     read: |mut file| {
//!         let mut text = String::new();
//!         file.read_to_string(&mut text).map(|_bytes| text)
//!     },
//!     replace: |path, content| std::io::copy(content, &mut std::fs::File::create(path)?).map(drop),
//! };
//! let annexes = annexes(Some("scenes".as_ref()), None, disk)?;
//! assert!(annexes.iter().map(|annex| annex.name()).eq(["scenes", "editor"]));
//! # Ok::<(), anyhow::Error>(())
//! ```

mod assets;
mod beside;
mod catalogue;
mod demonstration;
mod disk;
mod editor;
mod outline;
mod queue;
mod recently;
mod rounding;

pub use demonstration::{Demonstration, Recorded};
pub use disk::Disk;

use anyhow::Result;
use catalogue::{Catalogue, SceneEntry};
use grideye_collector::Annex;
use std::path::Path;
use std::sync::Arc;

/// The annexes for a folder of scenes (a real sensor beside a simulated one, and the editor) and for the scene that the page
/// opens with.
///
/// # Errors
/// If the folder cannot be read.
pub fn annexes(
    folder: Option<&Path>,
    demonstration: Option<&Demonstration>,
    disk: Disk,
) -> Result<Vec<Annex>> {
    folder.map(catalogue::scene_files).transpose()?;
    let mut annexes = Vec::new();
    if folder.is_some() || demonstration.is_some() {
        let fixed = demonstration.map(|demonstration| Arc::new(SceneEntry::from(demonstration)));
        let folder = folder.map(Path::to_owned);
        let catalogue = move || Catalogue::new(folder.clone(), fixed.clone(), disk);
        annexes.push(beside::annex(
            catalogue,
            demonstration.map(Demonstration::names),
        ));
    }
    annexes.extend(folder.map(|folder| editor::annex(folder.to_owned(), disk)));
    annexes.extend(demonstration.map(Demonstration::annex));
    Ok(annexes)
}
