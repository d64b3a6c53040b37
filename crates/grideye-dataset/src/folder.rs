//! The dataset folder: which files are complete, which are ours, and how parts are added.
//!
//! A part is written under a temporary name, locked, synced, and renamed when complete. Files of others are never
//! overwritten.

use crate::counts::Counts;
use crate::error::{Cause, DatasetError};
use crate::frames::Frames;
use crate::manifest::Manifest;
use crate::part::Part;
use crate::shard::Table;
use rustix::fs::{FlockOperation, flock};
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read as _, Seek as _, SeekFrom, Write as _};
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

const MANIFEST: &str = "dataset.json";
/// The name that the Hugging Face Hub and its library `datasets` look for.
const CARD: &str = "README.md";
const MANIFEST_BYTES_MAX: u64 = 4 << 20;
/// Limit on the bytes read from one end of a part to find the fingerprint.
const LOOK_BYTES_MAX: u64 = 32 << 20;

/// Writes part files; the program that makes a dataset supplies it.
pub trait Output: Sync {
    /// Writes a part as a `table` file, with `about` as its description of the dataset.
    ///
    /// # Errors
    /// Any reason the file cannot be written.
    fn write(&self, part: &Part, table: Table, about: &str, file: &File) -> Result<(), Cause>;

    /// The columns of Parquet files of parts like this one, a line of YAML each for the heading of the data card.
    fn features(&self, part: &Part) -> Vec<String>;

    /// Renames a synced file, so that the new name survives a power cut.
    ///
    /// # Errors
    /// File system errors.
    fn rename(&self, partial: &Path, path: &Path) -> io::Result<()>;
}

/// The folder of a dataset.
pub struct Folder<'a> {
    path: PathBuf,
    output: &'a dyn Output,
}

