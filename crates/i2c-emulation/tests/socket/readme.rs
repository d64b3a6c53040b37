//! Extracts the README's example and runs it.

use std::fs;
use std::path::Path;

use i2c_emulation::socket::Options;

use crate::bench::Bench;
use crate::python::{output, python};

/// The first code block of a language after the heading of the socket, or else after the beginning.
pub(crate) fn block(text: &str, language: &str) -> String {
    let text = text
        .split_once("## Another process")
        .map_or(text, |(_, after)| after);
    let (_, after) = text
        .split_once(&format!("```{language}\n"))
        .unwrap_or_else(|| panic!("no block of {language}"));
    let (code, _) = after.split_once("```").unwrap();
    code.to_owned()
}

fn readme() -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md")).unwrap()
}

#[test]
fn the_python_example_reads_a_frame() {
    let Some(mut python) = python() else { return };
    let bench = Bench::new(Options::default());
    let script =
        block(&readme(), "python").replace("/tmp/grideye.sock", &bench.path.display().to_string());
    let text = output(python.args(["-c", &script]));
    assert_eq!(text, "131 138 [105]\n");
    assert!(
        bench.transfers().contains(&"69W[80] 69R128".to_owned()),
        "a frame is one transfer"
    );
}
