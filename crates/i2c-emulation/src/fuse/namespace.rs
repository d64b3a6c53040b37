//! Mounts the device at its path for one program. All steps are planned before the first runs. With the right to mount
//! they run in a thread; otherwise in the program's own process and user namespace, between fork and exec, without
//! allocating.
//!
//! If the device's file is missing, an empty tmpfs replaces `/dev`, with every entry of the real `/dev` bound into it.
#![expect(
    unsafe_code,
    reason = "own namespaces and reserved descriptors are for the caller to keep sound"
)]

use super::wire;
use crate::run::{FUSE_NEEDS, RunError, setup_failed};
use rustix::fs::{Mode, OFlags, mkdir, open, stat, symlink};
use rustix::io::{DupFlags, Errno, dup3};
use rustix::mount::{MountFlags, MountPropagationFlags, mount, mount_bind_recursive, mount_change};
use rustix::thread::{UnshareFlags, unshare_unsafe};
use std::ffi::{CStr, CString, OsStr};
use std::fs::{self, DirEntry};
use std::io;
use std::mem::ManuallyDrop;
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd, RawFd};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

/// The most entries of a `/dev` to rebuild.
pub const DEV_ENTRIES_MAX: usize = 4096;

const DEV: &str = "/dev";

/// The source of the right to mount.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Right {
    /// The process's own (CAP_SYS_ADMIN).
    Own,
    /// That of a new user namespace, in which user and group stay the same.
    NewUserNamespace { user: u32, group: u32 },
}

impl Right {
    /// User and group of the device's file, as the program sees it.
    pub(super) const fn owner(self) -> (u32, u32) {
        match self {
            Self::Own => (0, 0),
            Self::NewUserNamespace { user, group } => (user, group),
        }
    }
}

/// The steps that make the devices visible to the program.
pub(super) struct Plan {
    steps: Vec<Step>,
    fuses: Vec<OwnedFd>,
    /// Keeps its descriptor number reserved.
    _old_dev: Option<OwnedFd>,
}

struct Step {
    kind: Kind,
    what: String,
    /// Must not allocate: it may run between fork and exec.
    work: Box<dyn Fn() -> rustix::io::Result<()> + Send + Sync>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Ordinary,
    OpensFuse,
    NeedsTheServer,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct StepFailed {
    pub(super) step: usize,
    pub(super) errno: i32,
}

impl Plan {
    /// Plans to mount the devices at `paths`, through the kernel's FUSE device at `fuse_device`.
    pub(super) fn new(paths: &[&Path], fuse_device: &Path, right: Right) -> Result<Self, RunError> {
        let mut plan = Self {
            steps: Vec::new(),
            fuses: Vec::new(),
            _old_dev: None,
        };
        plan.make_namespaces(right);
        for _ in paths {
            plan.open_fuse(fuse_device)?;
        }
        let mut missing = Vec::new();
        for path in paths {
            match fs::metadata(path) {
                Ok(found) if found.is_dir() => {
                    return Err(RunError::DeviceIsFolder(path.to_path_buf()));
                }
                Ok(_) => {}
                Err(_) => missing.push(*path),
            }
        }
        if !missing.is_empty() {
            plan.rebuild_dev(&missing)?;
        }
        for (index, path) in paths.iter().enumerate() {
            plan.mount_fuse(index, path, right)?;
        }
        Ok(plan)
    }

    /// Runs all steps except those that need answers from the server; [`finish`](Self::finish) runs those.
    pub(super) fn prepare(&self) -> Result<(), StepFailed> {
        self.carry_out(|kind| kind != Kind::NeedsTheServer)
    }

    pub(super) fn finish(&self) -> Result<(), StepFailed> {
        self.carry_out(|kind| kind == Kind::NeedsTheServer)
    }

    /// The descriptors of /dev/fuse after [`prepare`](Self::prepare), in the process that ran it.
    pub(super) fn fuse_numbers(&self) -> impl Iterator<Item = RawFd> + '_ {
        self.fuses.iter().map(AsRawFd::as_raw_fd)
    }

    /// Every open /dev/fuse, if this process ran the plan.
    pub(super) fn into_fuses(self) -> Vec<OwnedFd> {
        self.fuses
    }

    pub(super) fn explain(&self, failed: StepFailed, fuse_device: &Path) -> RunError {
        let source = io::Error::from_raw_os_error(failed.errno);
        let Some(step) = self.steps.get(failed.step) else {
            return RunError::Serve(source);
        };
        let what = step.what.clone();
        match failed.errno {
            libc::EPERM | libc::EACCES | libc::ENOSPC | libc::EUSERS => {
                RunError::NotPermitted(what, source)
            }
            _ if step.kind == Kind::OpensFuse => RunError::NoFuse(fuse_device.to_owned(), source),
            _ => setup_failed(&what, source, FUSE_NEEDS),
        }
    }

