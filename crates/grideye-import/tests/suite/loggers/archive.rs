//! Bytes of containers: numpy's arrays, zip, gzip and Parquet.

use flate2::write::{DeflateEncoder, GzEncoder};
use flate2::{Compression, Crc};
use parquet::data_type::{DoubleType, Int64Type};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use std::io::Write;
use std::sync::Arc;

/// An array as `numpy.save` writes it: `<f4`, `(12, 8, 8)`.
pub(crate) fn npy(kind: &str, shape: &str, numbers: &[u8]) -> Vec<u8> {
    let heading = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    let padded = format!("{heading:117}\n");
    [b"\x93NUMPY\x01\x00\x76\x00", padded.as_bytes(), numbers].concat()
}

/// An archive of such files, compressed or as they are.
pub(crate) fn zip(files: &[(&str, Vec<u8>)], is_compressed: bool) -> Vec<u8> {
    let (mut archive, mut directory) = (Vec::new(), Vec::new());
    let size = |bytes: &[u8]| u32::try_from(bytes.len()).unwrap().to_le_bytes();
    for (name, bytes) in files {
        let mut crc = Crc::new();
        crc.update(bytes);
        let mut encoder = DeflateEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(bytes).unwrap();
        let (method, packed): (u8, Vec<u8>) = match is_compressed {
            true => (8, encoder.finish().unwrap()),
            false => (0, bytes.clone()),
        };
        let name_size = u16::try_from(name.len()).unwrap().to_le_bytes();
        // The version, flags, method, a time and a day, the sums and sizes, and the sizes of the name and of no more.
        let facts = [
            &[20, 0, 0, 0, method, 0, 0, 0, 0x21, 0x5A][..],
            &crc.sum().to_le_bytes(),
            &size(&packed),
            &size(bytes),
            &name_size,
            &[0, 0],
        ]
        .concat();
        let place = size(&archive);
        archive.extend([b"PK\x03\x04", &facts[..], name.as_bytes(), &packed].concat());
        let place = [&[0; 10][..], &place].concat();
        directory.extend([b"PK\x01\x02\x14\x00", &facts[..], &place, name.as_bytes()].concat());
    }
    let count = u16::try_from(files.len()).unwrap().to_le_bytes();
    let end = [
        &b"PK\x05\x06\x00\x00\x00\x00"[..],
        &count,
        &count,
        &size(&directory),
        &size(&archive),
        &[0, 0],
    ]
    .concat();
    [archive, directory, end].concat()
}

pub(crate) fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// A Parquet file of whole numbers in the first column, and numbers in the others.
pub(crate) fn parquet(whole: (&str, &[i64]), others: &[(String, Vec<f64>)]) -> Vec<u8> {
    let others_named = others
        .iter()
        .map(|(name, _)| format!("required double {name};"));
    let fields: String = others_named.collect();
    let schema = format!("message walk {{ required int64 {}; {fields} }}", whole.0);
    let schema = Arc::new(parse_message_type(&schema).unwrap());
    let mut file = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut file, schema, Arc::default()).unwrap();
    let mut group = writer.next_row_group().unwrap();
    let mut column = group.next_column().unwrap().unwrap();
    let first = column.typed::<Int64Type>();
    first.write_batch(whole.1, None, None).unwrap();
    column.close().unwrap();
    for (_, values) in others {
        let mut column = group.next_column().unwrap().unwrap();
        let numbers = column.typed::<DoubleType>();
        numbers.write_batch(values, None, None).unwrap();
        column.close().unwrap();
    }
    group.close().unwrap();
    writer.close().unwrap();
    file
}
