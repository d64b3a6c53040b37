//! How the device gets to its path, for one program and for nobody else.
//!
//! The work is a list of steps that is complete before the first is carried out. A process with the right to mount
//! carries them out in a thread with a mount namespace of its own and starts the program from there. One without
//! that right lets the program's own process carry them out between fork and exec, in a user namespace of its own; there nothing
//! may be allocated, hence the list.
//!
//! Where the device's file is missing, `/dev` is rebuilt inside the namespace: an empty tmpfs, every entry of the real
//! `/dev` bound into it, and the device's file beside them. So nothing appears outside, and nothing can be left behind:
//! when the last process of the namespace ends, the kernel takes all of it away.

use std::ffi::{CStr, CString, OsStr};
use std::fs;
use std::io;
use std::os::fd::{AsRawFd, OwnedFd, RawFd};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

use super::error::RunError;
use super::wire;
use crate::sys;

/// Most entries of a `/dev` that is rebuilt.
pub const DEV_ENTRIES_MAX: usize = 4096;

const DEV: &str = "/dev";

/// Whose right to mount is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Right {
    /// The process's own (CAP_SYS_ADMIN).
    Own,
    /// That of a new user namespace, in which user and group stay what they are.
    NewUserNamespace { user: u32, group: u32 },
}

/// What must be done so that the program sees its devices.
pub(super) struct Plan {
    steps: Vec<Step>,
    /// One open /dev/fuse for each device, in their order.
    fuses: Vec<Reserved>,
    /// Held only so that its number stays reserved.
    _old_dev: Option<Reserved>,
}

/// The step that failed, and why.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct StepFailed {
    pub(super) step: usize,
    pub(super) errno: i32,
}