    fn carry_out(&self, chosen: impl Fn(Kind) -> bool) -> Result<(), StepFailed> {
        let steps = self.steps.iter().enumerate();
        for (index, step) in steps.filter(|(_, step)| chosen(step.kind)) {
            (step.work)().map_err(|errno| StepFailed {
                step: index,
                errno: errno.raw_os_error(),
            })?;
        }
        Ok(())
    }

    fn add(
        &mut self,
        kind: Kind,
        what: impl Into<String>,
        work: impl Fn() -> rustix::io::Result<()> + Send + Sync + 'static,
    ) {
        self.steps.push(Step {
            kind,
            what: what.into(),
            work: Box::new(work),
        });
    }

    fn make_namespaces(&mut self, right: Right) {
        let flags = match right {
            Right::Own => UnshareFlags::NEWNS,
            Right::NewUserNamespace { .. } => UnshareFlags::NEWUSER | UnshareFlags::NEWNS,
        };
        let what = "making a private mount namespace";
        self.add(Kind::Ordinary, what, move || {
            // SAFETY: neither flag separates anything that Rust's threads share.
            unsafe { unshare_unsafe(flags) }
        });
        if let Right::NewUserNamespace { user, group } = right {
            for (path, text) in [
                (c"/proc/self/setgroups", "deny".to_owned()),
                (c"/proc/self/uid_map", format!("{user} {user} 1")),
                (c"/proc/self/gid_map", format!("{group} {group} 1")),
            ] {
                let what = format!("writing {}", path.to_string_lossy());
                self.add(Kind::Ordinary, what, move || {
                    let file = open(path, OFlags::WRONLY | OFlags::CLOEXEC, Mode::empty())?;
                    rustix::io::write(file, text.as_bytes()).map(drop)
                });
            }
        }
        // Mounts made here stay here; mounts made outside still appear.
        self.add(Kind::Ordinary, "separating the mounts below /", || {
            let flags = MountPropagationFlags::DOWNSTREAM | MountPropagationFlags::REC;
            mount_change(c"/", flags)
        });
    }

    fn open_fuse(&mut self, fuse_device: &Path) -> Result<(), RunError> {
        let fuse = reserve()?;
        let (path, number) = (c_text(fuse_device)?, fuse.as_raw_fd());
        let what = format!("opening {}", fuse_device.display());
        self.add(Kind::OpensFuse, what, move || {
            open_at(&path, OFlags::RDWR | OFlags::NONBLOCK, number)
        });
        self.fuses.push(fuse);
        Ok(())
    }

    /// Replaces `/dev` by a copy with room for the missing devices.
    fn rebuild_dev(&mut self, missing: &[&Path]) -> Result<(), RunError> {
        let dev = Path::new(DEV);
        if let Some(elsewhere) = missing.iter().find(|path| path.parent() != Some(dev)) {
            return Err(RunError::DeviceMissing(elsewhere.to_path_buf()));
        }
        let old = reserve()?;
        let number = old.as_raw_fd();
        self.add(Kind::Ordinary, "opening /dev", move || {
            open_at(c"/dev", OFlags::PATH | OFlags::DIRECTORY, number)
        });
        self.add(Kind::Ordinary, "mounting tmpfs on /dev", || {
            let flags = MountFlags::NOSUID | MountFlags::NOEXEC;
            mount(c"tmpfs", c"/dev", c"tmpfs", flags, c"mode=0755,size=1m")
        });
        for entry in entries_of(dev)? {
            self.copy_entry(&entry, number)?;
        }
        for device in missing {
            self.make_file(c_text(device)?);
        }
        self._old_dev = Some(old);
        Ok(())
    }

    /// Binds a folder or file with everything mounted on it; recreates a link.
    fn copy_entry(&mut self, entry: &DirEntry, old_dev: RawFd) -> Result<(), RunError> {
        let path = c_text(entry.path())?;
        let making = format!("making {}", path.to_string_lossy());
        let kind = entry.file_type().map_err(unreadable)?;
        if kind.is_symlink() {
            let text = c_text(fs::read_link(entry.path()).map_err(unreadable)?)?;
            self.add(Kind::Ordinary, making, move || symlink(&text, &path));
            return Ok(());
        }
        let folder = PathBuf::from(format!("/proc/self/fd/{old_dev}"));
        let source = c_text(folder.join(entry.file_name()))?;
        if kind.is_dir() {
            let path = path.clone();
            let mode = Mode::from_raw_mode(0o755);
            self.add(Kind::Ordinary, making, move || mkdir(&path, mode));
        } else {
            self.make_file(path.clone());
        }
        let what = format!("binding {}", path.to_string_lossy());
        let bind = move || match mount_bind_recursive(&source, &path) {
            // It has vanished since `/dev` was read.
            Err(Errno::NOENT) => Ok(()),
            outcome => outcome,
        };
        self.add(Kind::Ordinary, what, bind);
        Ok(())
    }

