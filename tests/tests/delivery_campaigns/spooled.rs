//! What stands in a spool's folder, read without the agent's code: the layout of its segments, and no checksums.

use std::collections::BTreeSet;
use std::path::Path;

/// The records in all segments, by run and number.
pub(crate) fn records(folder: &Path) -> BTreeSet<(String, u64)> {
    let mut records = BTreeSet::new();
    let Ok(entries) = std::fs::read_dir(folder) else {
        return records;
    };
    for entry in entries.flatten() {
        if entry.file_name().to_string_lossy().starts_with("segment-") {
            read_segment(
                &std::fs::read(entry.path()).unwrap_or_default(),
                &mut records,
            );
        }
    }
    records
}

/// A header of 24 bytes; then records, each a length of 4 bytes, a checksum of 4, and the payload.
fn read_segment(bytes: &[u8], records: &mut BTreeSet<(String, u64)>) {
    let mut boots = Vec::new();
    let mut rest = bytes.get(24..).unwrap_or_default();
    while let Some((prefix, behind)) = rest.split_at_checked(8) {
        let length = u32::from_le_bytes(prefix[..4].try_into().unwrap());
        let Some((payload, next)) = behind.split_at_checked(usize::try_from(length).unwrap())
        else {
            return;
        };
        match payload {
            // A stream: its index, then device, boot and sensor, each with its length.
            [1, _, _, names @ ..] => {
                let (device_length, names) = names.split_first().unwrap();
                let names = &names[usize::from(*device_length)..];
                let (boot_length, names) = names.split_first().unwrap();
                let boot = &names[..usize::from(*boot_length)];
                boots.push(String::from_utf8(boot.to_vec()).unwrap());
            }
            // A record: its stream's index, then its number.
            [2, low, high, fields @ ..] => {
                let stream = usize::from(u16::from_le_bytes([*low, *high]));
                let seq = u64::from_le_bytes(fields[..8].try_into().unwrap());
                records.insert((boots[stream].clone(), seq));
            }
            _ => {}
        }
        rest = next;
    }
}