impl<'a> Folder<'a> {
    /// Creates the folder, or opens one with the same dataset in progress.
    ///
    /// # Errors
    /// If the folder belongs to another dataset or cannot be created.
    pub fn open(
        path: &Path,
        manifest: &Manifest,
        output: &'a dyn Output,
    ) -> Result<Self, DatasetError> {
        let made = fs::create_dir_all(path);
        made.map_err(|cause| {
            let path = path.display();
            DatasetError::Refused(format!(
                "cannot create the folder {path}: {cause}\nhint: name a folder you can write to with --out"
            ))
        })?;
        let folder = Self {
            path: path.to_path_buf(),
            output,
        };
        let file = path.join(MANIFEST);
        match fs::metadata(&file) {
            Ok(metadata) if metadata.len() > MANIFEST_BYTES_MAX => Err(foreign(&file)),
            Ok(_) => check_manifest(&file, manifest),
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                let text = serde_json::to_string_pretty(manifest).unwrap_or_default();
                match folder.put_text(&file, &format!("{text}\n"))? {
                    true => Ok(()),
                    false => check_manifest(&file, manifest),
                }
            }
            Err(error) => Err(unread(&file, &error)),
        }?;
        Ok(folder)
    }

    /// Whether all files of a part exist.
    ///
    /// # Errors
    /// If a file belongs to something else or cannot be read.
    pub fn has(&self, manifest: &Manifest, part: u64) -> Result<bool, DatasetError> {
        let mut all = true;
        for table in manifest.tables() {
            all &= self.has_file(manifest, part, table)?;
        }
        Ok(all && self.counts(manifest, part)?.is_some())
    }

    /// Writes the data card once all parts of the dataset are in the folder; returns whether they are.
    ///
    /// # Errors
    /// If a file belongs to something else or cannot be read or written.
    pub fn put_card(&self, frames: &Frames, manifest: &Manifest) -> Result<bool, DatasetError> {
        let mut all = Counts::default();
        for part in 0..manifest.parts() {
            match self.counts(manifest, part)? {
                Some(counts) => all.add(&counts),
                None => return Ok(false),
            }
        }
        let path = self.path.join(CARD);
        if !path.exists() {
            let features = self.output.features(&Part::new(frames, manifest, 0));
            self.put_text(&path, &manifest.card(&all, &features))?;
        }
        Ok(true)
    }

    /// What a part's frames show; `None` if it is not there.
    ///
    /// # Errors
    /// As [`Self::has`].
    pub fn counts(&self, manifest: &Manifest, part: u64) -> Result<Option<Counts>, DatasetError> {
        let path = self.file(manifest, part, "json");
        let text = match fs::read(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(unread(&path, &error)),
        };
        let counts = serde_json::from_slice::<Counts>(&text).ok();
        let counts = counts.filter(|counts| counts.fingerprint == manifest.fingerprint());
        counts.map(Some).ok_or_else(|| foreign(&path))
    }

    pub(crate) fn put(&self, manifest: &Manifest, part: &Part) -> Result<(), DatasetError> {
        for table in manifest.tables() {
            if !self.has_file(manifest, part.number, table)? {
                let path = self.file(manifest, part.number, table.name());
                self.put_file(manifest, part, table, &path)?;
            }
        }
        if self.counts(manifest, part.number)?.is_none() {
            let counts = serde_json::to_string(&Counts::of(part, manifest)).unwrap_or_default();
            let path = self.file(manifest, part.number, "json");
            self.put_text(&path, &format!("{counts}\n"))?;
        }
        Ok(())
    }

    fn file(&self, manifest: &Manifest, part: u64, end: &str) -> PathBuf {
        self.path.join(format!("{}.{end}", manifest.stem(part)))
    }

    fn has_file(&self, manifest: &Manifest, part: u64, table: Table) -> Result<bool, DatasetError> {
        let path = self.file(manifest, part, table.name());
        let file = match File::open(&path) {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
            Err(error) => return Err(unread(&path, &error)),
        };
        match is_ours(file, manifest, table) {
            Ok(true) => Ok(true),
            Ok(false) => Err(foreign(&path)),
            Err(error) => Err(unread(&path, &error)),
        }
    }

    fn put_file(
        &self,
        manifest: &Manifest,
        part: &Part,
        table: Table,
        path: &Path,
    ) -> Result<(), DatasetError> {
        let partial = partial_name(path);
        let locked = locked(&partial, FlockOperation::NonBlockingLockExclusive)
            .map_err(|error| unwritten(path, &error))?;
        let Some(file) = locked else {
            return Err(DatasetError::Refused(format!(
                "another process is writing {}\nhint: give every process its own shard with --shard",
                partial.display()
            )));
        };
        let put = || -> Result<(), Cause> {
            // The previous lock holder may have written it.
            if path.exists() {
                return Ok(fs::remove_file(&partial)?);
            }
            file.set_len(0)?;
            let written = self
                .output
                .write(part, table, &manifest.json(), &file)
                .and_then(|()| Ok(file.sync_all()?))
                .and_then(|()| Ok(self.output.rename(&partial, path)?));
            if written.is_err() {
                // Report the first error; the next run overwrites a file that cannot be removed.
                drop(fs::remove_file(&partial));
            }
            written
        };
        put().map_err(|error| unwritten(path, &error))
    }

    /// Writes a small file, unless another process does; returns whether it was written here.
    fn put_text(&self, path: &Path, text: &str) -> Result<bool, DatasetError> {
        let partial = partial_name(path);
        let put = || -> Result<bool, Cause> {
            let Some(mut file) = locked(&partial, FlockOperation::LockExclusive)? else {
                return Err(format!("other processes keep replacing {}", partial.display()).into());
            };
            if path.exists() {
                fs::remove_file(&partial)?;
                return Ok(false);
            }
            file.set_len(0)?;
            file.write_all(text.as_bytes())?;
            file.sync_all()?;
            self.output.rename(&partial, path)?;
            Ok(true)
        };
        put().map_err(|error| unwritten(path, &error))
    }
}

/// The name of an incomplete file: always the same, so that the next run reuses it.
fn partial_name(path: &Path) -> PathBuf {
    let mut partial = path.as_os_str().to_owned();
    partial.push(".partial");
    PathBuf::from(partial)
}

