//! What the collector's page has besides its own: exports, and a folder of scenes (`--scenes`).

use crate::cli::Scenes;
use crate::exit::bad_input;
use crate::files;
use anyhow::Result;
use grideye_collector::Annex;
use grideye_studio::Disk;
use std::io;
use std::path::Path;

/// Where scenes are looked for unless a folder is named.
const FOLDER: &str = "scenes";

/// Exports, and the scenes of the folder that was named, or of `scenes` if there is one.
pub(crate) fn annexes(options: &Scenes) -> Result<Vec<Annex>> {
    let export = grideye_export::annex::annex(tempfile::tempfile);
    let folder = match &options.folder {
        Some(folder) => folder.as_path(),
        None if Path::new(FOLDER).is_dir() => Path::new(FOLDER),
        None => return Ok(vec![export]),
    };
    let disk = Disk {
        read: |file| files::read_text(file),
        replace: |path, content| {
            let put = files::replace(path, |out| Ok(io::copy(content, out).map(drop)?));
            put.map_err(io::Error::other)
        },
    };
    let annexes = grideye_studio::annexes(folder, disk).map_err(bad_input)?;
    Ok(annexes.into_iter().chain([export]).collect())
}
