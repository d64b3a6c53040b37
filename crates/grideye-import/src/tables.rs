//! Apache Parquet, with the compressions of pandas (snappy) and polars (zstd).

use crate::allowance::{Allowance, ROW_VALUES_MAX, VALUE_BYTES, too_wide};
use crate::cell::{Cell, Field, RawRow};
use crate::error::ImportError;
use crate::source::Made;
use bytes::{Bytes, buf};
use parquet::errors::{ParquetError, Result as Parquet};
use parquet::file::reader::{ChunkReader, FileReader, Length, SerializedFileReader};
use parquet::record::{self, reader::RowIter};

pub(crate) const MAGIC: &[u8] = b"PAR1";
const HINT: &str = "a Parquet file has its directory at its end: copy the file again, whole";

/// The rows, each read when it is asked for.
pub(crate) fn rows(bytes: Vec<u8>, allowance: &Allowance) -> Result<Made, ImportError> {
    let wrong = |error: ParquetError| match allowance.take(0) {
        Ok(()) => ImportError::unlike("a whole Parquet file", error, HINT),
        Err(error) => ImportError::unread("its pages", &error),
    };
    let bytes = Pages {
        bytes: Bytes::from(bytes),
        allowance: allowance.clone(),
    };
    let reader = SerializedFileReader::new(bytes).map_err(wrong)?;
    let schema = reader.metadata().file_metadata().schema_descr();
    if schema.num_columns() > ROW_VALUES_MAX {
        return Err(too_wide(schema.num_columns(), "in its schema"));
    }
    let names = schema.root_schema().get_fields().iter();
    let names = names.map(|field| field.name().to_owned()).collect();
    let rows = RowIter::from_file_into(Box::new(reader));
    let allowance = allowance.clone();
    let row = move |(row, number): (Parquet<record::Row>, u64)| {
        let place = || format!("row {number}");
        let row = row.map_err(|error| match allowance.take(0) {
            Ok(()) => ImportError::broken(place(), error.to_string()),
            Err(error) => ImportError::unread(place(), &error),
        })?;
        let fields = row.get_column_iter().map(|(_, field)| field_of(field));
        let row = RawRow {
            number,
            fields: fields.collect(),
            is_whole: true,
            is_torn: false,
        };
        allowance.take_values(row.text_bytes(), 1, place)?;
        Ok(row)
    };
    Ok(Made {
        container: "Parquet".to_owned(),
        names,
        rows: Box::new(rows.zip(1_u64..).map(row)),
        skipped: 0,
    })
}

/// The file, of which each page is counted before it is unpacked.
struct Pages {
    bytes: Bytes,
    allowance: Allowance,
}

impl Length for Pages {
    fn len(&self) -> u64 {
        Length::len(&self.bytes)
    }
}

impl ChunkReader for Pages {
    type T = buf::Reader<Bytes>;

    fn get_read(&self, start: u64) -> Parquet<Self::T> {
        let read = self.bytes.get_read(start)?;
        if let Some((bytes, values)) = page(read.get_ref()) {
            let bytes = bytes.saturating_add(VALUE_BYTES.saturating_mul(values));
            self.allowance.take(bytes)?;
        }
        Ok(read)
    }

    fn get_bytes(&self, start: u64, length: usize) -> Parquet<Bytes> {
        self.bytes.get_bytes(start, length)
    }
}

/// The bytes that a page becomes, and its values, by its heading (`PageHeader` of parquet-format, in Thrift's compact protocol:
/// its kind, both lengths, maybe a checksum, and the heading of its kind, which begins with the number of values).
fn page(mut heading: &[u8]) -> Option<(u64, u64)> {
    integer(&mut heading)?;
    let bytes = integer(&mut heading)?;
    integer(&mut heading)?;
    if heading.first()? & 0x0f == INTEGER {
        integer(&mut heading)?;
    }
    let (inner, mut heading) = heading.split_first()?;
    (inner & 0x0f == STRUCT).then_some((bytes, integer(&mut heading)?))
}

/// The kinds of two fields.
const INTEGER: u8 = 5;
const STRUCT: u8 = 12;

fn integer(heading: &mut &[u8]) -> Option<u64> {
    let (field, rest) = heading.split_first()?;
    let bytes = rest.iter().position(|byte| byte & 0x80 == 0)? + 1;
    let (number, rest) = rest.split_at(bytes);
    *heading = rest;
    let number = number
        .iter()
        .rev()
        .fold(0_u64, |number, byte| number << 7 | u64::from(byte & 0x7f));
    // Zigzag, in which no length is negative.
    (field & 0x0f == INTEGER && bytes <= 5).then_some(number / 2)
}

fn field_of(field: &record::Field) -> Field {
    match field {
        record::Field::ListInternal(_) | record::Field::Group(_) => {
            let mut cells = Vec::new();
            gather(field, &mut cells);
            Field::Many(cells)
        }
        one => Field::One(cell(one)),
    }
}

fn gather(field: &record::Field, cells: &mut Vec<Cell>) {
    match field {
        record::Field::ListInternal(list) => {
            list.elements().iter().for_each(|one| gather(one, cells));
        }
        record::Field::Group(group) => {
            group
                .get_column_iter()
                .for_each(|(_, one)| gather(one, cells));
        }
        one => cells.push(cell(one)),
    }
}

fn cell(field: &record::Field) -> Cell {
    match field {
        record::Field::Null => Cell::Empty,
        record::Field::Byte(value) => Cell::Integer((*value).into()),
        record::Field::Short(value) => Cell::Integer((*value).into()),
        record::Field::Int(value) => Cell::Integer((*value).into()),
        record::Field::Long(value) => Cell::Integer(*value),
        record::Field::UByte(value) => Cell::Integer((*value).into()),
        record::Field::UShort(value) => Cell::Integer((*value).into()),
        record::Field::UInt(value) => Cell::Integer((*value).into()),
        record::Field::ULong(value) => Cell::Integer(i64::try_from(*value).unwrap_or(i64::MAX)),
        record::Field::Float(value) => Cell::Number((*value).into()),
        record::Field::Double(value) => Cell::Number(*value),
        record::Field::TimestampMillis(value) => Cell::Integer(value.saturating_mul(1_000_000)),
        record::Field::TimestampMicros(value) => Cell::Integer(value.saturating_mul(1_000)),
        record::Field::Str(text) => Cell::of_text(text),
        other => Cell::of_text(other.to_string().trim_matches('"')),
    }
}
