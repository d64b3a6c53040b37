//! Answers the kernel's requests, bytes in and bytes out, without any system call.

use super::wire::{self, Request, opcode};
use crate::adapter::EmulatedAdapter;
use crate::guests::lock;
use crate::ioctl::{AdapterMode, CallerMemory, Errno, MESSAGE_BYTES_MAX, OpenFile, PointerWidth};
use std::collections::HashMap;
use std::sync::Mutex;

/// The most files open at once; one more returns ENFILE.
pub const OPEN_FILES_MAX: usize = 1024;

const IOCTL_FROM_32_BIT: u32 = 1 << 3;
const SETATTR_MODE_OR_OWNER: u32 = 0b111;

/// The bus of one device, which the caller of `run` may use at the same time.
pub(super) type SharedBus<'a> = Mutex<dyn EmulatedAdapter + Send + 'a>;

#[derive(Debug, PartialEq, Eq)]
pub(super) enum Reply {
    Bytes(Vec<u8>),
    /// The kernel expects no answer.
    Nothing,
    /// The kernel speaks a protocol version that this server does not.
    Incompatible {
        major: u32,
        minor: u32,
    },
}

/// All open files of one mounted device.
pub(super) struct Session {
    mode: AdapterMode,
    /// The user and group that appear to own the device.
    owner: (u32, u32),
    files: HashMap<u64, OpenFile>,
    handle_next: u64,
}

impl Session {
    pub(super) fn new(mode: AdapterMode, owner: (u32, u32)) -> Self {
        Self {
            mode,
            owner,
            files: HashMap::new(),
            handle_next: 1,
        }
    }

    /// Answers one request; `memory_of` finds a caller's memory by its process number.
    pub(super) fn answer<M: CallerMemory>(
        &mut self,
        request: &[u8],
        memory_of: impl FnOnce(u32, PointerWidth) -> M,
        adapter: &SharedBus<'_>,
    ) -> Reply {
        let Some(request) = Request::parse(request) else {
            return Reply::Nothing;
        };
        if matches!(request.opcode, opcode::FORGET | opcode::BATCH_FORGET) {
            return Reply::Nothing;
        }
        match (request.opcode, request.body.u32(0), request.body.u32(4)) {
            (opcode::INIT, Ok(major), Ok(minor)) if major != wire::MAJOR || minor < wire::MINOR => {
                return Reply::Incompatible { major, minor };
            }
            _ => {}
        }
        let outcome = self.outcome(&request, memory_of, adapter);
        Reply::Bytes(wire::answer(request.unique, outcome))
    }

    fn outcome<M: CallerMemory>(
        &mut self,
        request: &Request<'_>,
        memory_of: impl FnOnce(u32, PointerWidth) -> M,
        adapter: &SharedBus<'_>,
    ) -> Result<Vec<u8>, Errno> {
        let body = request.body;
        match request.opcode {
            opcode::INIT => Ok(wire::init(body.u32(8)?)),
            // A file has no entries.
            opcode::LOOKUP => Err(Errno::NOENT),
            // Ignores truncation, like a character device.
            opcode::SETATTR if body.u32(0)? & SETATTR_MODE_OR_OWNER != 0 => Err(Errno::PERM),
            opcode::GETATTR | opcode::SETATTR => Ok(wire::attributes(self.owner.0, self.owner.1)),
            opcode::OPEN => self.open().map(wire::opened),
            opcode::RELEASE => {
                self.files.remove(&body.u64(0)?);
                Ok(Vec::new())
            }
            opcode::FLUSH | opcode::ACCESS | opcode::DESTROY => Ok(Vec::new()),
            opcode::STATFS => Ok(wire::statistics()),
            opcode::READ => {
                let mut buffer = vec![0; body.length()?.min(MESSAGE_BYTES_MAX)];
                let file = self.file(body.u64(0)?)?;
                let arrived = file.read(&mut buffer, &mut *lock(adapter))?;
                buffer.truncate(arrived);
                Ok(buffer)
            }
            opcode::WRITE => {
                let bytes = body.written()?;
                let file = self.file(body.u64(0)?)?;
                file.write(bytes, &mut *lock(adapter)).map(wire::written)
            }
            opcode::IOCTL => {
                let (request_number, argument) = (body.u32(12)?, body.u64(16)?);
                let width = match body.u32(8)? & IOCTL_FROM_32_BIT {
                    0 => PointerWidth::Bits64,
                    _ => PointerWidth::Bits32,
                };
                let file = self.file(body.u64(0)?)?;
                let memory = &mut memory_of(request.pid, width);
                let done = file.ioctl(request_number, argument, memory, &mut *lock(adapter));
                done.map(wire::ioctl_done)
            }
            _ => Err(Errno::NOSYS),
        }
    }

    pub(super) fn opens(&self) -> u64 {
        self.handle_next - 1
    }

    fn open(&mut self) -> Result<u64, Errno> {
        if self.files.len() >= OPEN_FILES_MAX {
            return Err(Errno::NFILE);
        }
        let handle = self.handle_next;
        self.handle_next += 1;
        self.files.insert(handle, OpenFile::new(self.mode));
        Ok(handle)
    }

    fn file(&mut self, handle: u64) -> Result<&mut OpenFile, Errno> {
        self.files.get_mut(&handle).ok_or(Errno::INVAL)
    }
}

#[cfg(test)]
mod tests;
