//! Operations of embedded-hal as messages: neighbours of one direction are one.

use embedded_hal::i2c::Operation;

use crate::adapter::is_read;

/// One message of a transaction: neighbouring operations of one direction.
pub(super) enum Joined {
    Read(Vec<u8>),
    Write(Vec<u8>),
}

pub(super) fn join(operations: &[Operation<'_>]) -> Vec<Joined> {
    let mut joined: Vec<Joined> = Vec::new();
    for operation in operations {
        match (operation, joined.last_mut()) {
            (Operation::Read(buffer), Some(Joined::Read(before))) => {
                before.resize(before.len() + buffer.len(), 0);
            }
            (Operation::Write(bytes), Some(Joined::Write(before))) => {
                before.extend_from_slice(bytes);
            }
            (Operation::Read(buffer), _) => joined.push(Joined::Read(vec![0; buffer.len()])),
            (Operation::Write(bytes), _) => joined.push(Joined::Write(bytes.to_vec())),
        }
    }
    joined
}

/// Deals what the messages read out to the operations that they were joined from.
pub(super) fn deal_out(joined: &[Joined], operations: &mut [Operation<'_>]) {
    let mut rest = operations.iter_mut().peekable();
    for message in joined {
        let Joined::Read(read) = message else {
            while rest.next_if(|operation| !is_read(operation)).is_some() {}
            continue;
        };
        let mut cursor = read.as_slice();
        while let Some(operation) = rest.next_if(|operation| is_read(operation)) {
            if let Operation::Read(buffer) = operation {
                let (head, tail) = cursor.split_at_checked(buffer.len()).unwrap_or_default();
                if head.len() == buffer.len() {
                    buffer.copy_from_slice(head);
                }
                cursor = tail;
            }
        }
    }
}
