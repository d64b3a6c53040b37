//! Scenes on the collector's page: the editor, and a real sensor beside a simulated one.
//!
//! ```text
//!    folder of scenes ─▶ catalogue ─┬─▶ beside: frames, plan, verdict ─▶ the panel on the live page
//!                                   └─▶ editor: draft, map, save ─────▶ /editor
//! ```
//!
//! Annexes of the collector, which knows nothing of scenes: routes, and the pages' files (`assets/`). With an [`Opening`] the
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
mod desk;
mod disk;
mod editor;
mod opening;
mod recently;
mod rounding;
#[cfg(test)]
mod testing;

pub use disk::Disk;
pub use opening::{Opening, Recorded};

use anyhow::Result;
use catalogue::{Catalogue, Shelved};
use grideye_collector::Annex;
use std::path::Path;
use std::sync::Arc;

/// The annexes for a folder of scenes (a real sensor beside a simulated one, and the editor) and for the scene that the page
/// opens with.
///
/// # Errors
/// If the folder cannot be read.
pub fn annexes(folder: Option<&Path>, opening: Option<&Opening>, disk: Disk) -> Result<Vec<Annex>> {
    folder.map(catalogue::scene_files).transpose()?;
    let mut annexes = Vec::new();
    if folder.is_some() || opening.is_some() {
        let fixed = opening.map(|opening| Arc::new(Shelved::from(opening)));
        let folder = folder.map(Path::to_owned);
        let catalogue = move || Catalogue::new(folder.clone(), fixed.clone(), disk);
        annexes.push(beside::annex(catalogue, opening.map(Opening::names)));
    }
    annexes.extend(folder.map(|folder| editor::annex(folder.to_owned(), disk)));
    annexes.extend(opening.map(Opening::annex));
    Ok(annexes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::Method;
    use grideye_collector::SystemClock;
    use std::sync::Arc;

    /// Every file that the pages and their scripts name is served, and every served file is named.
    #[tokio::test]
    async fn the_pages_are_made_of_files_that_are_there() {
        let folder = tempfile::tempdir().unwrap();
        let annexes = annexes(Some(folder.path()), None, disk::plain()).unwrap();
        let app = testing::app(&annexes, Arc::new(SystemClock::new())).await;
        let text_at = async |path: &str| {
            let (status, text) = testing::ask(&app, Method::GET, path, None).await;
            assert_eq!(status, 200, "{path}");
            text.as_str().unwrap().to_owned()
        };
        let mut named: Vec<String> = Vec::new();
        for page in ["/", "/editor"] {
            let html = text_at(page).await;
            let parts = html
                .split('"')
                .filter_map(|text| text.strip_prefix("/assets/"));
            named.extend(parts.map(str::to_owned));
        }
        let mut seen = 0;
        while let Some(name) = named.get(seen).cloned() {
            seen += 1;
            let text = text_at(&format!("/assets/{name}")).await;
            let imports = text.split("from \"./").skip(1);
            for import in imports.filter_map(|rest| rest.split('"').next()) {
                if !named.iter().any(|known| known == import) {
                    named.push(import.to_owned());
                }
            }
        }
        for asset in assets::BESIDE.iter().chain(&assets::EDITOR) {
            let name = asset.name;
            assert!(named.iter().any(|known| known == name), "{name}");
        }
    }
}
