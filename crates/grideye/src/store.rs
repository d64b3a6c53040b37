//! Where a store is, as the command line names it.

use crate::exit::bad_input;
use crate::files;
use anyhow::{Context as _, Result, anyhow};
use grideye_collector::StoreLocation;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;

/// A file, or a database whose password may stand in the file that `PGPASSFILE` names.
pub(crate) fn location(text: &str) -> Result<StoreLocation> {
    let location = text.parse::<StoreLocation>().map_err(bad_input)?;
    let StoreLocation::Postgres(url) = location else {
        return Ok(location);
    };
    let Some(path) = std::env::var_os("PGPASSFILE") else {
        return Ok(StoreLocation::Postgres(url));
    };
    let text = password_file(Path::new(&path)).map_err(bad_input)?;
    let url = url.with_password_file(&text).map_err(bad_input)?;
    Ok(StoreLocation::Postgres(url))
}

fn password_file(path: &Path) -> Result<String> {
    let shown = path.display();
    let about = std::fs::metadata(path);
    let about = about.with_context(|| format!("cannot read the password file {shown}"))?;
    if about.permissions().mode() & 0o077 != 0 {
        return Err(anyhow!(
            "others can read the password file {shown}\nhint: chmod 600 {shown}"
        ));
    }
    files::text(
        path,
        "the password file",
        "PGPASSFILE names a file of lines HOST:PORT:DATABASE:USER:PASSWORD",
    )
}
