//! What is read is never written over.

use crate::exit::bad_input;
use anyhow::{Result, anyhow};
use std::fs;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

/// A file, by whatever name.
#[derive(PartialEq, Eq)]
enum Identity {
    There { device: u64, inode: u64 },
    New(PathBuf),
}

/// Refuses a result that would come to lie over one of the files that are read, and two results under one name. Devices,
/// pipes, and `-` may be named as often as anybody likes.
pub(crate) fn keep_apart<'a>(
    inputs: impl IntoIterator<Item = &'a PathBuf>,
    outputs: impl IntoIterator<Item = &'a PathBuf>,
) -> Result<()> {
    let known = |path: &'a PathBuf| Some((identity(path)?, path.display()));
    let inputs: Vec<_> = inputs.into_iter().filter_map(known).collect();
    let mut others = Vec::new();
    for (output, shown) in outputs.into_iter().filter_map(known) {
        if let Some((_, input)) = inputs.iter().find(|(input, _)| *input == output) {
            return Err(bad_input(anyhow!(
                "the output {shown} is the input {input}, and would be written over it\nhint: name another output; nothing was changed"
            )));
        }
        if let Some((_, other)) = others.iter().find(|(other, _)| *other == output) {
            return Err(bad_input(anyhow!(
                "the outputs {other} and {shown} are one file\nhint: give each a name of its own; nothing was changed"
            )));
        }
        others.push((output, shown));
    }
    Ok(())
}

fn identity(path: &Path) -> Option<Identity> {
    let name = path.file_name()?;
    match fs::metadata(path) {
        _ if path == Path::new("-") => None,
        Ok(about) => about.is_file().then(|| Identity::There {
            device: about.dev(),
            inode: about.ino(),
        }),
        Err(_not_there) => {
            let folder = path
                .parent()
                .filter(|parent| !parent.as_os_str().is_empty());
            let folder = fs::canonicalize(folder.unwrap_or(Path::new("."))).ok()?;
            Some(Identity::New(folder.join(name)))
        }
    }
}
