//! Reads the `[[calibrated]]` tables.

use super::document::CalibratedTable;
use super::reader::{Read, Reader};
use super::rule::{EVERY, SD};
use crate::model::Calibrated;
use std::ops::Range;
use toml::Spanned;

pub(crate) fn calibrated(
    reader: &Reader<'_>,
    tables: &[Spanned<CalibratedTable>],
) -> Read<Vec<Calibrated>> {
    let tables = tables.iter().map(Spanned::get_ref);
    tables.map(|table| one(reader, table)).collect()
}

fn one(reader: &Reader<'_>, table: &CalibratedTable) -> Read<Calibrated> {
    let marks = table.frames.get_ref().split_whitespace();
    let marks = marks.map(|mark| {
        (mark.len() == 8 && !mark.starts_with('+')).then(|| u32::from_str_radix(mark, 16).ok())?
    });
    let frames: Vec<u32> = marks.collect::<Option<_>>().unwrap_or_default();
    if frames.is_empty() {
        let expected = "marks of 8 hexadecimal digits, separated by spaces or new lines";
        let refusal = reader.refused("frames", table.frames.span(), expected, EVERY.hint);
        return Err(refusal.into());
    }
    let keys = table.keys.get_ref();
    let sd = table.sd.iter().map(|(key, sd)| {
        if !keys.contains(key) {
            let expected = format!("one of `keys`, not `{key}`");
            return Err(reader
                .refused("sd", sd.span(), &expected, EVERY.hint)
                .into());
        }
        Ok((key.clone(), reader.number(sd, &SD)?))
    });
    Ok(Calibrated {
        keys: keys.clone(),
        sd: sd.collect::<Read<_>>()?,
        every_s: reader.number(&table.every_s, &EVERY)?,
        frames,
        lines: lines(reader.text, table),
    })
}

fn lines(text: &str, table: &CalibratedTable) -> Range<usize> {
    let values = [table.keys.span(), table.every_s.span(), table.frames.span()];
    let values = values
        .into_iter()
        .chain(table.sd.values().map(Spanned::span));
    let first = values.clone().map(|span| span.start).min().unwrap_or(0);
    let last = values.map(|span| span.end).max().unwrap_or(0);
    let Some(start) = text[..first].rfind("\n[[calibrated]]") else {
        return first..first;
    };
    let end = text[last..]
        .find('\n')
        .map_or(text.len(), |end| last + end + 1);
    start + 1..end
}
