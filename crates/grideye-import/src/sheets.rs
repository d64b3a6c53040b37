//! Workbooks (`.xlsx`): a sheet is a text of cells separated by tabs, so that all layouts of texts are read.

use crate::allowance::{Allowance, HELD_VALUE_BYTES};
use crate::columns::Columns;
use crate::error::ImportError;
use crate::text::{Separator, TextRows};
use calamine::{DataRef, ExcelDateTime, ExcelDateTimeType, Reader, SheetType, Xlsx};
use core::fmt::Display;
use core::time::Duration;
use grideye_frame::PIXELS;
use std::io::{Cursor, ErrorKind, Read as _};
use zip::ZipArchive;

/// Columns of a sheet; those of the largest sensor here are 1,024.
const COLUMNS_MAX: u32 = 2_048;
/// Twice as long as the longest that programs write: links of 2,083 characters, in the place and in the text.
const TAG_BYTES_MAX: usize = 8_192;
/// As many as Excel has.
const ROWS_MAX: u32 = 1_048_576;
/// Sheets named in an error.
const NAMED_MAX: usize = 8;
/// As many sheets may have the largest part, before each is counted as it.
const SHEETS_SHARE: usize = 8;
const HINT: &str =
    "save it in Excel or LibreOffice as .xlsx without a password, or the sheet as CSV";
/// Days between the two epochs of Excel.
const DAYS_TO_1904: f64 = 1_462.0;
const SECONDS_PER_DAY: u64 = 86_400;

/// The rows of the sheet with frames, or of the one that is asked for.
pub(crate) fn rows(
    bytes: Vec<u8>,
    said: &Columns,
    allowance: &Allowance,
) -> Result<TextRows<Cursor<String>>, ImportError> {
    let largest = unpacked(&bytes, allowance)?;
    let mut book = Xlsx::new(Cursor::new(bytes)).map_err(|error| wrong(&error))?;
    let sheets = book.sheets_metadata().iter();
    let sheets = sheets.filter(|sheet| sheet.typ == SheetType::WorkSheet);
    let names: Vec<String> = sheets.map(|sheet| sheet.name.clone()).collect();
    let asked = said
        .sheet
        .as_deref()
        .map(|asked| place_of(&names, asked))
        .transpose()?;
    let (mut found, mut without) = (Vec::new(), ImportError::no_frame(0, 0));
    for (place, name) in names.iter().enumerate() {
        if asked.is_some_and(|asked| asked != place) {
            continue;
        }
        // Many sheets may have one part.
        allowance.take_values(largest / SHEETS_SHARE, 1, || name.clone())?;
        let text = text_of(&mut book, name, allowance)?;
        match TextRows::separated(Cursor::new(text), Some(Separator::Tab), said) {
            Ok(rows) => found.push((place, rows)),
            Err(error) => without = error,
        }
    }
    if found.len() > 1 {
        return Err(several(found.iter().map(|(place, _)| *place), &names));
    }
    let (place, rows) = found.pop().ok_or(without)?;
    Ok(rows.called(format!("the sheet {} of a workbook", names[place])))
}

/// Unpacks all parts once, because the reader of workbooks believes what they say of themselves, and holds them; the bytes of the
/// largest one.
fn unpacked(book: &[u8], allowance: &Allowance) -> Result<usize, ImportError> {
    let mut archive = ZipArchive::new(Cursor::new(book)).map_err(|error| wrong(&error))?;
    let mut largest = 0;
    for index in 0..archive.len() {
        let part = archive.by_index(index).map_err(|error| wrong(&error))?;
        let name = part.name().to_owned();
        let mut bytes = Vec::new();
        let read = allowance.of_unpacked(part).read_to_end(&mut bytes);
        read.map_err(|error| match error.kind() {
            ErrorKind::FileTooLarge => ImportError::unread(&name, &error),
            _ => wrong(&error),
        })?;
        largest = largest.max(bytes.len());
        let xml = String::from_utf8_lossy(&bytes);
        // Of a tag the reader compares each attribute with all before it.
        let tags = xml.split('<').filter(|tag| !tag.starts_with(['!', '?']));
        let longest = tags.filter_map(|tag| tag.find('>')).max().unwrap_or(0);
        if longest > TAG_BYTES_MAX {
            return Err(wrong(&format!("a tag of {longest} bytes, in {name}")));
        }
        // As many texts the reader makes room for.
        for (at, key) in xml.match_indices("uniqueCount") {
            let value = xml[at + key.len()..].trim_start().trim_start_matches('=');
            let value = value.trim_start().get(1..).unwrap_or_default();
            let end = value.find(|digit: char| !digit.is_ascii_digit());
            let count = &value[..end.unwrap_or(0)];
            if !count.is_empty()
                && count
                    .parse()
                    .map_or(true, |count: usize| count > bytes.len())
            {
                return Err(wrong(&format!(
                    "{count} texts that are not there, in {name}"
                )));
            }
        }
    }
    Ok(largest)
}

fn several(places: impl ExactSizeIterator<Item = usize>, names: &[String]) -> ImportError {
    let what = format!("{} sheets of the workbook have frames", places.len());
    let choices: Vec<String> = places
        .take(NAMED_MAX)
        .map(|place| format!("--columns sheet={} ({})", place + 1, names[place]))
        .collect();
    ImportError::refused(what, format!("choose one: {}", choices.join(", ")))
}

