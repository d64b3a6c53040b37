//! Which remarks are whose, in what stands between the last value of one table and the header of the next.

/// How much of the beginning belongs to the table before: the remarks directly below its last value, if an empty line or
/// the text's end divides them from what comes.
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

/// Where the remarks begin that belong to the table behind: those directly above its header, if an empty line divides them
/// from what is before. Those that begin the file speak of all of it, and those directly below a value may speak of that.
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

/// The text without the empty lines that begin it.
pub(super) fn behind_empty_lines(text: &str) -> &str {
    let lines = text.split_inclusive('\n');
    let empty: usize = lines
        .take_while(|line| line.ends_with('\n') && line.trim().is_empty())
        .map(str::len)
        .sum();
    text.get(empty..).unwrap_or_default()
}
