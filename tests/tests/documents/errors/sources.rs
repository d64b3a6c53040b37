//! The hints that stand in the sources of both programs.

use super::is_rust;
use grideye_tests::programs::root;
use std::path::{Path, PathBuf};

/// Crates that meet a person's files, options, folders and addresses.
const CRATES: [&str; 15] = [
    "amg8833-emulator",
    "grideye",
    "grideye-agent",
    "grideye-collector",
    "grideye-dataset",
    "grideye-export",
    "grideye-homeassistant",
    "grideye-inputs",
    "grideye-plan",
    "grideye-recording",
    "grideye-rig",
    "grideye-scene",
    "grideye-validator",
    "grideye-variation",
    "i2c-emulation",
];

/// What answers over HTTP is tested over HTTP.
const HTTP: [&str; 5] = [
    "/src/http",
    "/src/page",
    "/src/live",
    "/src/router",
    "/src/annex",
];

/// Shorter pieces occur by chance.
const PIECE_CHARS_MIN: usize = 6;

/// Each hint of the sources with its file: its longest piece between two values.
pub(super) fn hints() -> Vec<(String, String)> {
    let mut found = Vec::new();
    let root = root().canonicalize().unwrap();
    for name in CRATES {
        for path in sources(&root.join("crates").join(name).join("src")) {
            let text = std::fs::read_to_string(&path).unwrap();
            let shown = path.strip_prefix(&root).unwrap().display().to_string();
            let of_program = text.split("#[cfg(test)]\nmod tests").next().unwrap();
            let pieces = hints_of(of_program).into_iter();
            found.extend(pieces.map(|piece| (shown.clone(), piece)));
        }
    }
    found
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    paths.sort();
    let mut files = Vec::new();
    for path in paths {
        let shown = path.display().to_string();
        if HTTP.iter().any(|part| shown.contains(part)) || shown.contains("/tests") {
            continue;
        }
        if path.is_dir() {
            files.extend(sources(&path));
        } else if is_rust(&path) {
            files.push(path);
        }
    }
    files
}

fn hints_of(text: &str) -> Vec<String> {
    let mut hints = Vec::new();
    let literals = literals(text);
    let has_rows = text.contains("rows! {");
    let after = literals.iter().skip(1).map(|(between, _)| between.as_str());
    for ((before, literal), after) in literals.iter().zip(after.chain([""])) {
        let before = before.trim_end().trim_end_matches("format!(").trim_end();
        // The last column of a row of keys.
        let is_doc = has_rows && before == "," && after.starts_with(';');
        let is_hint = ["hint =", "hint:", "hint(", "HINT: &str =", "DOC: &str ="]
            .iter()
            .any(|end| before.ends_with(end));
        let hint = match literal.split_once("hint: ") {
            Some((_, hint)) => hint,
            None if is_hint || is_doc => literal,
            None => continue,
        };
        hints.extend(longest_piece(hint));
    }
    hints
}

/// The string literals of a source, each with the code between it and the one before.
fn literals(text: &str) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let (mut code, mut rest) = (String::new(), text);
    while let Some(at) = rest.find(['"', '/', '\'']) {
        code.push_str(&rest[..at]);
        rest = &rest[at..];
        if rest.starts_with("//") {
            rest = &rest[rest.find('\n').unwrap_or(rest.len())..];
        } else if rest.starts_with("'\"'") || rest.starts_with("'\\") {
            rest = &rest[rest[2..].find('\'').map_or(rest.len(), |end| end + 3)..];
        } else if let Some(inside) = rest.strip_prefix('"') {
            let (literal, after) = literal(inside);
            found.push((std::mem::take(&mut code), literal));
            rest = after;
        } else {
            code.push_str(&rest[..1]);
            rest = &rest[1..];
        }
    }
    found
}

/// What stands before the closing quotation mark, unescaped, and what stands after it.
fn literal(inside: &str) -> (String, &str) {
    let mut literal = String::new();
    let mut chars = inside.char_indices().peekable();
    while let Some((at, c)) = chars.next() {
        match c {
            '"' => return (literal, &inside[at + 1..]),
            '\\' => match chars.next() {
                Some((_, 'n')) => literal.push('\n'),
                // A line goes on after the blanks of the next.
                Some((_, '\n')) => while chars.next_if(|(_, c)| c.is_whitespace()).is_some() {},
                Some((_, escaped)) => literal.push(escaped),
                None => {}
            },
            _ => literal.push(c),
        }
    }
    (literal, "")
}

fn longest_piece(hint: &str) -> Option<String> {
    let outside = hint.split('{').enumerate();
    let outside = outside.map(|(number, part)| match number {
        0 => part,
        _ => part.split_once('}').map_or(part, |(_, after)| after),
    });
    let pieces = outside.flat_map(|part| part.split('\n')).map(str::trim);
    let longest = pieces.max_by_key(|piece| piece.chars().count())?;
    (longest.chars().count() >= PIECE_CHARS_MIN).then(|| longest.to_owned())
}