/// By its name, or by its number from 1.
fn place_of(names: &[String], asked: &str) -> Result<usize, ImportError> {
    let named = names.iter().position(|name| name == asked);
    let numbered = || asked.parse::<usize>().ok()?.checked_sub(1);
    let found = named.or_else(numbered).filter(|place| *place < names.len());
    found.ok_or_else(|| {
        let known = names[..names.len().min(NAMED_MAX)].join(", ");
        let what = format!("there is no sheet {asked}");
        ImportError::refused(what, format!("the workbook has {known}"))
    })
}

type Book = Xlsx<Cursor<Vec<u8>>>;

/// Each row of the sheet in its own line.
fn text_of(book: &mut Book, name: &str, allowance: &Allowance) -> Result<String, ImportError> {
    let is_1904 = book.has_1904_epoch();
    let cells = book.worksheet_cells_reader(name);
    let mut cells = cells.map_err(|error| wrong(&error))?;
    let mut rows = Vec::<Vec<String>>::new();
    while let Some(cell) = cells.next_cell().map_err(|error| wrong(&error))? {
        let (row_number, column) = cell.get_position();
        let text = text(cell.get_value(), is_1904);
        let (Ok(row), Ok(place), true) = (
            usize::try_from(row_number),
            usize::try_from(column),
            column < COLUMNS_MAX && row_number < ROWS_MAX,
        ) else {
            let expected = format!("at most {COLUMNS_MAX} columns and {ROWS_MAX} rows");
            let found = format!("a larger one, {name}");
            return Err(ImportError::unlike(&expected, found, HINT));
        };
        if text.is_empty() {
            continue;
        }
        let empty_rows = (row + 1).saturating_sub(rows.len());
        rows.resize_with(rows.len().max(row + 1), Vec::new);
        let fields = &mut rows[row];
        // Cells that the file leaves out are there too.
        let values = empty_rows + (place + 1).saturating_sub(fields.len());
        let cell = || format!("{name}, row {}", row + 1);
        allowance.take_values(values, HELD_VALUE_BYTES, cell)?;
        allowance.take_values(text.len(), 1, cell)?;
        fields.resize(fields.len().max(place + 1), String::new());
        fields[place] = text;
    }
    Ok(joined(rows))
}

/// Empty cells at the end of a row are not in the file.
fn joined(rows: Vec<Vec<String>>) -> String {
    let is_frame = |row: &Vec<String>| row.iter().filter(|text| !text.is_empty()).count() >= PIXELS;
    let width = rows.iter().filter(|row| is_frame(row)).map(Vec::len).max();
    let mut text = String::new();
    for mut row in rows {
        if row.len() > PIXELS / 2 {
            row.resize(row.len().max(width.unwrap_or(0)), String::new());
        }
        text += &row.join("\t");
        // A last field that is empty is ended by its separator.
        text += if row.last().is_some_and(String::is_empty) {
            "\t\n"
        } else {
            "\n"
        };
    }
    text
}

fn text(value: &DataRef<'_>, is_1904: bool) -> String {
    match value {
        DataRef::Int(value) => value.to_string(),
        DataRef::Float(value) => value.to_string(),
        DataRef::Bool(value) => u8::from(*value).to_string(),
        DataRef::String(text) | DataRef::DateTimeIso(text) | DataRef::DurationIso(text) => {
            in_one_line(text)
        }
        DataRef::SharedString(text) => in_one_line(text),
        DataRef::DateTime(time) => moment(time, is_1904).unwrap_or_default(),
        // As of a formula that failed.
        DataRef::Error(_) | DataRef::Empty => String::new(),
    }
}

fn in_one_line(text: &str) -> String {
    text.replace(['\t', '\n', '\r'], " ").replace('"', "'")
}

/// Days become a stamp, a day or a time of day, to the microsecond, which is what they hold; a length of time, seconds.
fn moment(time: &ExcelDateTime, is_1904: bool) -> Option<String> {
    let days = time.as_f64();
    let since = Duration::try_from_secs_f64(days * 86_400.0).ok()?;
    let since = since.checked_add(Duration::from_nanos(500))?;
    let (seconds, micros) = (since.as_secs(), since.subsec_micros());
    if time.is_duration() {
        return Some(format!("{seconds}.{micros:06}"));
    }
    let (day, second) = (seconds / SECONDS_PER_DAY, seconds % SECONDS_PER_DAY);
    let clock = format!(
        "{:02}:{:02}:{:02}.{micros:06}",
        second / 3600,
        second / 60 % 60,
        second % 60
    );
    if days < 1.0 && day == 0 {
        return Some(clock);
    }
    let day = f64::from(u32::try_from(day).ok()?) + if is_1904 { DAYS_TO_1904 } else { 0.0 };
    let day = ExcelDateTime::new(day, ExcelDateTimeType::DateTime, false);
    let (year, month, day, ..) = day.to_ymd_hms_milli();
    let day = format!("{year:04}-{month:02}-{day:02}");
    Some(match (second, micros) {
        (0, 0) => day,
        _ => format!("{day} {clock}"),
    })
}

fn wrong(error: &dyn Display) -> ImportError {
    ImportError::unlike("a whole workbook", error, HINT)
}