    fn make_file(&mut self, path: CString) {
        let what = format!("making {}", path.to_string_lossy());
        self.add(Kind::Ordinary, what, move || {
            let flags = OFlags::CREATE | OFlags::RDONLY | OFlags::CLOEXEC;
            open(&path, flags, Mode::from_raw_mode(0o666)).map(drop)
        });
    }

    fn mount_fuse(&mut self, index: usize, device: &Path, right: Right) -> Result<(), RunError> {
        let (user, group) = right.owner();
        let fuse = self.fuses.get(index).map_or(-1, AsRawFd::as_raw_fd);
        let data = c_text(format!(
            "fd={fuse},rootmode={:o},user_id={user},group_id={group},allow_other",
            wire::FILE_MODE
        ))?;
        let path = c_text(device)?;
        let what = format!("mounting fuse on {}", device.display());
        self.add(Kind::Ordinary, what, move || {
            let quiet = MountFlags::NOSUID | MountFlags::NODEV;
            let flags = quiet | MountFlags::NOEXEC | MountFlags::NOATIME;
            mount(c"i2c-emulation", &path, c"fuse", flags, data.as_c_str())
        });
        if right != Right::Own {
            // Until the kernel's first query, it assumes that the file belongs to user 0, who does not exist in this
            // namespace, and refuses to open it.
            let path = c_text(device)?;
            let what = format!("looking at {}", device.display());
            self.add(Kind::NeedsTheServer, what, move || stat(&path).map(drop));
        }
        Ok(())
    }
}

fn open_at(path: &CStr, flags: OFlags, number: RawFd) -> rustix::io::Result<()> {
    let file = open(path, flags | OFlags::CLOEXEC, Mode::empty())?;
    // SAFETY: the plan owns this descriptor longer than its steps run; here it is only borrowed.
    let mut reserved = ManuallyDrop::new(unsafe { OwnedFd::from_raw_fd(number) });
    dup3(&file, &mut reserved, DupFlags::CLOEXEC)
}

fn entries_of(dev: &Path) -> Result<Vec<DirEntry>, RunError> {
    let mut entries = Vec::new();
    for entry in fs::read_dir(dev).map_err(unreadable)? {
        if entries.len() == DEV_ENTRIES_MAX {
            return Err(RunError::DevTooFull(DEV_ENTRIES_MAX));
        }
        entries.push(entry.map_err(unreadable)?);
    }
    Ok(entries)
}

/// A descriptor that a later open file will replace.
fn reserve() -> Result<OwnedFd, RunError> {
    let file = fs::File::open("/dev/null").map(OwnedFd::from);
    file.map_err(|source| setup_failed("opening /dev/null", source, FUSE_NEEDS))
}

fn unreadable(source: io::Error) -> RunError {
    setup_failed("reading /dev", source, FUSE_NEEDS)
}

fn c_text(text: impl AsRef<OsStr>) -> Result<CString, RunError> {
    let text = text.as_ref();
    CString::new(text.as_bytes()).or(Err(RunError::PathWithZero(text.into())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dev_of_too_many_entries_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        for index in 0..DEV_ENTRIES_MAX {
            fs::File::create(folder.path().join(index.to_string())).unwrap();
        }
        assert_eq!(entries_of(folder.path()).unwrap().len(), DEV_ENTRIES_MAX);
        fs::File::create(folder.path().join("one more")).unwrap();
        let refused = entries_of(folder.path()).unwrap_err();
        assert!(matches!(refused, RunError::DevTooFull(DEV_ENTRIES_MAX)));
    }

    #[test]
    fn a_missing_right_and_a_missing_feature_have_different_errors() {
        let fuse_device = Path::new("/dev/fuse");
        let device = Path::new("/dev/i2c-emulation-plan");
        let plan = Plan::new(&[device], fuse_device, Right::Own).unwrap();
        let explain = |step, errno| plan.explain(StepFailed { step, errno }, fuse_device);
        let opens_fuse = |step: &Step| step.kind == Kind::OpensFuse;
        let open_fuse = plan.steps.iter().position(opens_fuse).unwrap();
        let mount_fuse = plan.steps.len() - 1;
        for errno in [libc::ENOENT, libc::ENODEV, libc::ENXIO] {
            assert!(matches!(explain(open_fuse, errno), RunError::NoFuse(..)));
            assert!(matches!(explain(mount_fuse, errno), RunError::Setup { .. }));
        }
        for errno in [libc::EPERM, libc::EACCES, libc::ENOSPC] {
            for step in [0, open_fuse] {
                assert!(matches!(explain(step, errno), RunError::NotPermitted(..)));
            }
        }
        let elsewhere = explain(usize::MAX, libc::EPERM);
        assert!(matches!(elsewhere, RunError::Serve(_)));
    }
}
