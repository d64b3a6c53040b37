//! Apache Parquet: columns of equal length in row groups. Uncompressed, so that the format's core suffices to read a
//! file, and equal columns give equal bytes.
//!
//! | values | type in the file |
//! |---|---|
//! | [`Values::Unsigned`] | `INT64`, unsigned |
//! | [`Values::Signed`] | `INT64`, null without a value |
//! | [`Values::Double`] | `DOUBLE`, null without a value |
//! | [`Values::Flag`] | `BOOLEAN` |
//! | [`Values::Text`] | `BYTE_ARRAY (STRING)` |
//! | [`Values::MaybeText`] | `BYTE_ARRAY (STRING)`, null without a value |
//! | [`Values::Singles`] | `LIST` of `FLOAT`, or `LIST` of such for each further axis, of one shape in all rows |

use crate::error::ExportError;
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{
    BoolType, ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int64Type,
};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{WriterProperties, WriterVersion};
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::{ColumnPath, Type};
use std::io::Write;
use std::sync::Arc;

pub(crate) struct Column {
    name: String,
    values: Values,
}

/// A column's values, one per row.
pub(crate) enum Values {
    Unsigned(Vec<u64>),
    Signed(Vec<Option<i64>>),
    Double(Vec<Option<f64>>),
    Flag(Vec<bool>),
    Text(Vec<String>),
    MaybeText(Vec<Option<String>>),
    /// An array of this shape for each row, in C order.
    Singles {
        axes: Vec<usize>,
        values: Vec<f32>,
    },
}

/// A file that receives row groups.
pub(crate) struct Table<W: Write + Send> {
    writer: SerializedFileWriter<W>,
}

impl<W: Write + Send> Table<W> {
    /// A table with the names and types of `columns` (not their values), and `about` as metadata.
    pub(crate) fn new(
        columns: &[Column],
        about: &[(&str, String)],
        out: W,
    ) -> Result<Self, ExportError> {
        let fields = columns.iter().map(field).collect::<Result<Vec<_>, _>>()?;
        let schema = Type::group_type_builder("rows")
            .with_fields(fields)
            .build()?;
        let about = about
            .iter()
            .map(|(key, value)| KeyValue::new((*key).to_owned(), value.clone()))
            .collect();
        let mut properties = WriterProperties::builder()
            .set_writer_version(WriterVersion::PARQUET_1_0)
            .set_key_value_metadata(Some(about));
        for column in columns.iter().filter(|column| column.is_ever_new()) {
            properties = properties.set_column_dictionary_enabled(column.path(), false);
        }
        let properties = Arc::new(properties.build());
        let writer = SerializedFileWriter::new(out, Arc::new(schema), properties)?;
        Ok(Self { writer })
    }

    pub(crate) fn add(&mut self, columns: &[Column]) -> Result<(), ExportError> {
        let mut group = self.writer.next_row_group()?;
        for column in columns {
            let missing =
                || ParquetError::General(format!("no place for the column {}", column.name));
            let mut open = group.next_column()?.ok_or_else(missing)?;
            column.values.put(&mut open)?;
            open.close()?;
        }
        group.close()?;
        Ok(())
    }

    pub(crate) fn finish(self) -> Result<(), ExportError> {
        self.writer.close()?;
        Ok(())
    }
}

