//! A spool's folder on a real file system.

use grideye_agent::spool::{Disk as _, Folder};

/// An open file that was removed would take what is written next, and nobody would find it.
#[test]
fn what_is_appended_after_a_removal_is_in_a_new_file() {
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
