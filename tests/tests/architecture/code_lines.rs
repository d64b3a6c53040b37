//! The code lines of every crate, held to the numbers of `crates/README.md`: lines of `src/**/*.rs` that are not blank, no
//! comment and no test code.

use crate::{manifests, root, rust_files};
use std::collections::BTreeMap;

/// How far above the truth a number may be, in percent: what one gained, the next may not lose.
const SLACK_PERCENT: usize = 2;

#[test]
fn no_crate_has_more_code_than_its_number_which_only_falls() {
    let allowed = allowed();
    let counted: BTreeMap<String, usize> = manifests()
        .into_keys()
        .map(|name| (name.clone(), code_lines(&name)))
        .collect();
    let mut wrong = Vec::new();
    for (name, count) in &counted {
        match allowed.get(name) {
            None => wrong.push(format!("{name} has {count} code lines and no number")),
            Some(most) if count > most => wrong.push(format!(
                "{name} has {count} code lines, {most} at most: a commit that raises a number says in its message what was retired for it"
            )),
            Some(most) if count + count * SLACK_PERCENT / 100 < *most => wrong.push(format!(
                "{name} has {count} code lines, and its number is still {most}: lower it"
            )),
            Some(_) => {}
        }
    }
    let is_gone = |name: &&String| !counted.contains_key(*name);
    wrong.extend(
        allowed
            .keys()
            .filter(is_gone)
            .map(|name| format!("{name} is no crate")),
    );
    let table: String = counted
        .iter()
        .map(|(name, count)| format!("{name:<24}{count:>6}\n"))
        .collect();
    assert!(
        wrong.is_empty(),
        "{}\nunder \"{HEADING}\" of crates/README.md, if this is what is meant:\n\n{table}",
        wrong.join("\n")
    );
}

const HEADING: &str = "## Code lines";

/// The numbers of `crates/README.md`: the block below the heading.
fn allowed() -> BTreeMap<String, usize> {
    let map = std::fs::read_to_string(root().join("crates/README.md")).unwrap();
    let below = map.split(HEADING).nth(1).unwrap();
    let block = below.split("```").nth(1).unwrap();
    let lines = block.lines().filter_map(|line| {
        let (name, count) = line.split_once(' ')?;
        Some((name.to_owned(), count.trim().parse().unwrap()))
    });
    lines.collect()
}

fn code_lines(name: &str) -> usize {
    let src = root().join("crates").join(name).join("src");
    let is_test = |path: &std::path::Path| {
        let inside = path.strip_prefix(&src).unwrap();
        path.ends_with("tests.rs") || inside.iter().any(|part| part == "tests")
    };
    let files = rust_files(&src).into_iter().filter(|file| !is_test(file));
    files
        .map(|file| code(&std::fs::read_to_string(file).unwrap()))
        .sum()
}

/// The code lines of a source.
fn code(source: &str) -> usize {
    let mut lines = source.lines().map(str::trim).peekable();
    let mut count = 0;
    while let Some(line) = lines.next() {
        if line.starts_with("#[cfg(test") || line.starts_with("#[cfg(all(test") {
            while lines.next_if(|line| line.starts_with("#[")).is_some() {}
            let mut depth = 0;
            // One line, or up to the brace that closes what it opens.
            for line in lines.by_ref() {
                depth += braces(line);
                if depth <= 0 {
                    break;
                }
            }
        } else if !line.is_empty() && !line.starts_with("//") {
            count += 1;
        }
    }
    count
}

/// How many more braces a line opens than it closes, outside texts and comments.
fn braces(line: &str) -> i32 {
    let mut depth = 0;
    let mut rest = line;
    while let Some(letter) = rest.chars().next() {
        let length = match letter {
            '/' if rest.starts_with("//") => break,
            '"' => {
                let mut escaped = false;
                let end = rest[1..].find(|letter| {
                    let ends = letter == '"' && !escaped;
                    escaped = letter == '\\' && !escaped;
                    ends
                });
                end.map_or(1, |end| end + 2)
            }
            '\'' if rest.starts_with("'{'")
                || rest.starts_with("'}'")
                || rest.starts_with("'\"'") =>
            {
                3
            }
            '\'' if rest.starts_with("'\\") => rest[3..].find('\'').map_or(1, |end| end + 4),
            '{' => {
                depth += 1;
                1
            }
            '}' => {
                depth -= 1;
                1
            }
            other => other.len_utf8(),
        };
        rest = &rest[length..];
    }
    depth
}

#[test]
fn tests_comments_and_empty_lines_are_no_code() {
    let source = "//! A file.\n\nuse a::b;\n/// Its one function.\nfn f() {\n    // Why.\n    g(\"{\", '{');\n}\n\n#[cfg(test)]\n#[expect(x)]\nmod tests {\n    fn t() {\n    }\n}\n#[cfg(test)]\nmod others;\nfn h() {}\n";
    assert_eq!(code(source), 5);
}
