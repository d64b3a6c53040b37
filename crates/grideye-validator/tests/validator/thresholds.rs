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
    let text = "[gain_skill_min]\nvalue = 0.75\nsource = \"our lab\"\n";
    let set = ThresholdSet::parse(text, "mine.toml").unwrap();
    let expected = Thresholds {
        gain_skill_min: 0.75,
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
    assert_eq!(line, ("gain_skill_min", 0.75, "our lab"));
}

#[test]
fn errors_name_their_place() {
    let gain = "[gain_skill_min]\nvalue";
    for (text, expected) in [
        (
            format!("# x\n{gain} = 1.5\nsource = \"a\"\n"),
            "3:9: `gain_skill_min.value` is 1.5, expected 0 to 1",
        ),
        (
            format!("{gain} = nan\nsource = \"a\"\n"),
            "2:9: `gain_skill_min.value` is NaN",
        ),
        (
            format!("{gain} = 0.5\nsource = \" \"\n"),
            "3:10: `gain_skill_min.source` is empty",
        ),
        (
            "\n[gain_skil_min]\nvalue = 0.5\nsource = \"a\"\n".to_owned(),
            "2:1: `gain_skil_min` is not a threshold",
        ),
        (format!("{gain} = 0.5\n"), "1:1: missing field `source`"),
        ("gain_skill_min = 3\n".to_owned(), "1:18: invalid type"),
        ("[gain_skill_min\n".to_owned(), "1:"),
        (
            format!("{gain} = 0.5\nsource = \"a\"\nunit = 3\n"),
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
    assert!(error.starts_with("film.mp4: 65537 bytes of text, expected at most 65536\nhint: "));
    assert!(ThresholdSet::parse(&text[1..], "x").is_ok());
}
