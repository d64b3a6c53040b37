//! The second phase of USB/IP: transfers one after another, until the client hangs up.

use super::device::Device;
use super::wire::{self, Command, HEADER_BYTES, Malformed, Submit};
use crate::adapter::EmulatedAdapter;
use crate::ioctl::Errno;
use std::io::{self, Read, Write};

/// Why a connection ended before the client hung up.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The client sent something that is not USB/IP.
    #[error(transparent)]
    Malformed(#[from] Malformed),
    /// The connection broke.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// Answers every transfer, in order, until the client hangs up between two of them.
pub(super) fn serve<A: EmulatedAdapter>(
    mut from: impl Read,
    mut to: impl Write,
    device: &mut Device<A>,
) -> Result<(), SessionError> {
    let mut header = [0; HEADER_BYTES];
    let mut sent = Vec::new();
    while read_or_end(&mut from, &mut header)? {
        let reply = match Command::parse(&header)? {
            // Transfers are answered in order, so a transfer to cancel was already answered.
            Command::Unlink { sequence } => wire::unlinked_too_late(sequence),
            Command::Submit(submit) => {
                sent.clear();
                if !submit.is_in {
                    sent.resize(submit.length, 0);
                    from.read_exact(&mut sent)?;
                }
                carry_out(device, &submit, &sent)
            }
        };
        to.write_all(&reply)?;
    }
    Ok(())
}

fn carry_out<A: EmulatedAdapter>(device: &mut Device<A>, submit: &Submit, sent: &[u8]) -> Vec<u8> {
    let setup = submit.setup;
    let agrees = submit.endpoint == 0
        && submit.length == usize::from(setup.length)
        && (submit.is_in == setup.is_in() || submit.length == 0);
    let outcome = if agrees {
        device.control(setup, sent)
    } else {
        Err(Errno::PIPE)
    };
    match outcome {
        Err(errno) => wire::submitted(submit.sequence, -errno.raw_os_error(), 0, &[]),
        Ok(answer) if submit.is_in => wire::submitted(submit.sequence, 0, answer.len(), &answer),
        Ok(_) => wire::submitted(submit.sequence, 0, sent.len(), &[]),
    }
}

/// Fills `header`; false if the stream ended before its first byte.
fn read_or_end(stream: &mut impl Read, header: &mut [u8]) -> io::Result<bool> {
    let arrived = loop {
        match stream.read(header) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            outcome => break outcome?,
        }
    };
    let rest = &mut header[arrived..];
    if arrived > 0 {
        stream.read_exact(rest)?;
    }
    Ok(arrived > 0)
}
