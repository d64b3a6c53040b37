//! A spool's folder on a real file system.

use grideye_agent::spool::{Disk as _, Folder, FolderError};

/// If a removed file stayed open, later writes to its name would be lost.
#[test]
fn appending_after_a_removal_makes_a_new_file() {
    let folder = tempfile::tempdir().unwrap();
    let mut disk = Folder::open(folder.path()).unwrap();
    disk.append("x", b"one").unwrap();
    disk.remove("x").unwrap();
    disk.append("x", b"two").unwrap();
    assert_eq!(disk.read("x", 0, 99).unwrap(), b"two");
    disk.rename("x", "y").unwrap();
    disk.append("x", b"three").unwrap();
    assert_eq!(disk.read("x", 0, 99).unwrap(), b"three");
    assert_eq!(disk.read("y", 0, 99).unwrap(), b"two");
}

#[test]
fn a_folder_is_a_disk_and_is_used_by_one_agent_at_a_time() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a/spool");
    let mut disk = Folder::open(&path).unwrap();
    disk.append("x", b"one").unwrap();
    disk.append("x", b"two").unwrap();
    disk.sync("x").unwrap();
    disk.write("state", b"s").unwrap();
    disk.write("state.new", b"state").unwrap();
    disk.sync("state.new").unwrap();
    disk.rename("state.new", "state").unwrap();
    disk.write("quarantine/y", b"why").unwrap();
    disk.sync_folder().unwrap();
    let mut names = disk.list().unwrap();
    names.sort();
    assert_eq!(names, ["lock", "quarantine/y", "state", "x"]);
    assert_eq!(disk.size("x").unwrap(), 6);
    assert_eq!(disk.read("x", 2, 2).unwrap(), b"et");
    assert_eq!(disk.read("state", 0, 99).unwrap(), b"state");
    disk.rename("x", "quarantine/x").unwrap();
    // A new file of the same name.
    disk.append("x", b"new").unwrap();
    assert_eq!(disk.read("x", 0, 99).unwrap(), b"new");
    disk.remove("x").unwrap();
    assert!(disk.read("x", 0, 1).is_err());
    assert!(disk.free_bytes().unwrap() > 0);

    let second = Folder::open(&path).unwrap_err();
    assert!(matches!(second, FolderError::Locked { .. }));
    let text = second.to_string();
    assert!(text.contains("another agent uses this spool\nhint: "));
    drop(disk);
    drop(Folder::open(&path).unwrap());
}

#[test]
fn an_unusable_folder_is_named_with_a_hint() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let error = Folder::open(&file.path().join("spool")).unwrap_err();
    let (text, path) = (error.to_string(), file.path().display().to_string());
    assert!(text.starts_with(&path), "{text}");
    assert!(text.contains("\nhint: spool.folder must be"), "{text}");
}
