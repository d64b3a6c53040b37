//! A scene without what no draw needs, because each draw is read again.

/// The text with blanks in place of comments and of tables of what varies, because each draw is read again. All else stays in
/// its place.
pub(crate) fn bare(text: &str) -> String {
    let mut is_vary = false;
    let lines = text.split_inclusive('\n').map(|line| {
        let begins = line.trim_start();
        if begins.starts_with('[') {
            is_vary = begins.starts_with("[[vary]]");
        }
        match is_vary || begins.starts_with('#') {
            true => line
                .chars()
                .flat_map(|letter| match letter {
                    '\n' => "\n".chars(),
                    _ => "    "[..letter.len_utf8()].chars(),
                })
                .collect(),
            false => line.to_owned(),
        }
    });
    let bare: String = lines.collect();
    let tables = |text: &str| {
        let mut tables = text.parse::<toml::Table>().ok()?;
        let vary = tables.remove("vary");
        Some((tables, vary.is_some()))
    };
    // A text in several lines may look like either.
    match (tables(text), tables(&bare)) {
        (Some((with, true)), Some((without, false))) if with == without => bare,
        _ => text.to_owned(),
    }
}