/// Opens or creates the file and locks it until closed; `None` if another process holds the lock.
fn locked(path: &Path, how: FlockOperation) -> Result<Option<File>, Cause> {
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
        // Another process may have renamed it between open and lock.
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

fn check_manifest(file: &Path, manifest: &Manifest) -> Result<(), DatasetError> {
    let text = fs::read(file).map_err(|error| unread(file, &error))?;
    let Ok(there) = serde_json::from_slice::<Manifest>(&text) else {
        return Err(foreign(file));
    };
    let differences = manifest.differences(&there);
    if differences.is_empty() {
        return Ok(());
    }
    Err(DatasetError::Refused(format!(
        "{} belongs to another dataset: {}\nhint: name another folder with --out, or continue this one with the same scene, options and program",
        file.display(),
        differences.join("; ")
    )))
}

/// The length of a file of records by its header, `… grideye FINGERPRINT 8192 bytes …`; `None` if it is not of this dataset.
fn npy_bytes(head: &[u8], fingerprint: &str) -> Option<u64> {
    let rest = head.strip_prefix(b"\x93NUMPY\x01\x00")?;
    let (length, rest) = rest.split_first_chunk::<2>()?;
    let length = u16::from_le_bytes(*length);
    let words = String::from_utf8_lossy(rest.get(..length.into())?).into_owned();
    let (_, records) = words.split_once(&format!("grideye {fingerprint} "))?;
    let (records, _) = records.split_once(" bytes")?;
    records
        .parse::<u64>()
        .ok()?
        .checked_add(10 + u64::from(length))
}

/// Whether a file is complete and of this dataset. Its description is at the start (npz) or at the end (Parquet).
fn is_ours(mut file: File, manifest: &Manifest, table: Table) -> io::Result<bool> {
    let length = file.metadata()?.len();
    let begin = read_at(&mut file, 0, 4)?;
    let end = read_at(&mut file, length.saturating_sub(END_BYTES), END_BYTES)?;
    let fingerprint = manifest.fingerprint();
    if table == Table::Npy {
        let head = read_at(&mut file, 0, NPY_HEAD_BYTES)?;
        return Ok(npy_bytes(&head, fingerprint) == Some(length));
    }
    let (is_whole, at, look, wanted) = match table {
        Table::Parquet => {
            let footer = footer_bytes(&end).min(length);
            let is_whole = begin == b"PAR1" && end.ends_with(b"PAR1");
            let wanted = fingerprint.bytes().collect();
            (is_whole, length - footer, footer, wanted)
        }
        Table::Npz | Table::Npy => {
            let is_whole = begin == b"PK\x03\x04" && end.starts_with(b"PK\x05\x06");
            // numpy arrays use four bytes per character.
            let wanted: Vec<u8> = fingerprint
                .chars()
                .flat_map(|character| u32::from(character).to_le_bytes())
                .collect();
            let words = u64::try_from(manifest.json().len()).unwrap_or(u64::MAX);
            (
                is_whole,
                0,
                words.saturating_mul(4).saturating_add(HEADS_BYTES),
                wanted,
            )
        }
    };
    let words = read_at(&mut file, at, look.min(LOOK_BYTES_MAX))?;
    let mut places = words.windows(wanted.len().max(1));
    Ok(is_whole && places.any(|place| place == wanted))
}

fn read_at(file: &mut File, at: u64, bytes: u64) -> io::Result<Vec<u8>> {
    file.seek(SeekFrom::Start(at))?;
    let mut read = Vec::new();
    io::Read::by_ref(file).take(bytes).read_to_end(&mut read)?;
    Ok(read)
}

/// The length of a Parquet footer, including the four bytes of its length and the last four of the file.
fn footer_bytes(end: &[u8]) -> u64 {
    let at = end.len().saturating_sub(8);
    let bytes = end.get(at..at + 4).unwrap_or_default().iter().rev();
    8 + bytes.fold(0, |size, byte| (size << 8) | u64::from(*byte))
}

/// Limit on the bytes before the description in an archive.
const HEADS_BYTES: u64 = 4096;
const END_BYTES: u64 = 22;
/// The longest header of an array, version 1.0.
const NPY_HEAD_BYTES: u64 = 10 + (1 << 16);

fn foreign(path: &Path) -> DatasetError {
    DatasetError::Refused(format!(
        "{} exists but is not a complete file of this dataset; it is left as it is\nhint: name another folder with --out, or move the file away",
        path.display()
    ))
}

fn unread(path: &Path, cause: &io::Error) -> DatasetError {
    let path = path.display();
    DatasetError::Disk(format!(
        "cannot read {path}: {cause}\nhint: name another folder with --out, or fix this file"
    ))
}

fn unwritten(path: &Path, cause: &Cause) -> DatasetError {
    let path = path.display();
    DatasetError::Disk(format!(
        "cannot write {path}: {cause:#}\nhint: free disk space or fix the folder, then run the same command again: it continues where it stopped"
    ))
}
