//! Apache Parquet, with the compressions of pandas (snappy) and polars (zstd).

use crate::cell::{Cell, Field, RawRow};
use crate::error::ImportError;
use crate::source::Held;
use bytes::Bytes;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record;

pub(crate) const MAGIC: &[u8] = b"PAR1";
const HINT: &str = "a Parquet file has its directory at its end: copy the file again, whole";

pub(crate) fn rows(bytes: Vec<u8>) -> Result<Held, ImportError> {
    let wrong = |error: parquet::errors::ParquetError| ImportError::Container {
        expected: "a whole Parquet file".to_owned(),
        found: error.to_string(),
        hint: HINT,
    };
    let reader = SerializedFileReader::new(Bytes::from(bytes)).map_err(wrong)?;
    let (mut names, mut rows, mut broken) = (Vec::new(), Vec::new(), None);
    for (row, number) in reader.get_row_iter(None).map_err(wrong)?.zip(1_u64..) {
        let row = match row {
            Ok(row) => row,
            Err(error) => {
                broken = Some(ImportError::broken(
                    format!("row {number}"),
                    error.to_string(),
                ));
                break;
            }
        };
        if names.is_empty() {
            names = row
                .get_column_iter()
                .map(|(name, _)| name.clone())
                .collect();
        }
        let fields = row.get_column_iter().map(|(_, field)| field_of(field));
        rows.push(RawRow {
            number,
            fields: fields.collect(),
            is_whole: true,
            is_torn: false,
        });
    }
    Ok(Held {
        container: "Parquet".to_owned(),
        names,
        rows: rows.into_iter(),
        broken,
        skipped: 0,
    })
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