impl Column {
    pub(crate) fn new(name: impl Into<String>, values: Values) -> Self {
        Self {
            name: name.into(),
            values,
        }
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Its type as the library `datasets` of Hugging Face names it.
    pub(crate) fn feature(&self) -> serde_json::Value {
        match &self.values {
            Values::Unsigned(_) => "uint64".into(),
            Values::Signed(_) => "int64".into(),
            Values::Double(_) => "float64".into(),
            Values::Flag(_) => "bool".into(),
            Values::Text(_) | Values::MaybeText(_) => "string".into(),
            Values::Singles { axes, .. } => {
                let array = serde_json::json!({"shape": axes, "dtype": "float32"});
                let mut feature = serde_json::Map::new();
                feature.insert(format!("array{}_d", axes.len()), array);
                feature.into()
            }
        }
    }

    /// Whether few values repeat, so that a dictionary would only cost space. Masks are mostly 0, so they repeat.
    fn is_ever_new(&self) -> bool {
        match &self.values {
            Values::Singles { values, .. } => {
                let zeros = values.iter().filter(|value| **value == 0.0).count();
                zeros * 2 < values.len()
            }
            _ => false,
        }
    }

    fn path(&self) -> ColumnPath {
        let mut path = vec![self.name.clone()];
        if let Values::Singles { axes, .. } = &self.values {
            let levels = axes.iter().flat_map(|_| ["list".into(), "element".into()]);
            path.extend(levels);
        }
        ColumnPath::new(path)
    }
}

fn field(column: &Column) -> Result<Arc<Type>, ExportError> {
    let name = column.name.as_str();
    let (required, optional) = (Repetition::REQUIRED, Repetition::OPTIONAL);
    let integer = |is_signed| Some(LogicalType::integer(64, is_signed));
    let (physical, repetition, logical) = match &column.values {
        Values::Unsigned(_) => (Physical::INT64, required, integer(false)),
        Values::Signed(_) => (Physical::INT64, optional, integer(true)),
        Values::Double(_) => (Physical::DOUBLE, optional, None),
        Values::Flag(_) => (Physical::BOOLEAN, required, None),
        Values::Text(_) => (Physical::BYTE_ARRAY, required, Some(LogicalType::String)),
        Values::MaybeText(_) => (Physical::BYTE_ARRAY, optional, Some(LogicalType::String)),
        Values::Singles { axes, .. } => return lists(name, axes.len()),
    };
    let field = Type::primitive_type_builder(name, physical)
        .with_repetition(repetition)
        .with_logical_type(logical);
    Ok(Arc::new(field.build()?))
}

/// Numbers in lists in lists, each with three levels, as LogicalTypes.md specifies.
fn lists(name: &str, depth: usize) -> Result<Arc<Type>, ExportError> {
    let element = match depth {
        0 | 1 => Arc::new(
            Type::primitive_type_builder("element", Physical::FLOAT)
                .with_repetition(Repetition::REQUIRED)
                .build()?,
        ),
        _ => lists("element", depth - 1)?,
    };
    let repeated = Type::group_type_builder("list")
        .with_repetition(Repetition::REPEATED)
        .with_fields(vec![element])
        .build()?;
    let list = Type::group_type_builder(name)
        .with_repetition(Repetition::REQUIRED)
        .with_logical_type(Some(LogicalType::List))
        .with_fields(vec![Arc::new(repeated)])
        .build()?;
    Ok(Arc::new(list))
}

impl Values {
    fn put(&self, column: &mut SerializedColumnWriter<'_>) -> Result<(), ExportError> {
        match self {
            Self::Unsigned(values) => {
                let bits = |value: &u64| i64::from_ne_bytes(value.to_ne_bytes());
                let bits: Vec<i64> = values.iter().map(bits).collect();
                batch::<Int64Type>(column, &bits, None, None)
            }
            Self::Flag(values) => batch::<BoolType>(column, values, None, None),
            Self::Signed(values) => {
                let there: Vec<i64> = values.iter().copied().flatten().collect();
                batch::<Int64Type>(column, &there, Some(&levels(values)), None)
            }
            Self::Double(values) => {
                let there: Vec<f64> = values.iter().copied().flatten().collect();
                batch::<DoubleType>(column, &there, Some(&levels(values)), None)
            }
            Self::MaybeText(values) => {
                let there = values.iter().flatten();
                let bytes: Vec<ByteArray> = there.map(|text| text.as_str().into()).collect();
                batch::<ByteArrayType>(column, &bytes, Some(&levels(values)), None)
            }
            Self::Text(values) => {
                let bytes: Vec<ByteArray> =
                    values.iter().map(|text| text.as_str().into()).collect();
                batch::<ByteArrayType>(column, &bytes, None, None)
            }
            Self::Singles { axes, values } => {
                let sizes = (0..axes.len()).map(|axis| axes[axis..].iter().product());
                let sizes: Vec<usize> = sizes.collect();
                // How many lists around a value go on; those within them begin there.
                let begin = |index: usize| sizes.iter().filter(|size| index % **size != 0).count();
                let level = |count: usize| i16::try_from(count).unwrap_or(i16::MAX);
                let there = vec![level(axes.len()); values.len()];
                let begins = (0..values.len()).map(|index| level(begin(index)));
                let begins: Vec<i16> = begins.collect();
                batch::<FloatType>(column, values, Some(&there), Some(&begins))
            }
        }
    }
}

/// 1 for a value, 0 for none.
fn levels<T>(values: &[Option<T>]) -> Vec<i16> {
    let is_there = values.iter().map(Option::is_some);
    is_there.map(i16::from).collect()
}

fn batch<T: DataType>(
    column: &mut SerializedColumnWriter<'_>,
    values: &[T::T],
    definitions: Option<&[i16]>,
    repetitions: Option<&[i16]>,
) -> Result<(), ExportError> {
    let typed = column.typed::<T>();
    typed.write_batch(values, definitions, repetitions)?;
    Ok(())
}
