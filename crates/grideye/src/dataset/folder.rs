//! The folder of a dataset: what is whole there, what is ours, and how a part gets into it.
//!
//! A part is written under a name of its own, locked, synced, and renamed when it is whole. Whatever moment the
//! power fails at, a file that carries a part's name is that part. Nothing that this dataset did not write is
//! overwritten.

use super::part::Part;
use super::plan::Plan;
use crate::cli::Table;
use crate::exit::bad_input;
use crate::files;
use anyhow::{Context as _, Result, anyhow};
use rustix::fs::{FlockOperation, flock};
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Read as _, Seek as _, SeekFrom, Write as _};
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

/// The name of the plan's file.
const PLAN: &str = "dataset.json";
/// The longest plan that is read.
const PLAN_BYTES_MAX: u64 = 4 << 20;
/// What is read of the beginning or the end of a part at most, for the fingerprint.
const LOOK_BYTES_MAX: u64 = 32 << 20;

pub(super) struct Folder {
    path: PathBuf,
}

impl Folder {
    /// The folder of this plan: a new one, or one in which the same plan was begun.
    pub(super) fn open(path: &Path, plan: &Plan) -> Result<Self> {
        fs::create_dir_all(path).map_err(|error| {
            anyhow!(
                "cannot make the folder {}: {error}\nhint: name a folder of your own with --out",
                path.display()
            )
        })?;
        let file = path.join(PLAN);
        match fs::metadata(&file) {
            Ok(metadata) if metadata.len() > PLAN_BYTES_MAX => Err(foreign(&file)),
            Ok(_) => check_plan(&file, plan),
            Err(error) if error.kind() == io::ErrorKind::NotFound => put_plan(&file, plan),
            Err(error) => Err(error).with_context(|| format!("cannot look at {}", file.display())),
        }?;
        Ok(Self {
            path: path.to_path_buf(),
        })
    }

    /// Whether all files of a part are there.
    pub(super) fn has(&self, plan: &Plan, part: u64) -> Result<bool> {
        let mut all = true;
        for table in plan.tables() {
            all &= self.has_file(plan, part, table)?;
        }
        Ok(all)
    }

    /// Writes the files of a part that are not there.
    pub(super) fn put(&self, plan: &Plan, part: &Part) -> Result<()> {
        for table in plan.tables() {
            if !self.has_file(plan, part.number, table)? {
                let path = self.file(part.number, table);
                self.put_file(plan, part, table, &path)?;
            }
        }
        Ok(())
    }

    fn file(&self, part: u64, table: Table) -> PathBuf {
        self.path.join(format!("part-{part:06}.{}", table.name()))
    }

    /// Whether that file is there; an error if what is there is not ours.
    fn has_file(&self, plan: &Plan, part: u64, table: Table) -> Result<bool> {
        let path = self.file(part, table);
        let file = match File::open(&path) {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
            Err(error) => {
                return Err(error).with_context(|| format!("cannot open {}", path.display()));
            }
        };
        let is_ours = is_ours(file, plan, table)
            .with_context(|| format!("cannot read {}", path.display()))?;
        if is_ours {
            Ok(true)
        } else {
            Err(foreign(&path))
        }
    }

    fn put_file(&self, plan: &Plan, part: &Part, table: Table, path: &Path) -> Result<()> {
        let partial = partial_name(path);
        let locked = locked(&partial, FlockOperation::NonBlockingLockExclusive)
            .map_err(|error| unwritten(path, error))?;
        let Some(file) = locked else {
            return Err(bad_input(anyhow!(
                "another process is writing {}\nhint: give every process a shard of its own with --shard",
                partial.display()
            )));
        };
        // Whoever had the lock before may have made it.
        if path.exists() {
            return Ok(fs::remove_file(&partial)?);
        }
        let written = write(&file, |out| part.write(table, plan, out))
            .and_then(|()| Ok(files::rename(&partial, path)?));
        if written.is_err() {
            // The first error is the one to report; the next run writes over what cannot be removed.
            drop(fs::remove_file(&partial));
        }
        written.map_err(|error| unwritten(path, error))
    }
}

/// Writes the plan, unless another process of the same dataset does.
fn put_plan(path: &Path, plan: &Plan) -> Result<()> {
    let partial = partial_name(path);
    let put = || -> Result<bool> {
        let Some(file) = locked(&partial, FlockOperation::LockExclusive)? else {
            return Err(anyhow!("{} comes and goes", partial.display()));
        };
        if path.exists() {
            fs::remove_file(&partial)?;
            return Ok(false);
        }
        write(&file, |out| {
            serde_json::to_writer_pretty(&mut *out, plan)?;
            Ok(writeln!(out)?)
        })?;
        files::rename(&partial, path)?;
        Ok(true)
    };
    if put().map_err(|error| unwritten(path, error))? {
        return Ok(());
    }
    check_plan(path, plan)
}

