//! Reads the `[[calibrated]]` tables.

use super::reader::Read;
use crate::model::Calibrated;
use grideye_text::{Table, Value};
use std::ops::Range;

pub(crate) fn calibrated(table: &Table<'_>) -> Read<Calibrated> {
    let keys = table.each("keys").filter_map(|key| key.text());
    let keys: Vec<String> = keys.map(str::to_owned).collect();
    let marks = table.text("frames").unwrap_or_default().split_whitespace();
    let marks = marks.map(|mark| {
        (mark.len() == 8 && !mark.starts_with('+')).then(|| u32::from_str_radix(mark, 16).ok())?
    });
    let frames: Vec<u32> = marks.collect::<Option<_>>().unwrap_or_default();
    if let Some(given) = table.get("frames").filter(|_| frames.is_empty()) {
        return Err(given.wrong().into());
    }
    let sd = || table.get("sd").into_iter().flat_map(Value::named);
    if let Some((key, sd)) = sd().find(|(key, _)| !keys.iter().any(|known| known == key)) {
        return Err(sd.refused(&format!("one of `keys`, not `{key}`")).into());
    }
    let values = ["keys", "every_s", "frames"].into_iter();
    let values = values.filter_map(|key| table.get(key));
    let spans: Vec<Range<usize>> = values
        .chain(sd().map(|(_, sd)| sd))
        .map(|value| value.span())
        .collect();
    Ok(Calibrated {
        lines: lines(table.source.text, &spans),
        keys,
        sd: sd()
            .filter_map(|(key, sd)| Some((key.to_owned(), sd.number()?)))
            .collect(),
        every_s: table.number("every_s").unwrap_or_default(),
        frames,
    })
}

fn lines(text: &str, spans: &[Range<usize>]) -> Range<usize> {
    let first = spans.iter().map(|span| span.start).min().unwrap_or(0);
    let last = spans.iter().map(|span| span.end).max().unwrap_or(0);
    let Some(start) = text[..first].rfind("\n[[calibrated]]") else {
        return first..first;
    };
    let end = text[last..]
        .find('\n')
        .map_or(text.len(), |end| last + end + 1);
    start + 1..end
}
