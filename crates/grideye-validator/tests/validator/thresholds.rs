//! Thresholds files: what they change, and which are rejected.

use grideye_validator::Thresholds;
use grideye_validator::thresholds::{SHIPPED, SHIPPED_NAME, TEXT_BYTES_MAX, ThresholdSet};

#[test]
fn the_built_in_file_has_every_default_with_its_source() {
    let set = ThresholdSet::parse(SHIPPED, "thresholds.toml").unwrap();
    assert_eq!(set.thresholds, Thresholds::default());
    for line in &set.lines {
        assert_eq!(line.file, "thresholds.toml", "{}", line.key);
        assert!(line.source.len() > 20, "{}", line.key);
    }
    let mut read = set.lines;
    read.iter_mut()
        .for_each(|line| line.file = SHIPPED_NAME.to_owned());
    assert_eq!(ThresholdSet::shipped().lines, read);
}

#[test]
fn a_file_changes_what_it_names_and_no_more() {
    let text = "[right_min]\nvalue = 0.03\nsource = \"our lab\"\n";
    let set = ThresholdSet::parse(text, "mine.toml").unwrap();
    let expected = Thresholds {
        right_min: 0.03,
        ..Thresholds::default()
    };
    assert_eq!(set.thresholds, expected);
    let changed: Vec<_> = set
        .lines
        .iter()
        .filter(|line| line.file == "mine.toml")
        .collect();
    assert_eq!(changed.len(), 1);
    let line = (changed[0].key, changed[0].value, changed[0].source.as_str());
    assert_eq!(line, ("right_min", 0.03, "our lab"));
}

#[test]
fn errors_name_their_place() {
    let right = "[right_min]\nvalue";
    for (text, expected) in [
        (
            format!("# x\n{right} = 1.5\nsource = \"a\"\n"),
            "3:9: `right_min.value` is 1.5, expected 0.005 to 0.5",
        ),
        (
            format!("{right} = nan\nsource = \"a\"\n"),
            "2:9: `right_min.value` is nan",
        ),
        (
            format!("{right} = 0.5\nsource = \" \"\n"),
            "3:10: `right_min.source` is \" \", expected where the number comes from",
        ),
        (
            "\n[right_mn]\nvalue = 0.5\nsource = \"a\"\n".to_owned(),
            "2:2: unknown field `right_mn`, expected one of `right_min`",
        ),
        (format!("{right} = 0.5\n"), "1:1: missing field `source`"),
        ("right_min = 3\n".to_owned(), "1:13: invalid type"),
        ("[right_min\n".to_owned(), "1:"),
        (
            format!("{right} = 0.5\nsource = \"a\"\nunit = 3\n"),
            "4:1: unknown field `unit`",
        ),
    ] {
        let error = ThresholdSet::parse(&text, "mine.toml").unwrap_err();
        let error = error.to_string();
        let expected = format!("mine.toml:{expected}");
        assert!(
            error.starts_with(&expected) && error.contains("\nhint: "),
            "{error}"
        );
    }
}

#[test]
fn an_oversized_file_is_rejected() {
    let text = " ".repeat(TEXT_BYTES_MAX + 1);
    let error = ThresholdSet::parse(&text, "film.mp4")
        .unwrap_err()
        .to_string();
    assert!(error.starts_with("film.mp4:1:1: 65537 bytes of text, expected at most 65536\nhint: "));
    assert!(ThresholdSet::parse(&text[1..], "x").is_ok());
}