/// The name of a file that is not whole: the same each time, so that the next run takes it up.
fn partial_name(path: &Path) -> PathBuf {
    let mut partial = path.as_os_str().to_owned();
    partial.push(".partial");
    PathBuf::from(partial)
}

fn write(file: &File, write: impl FnOnce(&mut BufWriter<&File>) -> Result<()>) -> Result<()> {
    file.set_len(0)?;
    files::fill(file, write)?;
    Ok(file.sync_all()?)
}

/// The file, made if it is not there, and nobody else's as long as it is open; `None` if it is somebody's.
fn locked(path: &Path, how: FlockOperation) -> Result<Option<File>> {
    for _ in 0..LOCK_TRIES_MAX {
        let file = OpenOptions::new()
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)?;
        match flock(&file, how) {
            Ok(()) => {}
            Err(rustix::io::Errno::WOULDBLOCK) => return Ok(None),
            Err(error) => return Err(io::Error::from(error).into()),
        }
        // It may have been renamed between the two.
        let mine = file.metadata()?;
        if fs::metadata(path)
            .is_ok_and(|named| (named.dev(), named.ino()) == (mine.dev(), mine.ino()))
        {
            return Ok(Some(file));
        }
    }
    Ok(None)
}

const LOCK_TRIES_MAX: usize = 10;

fn check_plan(file: &Path, plan: &Plan) -> Result<()> {
    let text = fs::read(file).with_context(|| format!("cannot read {}", file.display()))?;
    let Ok(there) = serde_json::from_slice::<Plan>(&text) else {
        return Err(foreign(file));
    };
    let differences = plan.differences(&there);
    if differences.is_empty() {
        return Ok(());
    }
    Err(bad_input(anyhow!(
        "{} is of another dataset: {}\nhint: name another folder with --out, or give the same scene, options and program to go on with this one",
        file.display(),
        differences.join("; ")
    )))
}

/// Whether a file is whole and of this dataset: its own words about it stand at the beginning of one kind, at the end
/// of the other, and either ends in a way that nothing incomplete does.
fn is_ours(mut file: File, plan: &Plan, table: Table) -> Result<bool> {
    let length = file.metadata()?.len();
    let begin = read_at(&mut file, 0, 4)?;
    let end = read_at(&mut file, length.saturating_sub(END_BYTES), END_BYTES)?;
    let fingerprint = plan.fingerprint.as_str();
    let (is_whole, at, look, wanted) = match table {
        Table::Parquet => {
            let footer = footer_bytes(&end).min(length);
            let is_whole = begin == b"PAR1" && end.ends_with(b"PAR1");
            let wanted = fingerprint.bytes().collect();
            (is_whole, length - footer, footer, wanted)
        }
        Table::Npz => {
            let is_whole = begin == b"PK\x03\x04" && end.starts_with(b"PK\x05\x06");
            // In arrays for numpy, each character has four bytes.
            let wanted: Vec<u8> = fingerprint
                .chars()
                .flat_map(|character| u32::from(character).to_le_bytes())
                .collect();
            let words = u64::try_from(serde_json::to_string(plan)?.len())?;
            (is_whole, 0, words * 4 + HEADS_BYTES, wanted)
        }
    };
    let words = read_at(&mut file, at, look.min(LOOK_BYTES_MAX))?;
    let mut places = words.windows(wanted.len().max(1));
    Ok(is_whole && places.any(|place| place == wanted))
}

/// So many bytes from there, or as many as there are.
fn read_at(file: &mut File, at: u64, bytes: u64) -> Result<Vec<u8>> {
    file.seek(SeekFrom::Start(at))?;
    let mut read = Vec::new();
    io::Read::by_ref(file).take(bytes).read_to_end(&mut read)?;
    Ok(read)
}

/// The length of a Parquet file's footer, which stands before the last four bytes, with both.
fn footer_bytes(end: &[u8]) -> u64 {
    let at = end.len().saturating_sub(8);
    let bytes = end.get(at..at + 4).unwrap_or_default().iter().rev();
    8 + bytes.fold(0, |size, byte| (size << 8) | u64::from(*byte))
}

/// What stands before the words about a dataset in an archive.
const HEADS_BYTES: u64 = 4096;
/// The end record of a zip archive without a comment.
const END_BYTES: u64 = 22;

fn unwritten(path: &Path, error: anyhow::Error) -> anyhow::Error {
    let told = format!(
        "cannot write {}: {error:#}\nhint: make room, or see to the folder, and run the same command again: it goes on where it was",
        path.display()
    );
    error.context(told)
}

fn foreign(path: &Path) -> anyhow::Error {
    bad_input(anyhow!(
        "{} is there, and is not a whole file of this dataset; it is left as it is\nhint: name another folder with --out, or move the file away",
        path.display()
    ))
}
