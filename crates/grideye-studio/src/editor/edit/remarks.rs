//! Decides which comments between two tables belong to which.

/// The length of the part that belongs to the table above: the comments directly below its last value, if an empty line
/// or the end of the text follows.
pub(super) fn below(between: &str, is_end: bool) -> usize {
    let mut end = 0;
    for line in between.split_inclusive('\n') {
        if line.trim().is_empty() {
            return end;
        }
        end += line.len();
    }
    if is_end { end } else { 0 }
}

/// Where the comments of the table below start: those directly above its header, if an empty line separates them from
/// the text before. Comments at the start of the file are about the whole file, and those directly below a value may be
/// about that value.
pub(super) fn above(between: &str) -> usize {
    let header = between.rfind('\n').map_or(0, |end| end + 1);
    let mut start = header;
    let lines = between.get(..header).unwrap_or_default();
    for line in lines.split_inclusive('\n').rev() {
        if line.trim().is_empty() {
            return start;
        }
        start -= line.len();
    }
    header
}

/// The text without its leading empty lines.
pub(super) fn behind_empty_lines(text: &str) -> &str {
    let lines = text.split_inclusive('\n');
    let empty: usize = lines
        .take_while(|line| line.ends_with('\n') && line.trim().is_empty())
        .map(str::len)
        .sum();
    text.get(empty..).unwrap_or_default()
}