impl Plan {
    /// The devices appear at `paths`, through the kernel's FUSE device at `fuse_device`.
    pub(super) fn new(paths: &[&Path], fuse_device: &Path, right: Right) -> Result<Self, RunError> {
        let mut plan = Self {
            steps: namespace_steps(right)?,
            fuses: Vec::new(),
            _old_dev: None,
        };
        for _ in paths {
            plan.open_fuse(fuse_device)?;
        }
        let mut missing = Vec::new();
        for path in paths {
            match fs::metadata(path) {
                Ok(found) if found.is_dir() => {
                    return Err(RunError::DeviceIsFolder {
                        device: path.to_path_buf(),
                    });
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

    /// Carries out all steps but the last ones that need the server to answer; see [`finish`](Self::finish).
    pub(super) fn prepare(&self) -> Result<(), StepFailed> {
        self.carry_out(|step| !step.needs_the_server())
    }

    /// Carries out the steps that [`prepare`](Self::prepare) left.
    pub(super) fn finish(&self) -> Result<(), StepFailed> {
        self.carry_out(Step::needs_the_server)
    }

    /// The numbers under which /dev/fuse is open after [`prepare`](Self::prepare), in the process that did it.
    pub(super) fn fuse_numbers(&self) -> impl Iterator<Item = RawFd> + '_ {
        self.fuses.iter().map(Reserved::number)
    }

    /// Every open /dev/fuse, if this process carried out the plan.
    pub(super) fn into_fuses(self) -> Vec<OwnedFd> {
        self.fuses.into_iter().map(|reserved| reserved.0).collect()
    }

    /// The failure in words.
    pub(super) fn explain(&self, failed: StepFailed, fuse_device: &Path) -> RunError {
        let source = io::Error::from_raw_os_error(failed.errno);
        let Some(step) = self.steps.get(failed.step) else {
            return RunError::Serve { source };
        };
        let denied = matches!(
            failed.errno,
            libc::EPERM | libc::EACCES | libc::ENOSPC | libc::EUSERS
        );
        if !denied && step.opens(fuse_device) {
            return RunError::NoFuse {
                path: fuse_device.to_path_buf(),
                source,
            };
        }
        let step = step.describe();
        if denied {
            RunError::NotPermitted { step, source }
        } else {
            RunError::Setup { step, source }
        }
    }

    fn carry_out(&self, chosen: impl Fn(&Step) -> bool) -> Result<(), StepFailed> {
        for (index, step) in self
            .steps
            .iter()
            .enumerate()
            .filter(|(_, step)| chosen(step))
        {
            step.carry_out().map_err(|error| StepFailed {
                step: index,
                errno: error.raw_os_error().unwrap_or(libc::EIO),
            })?;
        }
        Ok(())
    }

    fn open_fuse(&mut self, fuse_device: &Path) -> Result<(), RunError> {
        let fuse = Reserved::new()?;
        self.steps.push(Step::Open {
            path: c_path(fuse_device)?,
            flags: libc::O_RDWR | libc::O_NONBLOCK,
            number: fuse.number(),
        });
        self.fuses.push(fuse);
        Ok(())
    }

    /// Replaces `/dev` by a copy with room for the devices that it lacks.
    fn rebuild_dev(&mut self, missing: &[&Path]) -> Result<(), RunError> {
        if let Some(elsewhere) = missing
            .iter()
            .find(|device| device.parent() != Some(Path::new(DEV)))
        {
            return Err(RunError::DeviceMissing {
                device: elsewhere.to_path_buf(),
            });
        }
        let old = Reserved::new()?;
        self.steps.push(Step::Open {
            path: c_text(DEV)?,
            flags: libc::O_PATH | libc::O_DIRECTORY,
            number: old.number(),
        });
        self.steps.push(Step::Mount {
            source: Some(c_text("tmpfs")?),
            target: c_text(DEV)?,
            kind: Some(c_text("tmpfs")?),
            flags: libc::MS_NOSUID | libc::MS_NOEXEC,
            data: Some(c_text("mode=0755,size=1m")?),
        });
        for entry in entries_of(Path::new(DEV))? {
            self.steps.extend(entry.steps(old.number())?);
        }
        for device in missing {
            self.steps.push(Step::MakeFile {
                path: c_path(device)?,
            });
        }
        self._old_dev = Some(old);
        Ok(())
    }

    fn mount_fuse(&mut self, index: usize, device: &Path, right: Right) -> Result<(), RunError> {
        let (user, group) = right.owner();
        let device = c_path(device)?;
        let fuse = self.fuses.get(index).map_or(-1, Reserved::number);
        let data = format!(
            "fd={fuse},rootmode={:o},user_id={user},group_id={group},allow_other",
            wire::FILE_MODE
        );
        self.steps.push(Step::Mount {
            source: Some(c_text("i2c-emulation")?),
            target: device.clone(),
            kind: Some(c_text("fuse")?),
            flags: libc::MS_NOSUID | libc::MS_NODEV | libc::MS_NOEXEC | libc::MS_NOATIME,
            data: Some(c_text(&data)?),
        });
        if matches!(right, Right::NewUserNamespace { .. }) {
            // Until the kernel has asked once, it believes that the file belongs to user 0, who does not exist in
            // this namespace, and refuses to open it.
            self.steps.push(Step::LookAt { path: device });
        }
        Ok(())
    }
}

impl Right {
    /// Who owns the device's file, as the program sees it.
    pub(super) const fn owner(self) -> (u32, u32) {
        match self {
            Self::Own => (0, 0),
            Self::NewUserNamespace { user, group } => (user, group),
        }
    }
}

/// One system call with all its arguments.
enum Step {
    Unshare {
        flags: libc::c_int,
    },
    WriteFile {
        path: CString,
        text: String,
    },
    Open {
        path: CString,
        flags: libc::c_int,
        number: RawFd,
    },
    Mount {
        source: Option<CString>,
        target: CString,
        kind: Option<CString>,
        flags: libc::c_ulong,
        data: Option<CString>,
    },
    /// With all that is mounted below. An entry that has vanished since `/dev` was read is passed over.
    Bind {
        source: CString,
        target: CString,
    },
    MakeFolder {
        path: CString,
    },
    MakeFile {
        path: CString,
    },
    MakeLink {
        text: CString,
        path: CString,
    },
    LookAt {
        path: CString,
    },
}

impl Step {
    /// Allocates nothing: it may run between fork and exec.
    fn carry_out(&self) -> io::Result<()> {
        match self {
            Self::Unshare { flags } => sys::unshare(*flags),
            Self::WriteFile { path, text } => sys::write_file(path, text.as_bytes()),
            Self::Open {
                path,
                flags,
                number,
            } => sys::put_at(&sys::open(path, *flags)?, *number),
            Self::Mount {
                source,
                target,
                kind,
                flags,
                data,
            } => sys::mount(
                source.as_deref(),
                target,
                kind.as_deref(),
                *flags,
                data.as_deref(),
            ),
            Self::Bind { source, target } => {
                match sys::mount(
                    Some(source),
                    target,
                    None,
                    libc::MS_BIND | libc::MS_REC,
                    None,
                ) {
                    Err(error) if error.raw_os_error() == Some(libc::ENOENT) => Ok(()),
                    outcome => outcome,
                }
            }
            Self::MakeFolder { path } => sys::make_folder(path),
            Self::MakeFile { path } => sys::open(path, libc::O_CREAT | libc::O_RDONLY).map(drop),
            Self::MakeLink { text, path } => sys::make_link(text, path),
            Self::LookAt { path } => sys::look_at(path),
        }
    }

    fn opens(&self, wanted: &Path) -> bool {
        matches!(self, Self::Open { path, .. } if path.to_bytes() == wanted.as_os_str().as_bytes())
    }

    fn needs_the_server(&self) -> bool {
        matches!(self, Self::LookAt { .. })
    }

    fn describe(&self) -> String {
        let text = |text: &CStr| text.to_string_lossy().into_owned();
        match self {
            Self::Unshare { .. } => "making a private mount namespace".to_owned(),
            Self::WriteFile { path, .. } => format!("writing {}", text(path)),
            Self::Open { path, .. } => format!("opening {}", text(path)),
            Self::Mount {
                kind: Some(kind),
                target,
                ..
            } => format!("mounting {} on {}", text(kind), text(target)),
            Self::Mount { target, .. } => format!("separating the mounts below {}", text(target)),
            Self::Bind { target, .. } => format!("binding {}", text(target)),
            Self::MakeFolder { path } | Self::MakeFile { path } | Self::MakeLink { path, .. } => {
                format!("making {}", text(path))
            }
            Self::LookAt { path } => format!("looking at {}", text(path)),
        }
    }
}

fn namespace_steps(right: Right) -> Result<Vec<Step>, RunError> {
    let mut steps = match right {
        Right::Own => vec![Step::Unshare {
            flags: libc::CLONE_NEWNS,
        }],
        Right::NewUserNamespace { user, group } => vec![
            Step::Unshare {
                flags: libc::CLONE_NEWUSER | libc::CLONE_NEWNS,
            },
            Step::WriteFile {
                path: c_text("/proc/self/setgroups")?,
                text: "deny".to_owned(),
            },
            Step::WriteFile {
                path: c_text("/proc/self/uid_map")?,
                text: format!("{user} {user} 1"),
            },
            Step::WriteFile {
                path: c_text("/proc/self/gid_map")?,
                text: format!("{group} {group} 1"),
            },
        ],
    };
    // Mounts made here stay here; what is mounted or unmounted outside is still followed.
    steps.push(Step::Mount {
        source: None,
        target: c_text("/")?,
        kind: None,
        flags: libc::MS_REC | libc::MS_SLAVE,
        data: None,
    });
    Ok(steps)
}

/// One entry of the real `/dev`.
struct DevEntry {
    name: CString,
    kind: DevEntryKind,
}

enum DevEntryKind {
    Folder,
    Link(CString),
    File,
}

impl DevEntry {
    /// A folder or file is bound with all that is mounted on it; a link is made again.
    fn steps(self, old_dev: RawFd) -> Result<Vec<Step>, RunError> {
        let path = c_text_of(&[DEV.as_bytes(), b"/", self.name.as_bytes()])?;
        let make = match self.kind {
            DevEntryKind::Link(text) => return Ok(vec![Step::MakeLink { text, path }]),
            DevEntryKind::Folder => Step::MakeFolder { path: path.clone() },
            DevEntryKind::File => Step::MakeFile { path: path.clone() },
        };
        let old = format!("/proc/self/fd/{old_dev}/");
        let source = c_text_of(&[old.as_bytes(), self.name.as_bytes()])?;
        Ok(vec![
            make,
            Step::Bind {
                source,
                target: path,
            },
        ])
    }
}

fn entries_of(dev: &Path) -> Result<Vec<DevEntry>, RunError> {
    let failed = |source| RunError::Setup {
        step: format!("reading {}", dev.display()),
        source,
    };
    let mut entries = Vec::new();
    for entry in fs::read_dir(dev).map_err(failed)? {
        if entries.len() == DEV_ENTRIES_MAX {
            return Err(RunError::DevTooFull {
                entries_max: DEV_ENTRIES_MAX,
            });
        }
        let entry = entry.map_err(failed)?;
        let kind = match entry.file_type().map_err(failed)? {
            kind if kind.is_dir() => DevEntryKind::Folder,
            kind if kind.is_symlink() => {
                DevEntryKind::Link(c_path(&fs::read_link(entry.path()).map_err(failed)?)?)
            }
            _ => DevEntryKind::File,
        };
        entries.push(DevEntry {
            name: c_os(&entry.file_name())?,
            kind,
        });
    }
    Ok(entries)
}

/// A descriptor's number that a later open file will take over.
struct Reserved(OwnedFd);

impl Reserved {
    fn new() -> Result<Self, RunError> {
        fs::File::open("/dev/null")
            .map(|file| Self(file.into()))
            .map_err(|source| RunError::Setup {
                step: "opening /dev/null".to_owned(),
                source,
            })
    }

    fn number(&self) -> RawFd {
        self.0.as_raw_fd()
    }
}

fn c_path(path: &Path) -> Result<CString, RunError> {
    c_os(path.as_os_str())
}

fn c_os(text: &OsStr) -> Result<CString, RunError> {
    c_text_of(&[text.as_bytes()])
}

fn c_text(text: &str) -> Result<CString, RunError> {
    c_text_of(&[text.as_bytes()])
}

fn c_text_of(parts: &[&[u8]]) -> Result<CString, RunError> {
    let bytes = parts.concat();
    CString::new(bytes).map_err(|error| RunError::PathWithZero {
        path: PathBuf::from(OsStr::from_bytes(&error.into_vec())),
    })
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
        let refused = entries_of(folder.path()).map(drop).unwrap_err();
        assert!(matches!(
            refused,
            RunError::DevTooFull {
                entries_max: DEV_ENTRIES_MAX
            }
        ));
    }

    #[test]
    fn what_the_user_may_not_is_told_from_what_the_machine_cannot() {
        let fuse_device = Path::new("/dev/fuse");
        let device = Path::new("/dev/i2c-emulation-plan");
        let plan = Plan::new(&[device], fuse_device, Right::Own).unwrap();
        let explain = |step, errno| plan.explain(StepFailed { step, errno }, fuse_device);
        let open_fuse = plan
            .steps
            .iter()
            .position(|step| step.opens(fuse_device))
            .unwrap();
        let mount_fuse = plan.steps.len() - 1;
        for errno in [libc::ENOENT, libc::ENODEV, libc::ENXIO] {
            assert!(matches!(explain(open_fuse, errno), RunError::NoFuse { .. }));
            assert!(matches!(explain(mount_fuse, errno), RunError::Setup { .. }));
        }
        for errno in [libc::EPERM, libc::EACCES, libc::ENOSPC] {
            assert!(matches!(
                explain(open_fuse, errno),
                RunError::NotPermitted { .. }
            ));
            assert!(matches!(explain(0, errno), RunError::NotPermitted { .. }));
        }
        assert!(matches!(
            explain(usize::MAX, libc::EPERM),
            RunError::Serve { .. }
        ));
    }
}
