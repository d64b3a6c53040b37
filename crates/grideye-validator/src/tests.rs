//! Every sentence that a verdict is made of, in one list to be read. `GRIDEYE_WRITE_GOLDEN=1 cargo test -p
//! grideye-validator every_sentence` writes it again. `tests/golden/verdicts.json` has those that need a recording.

use crate::advice::tests::{alternatives, remedies};
use crate::verdict::tests::judgments;

#[test]
fn every_sentence_of_a_verdict_is_as_it_was_read() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/sentences.txt");
    let judgments = judgments().into_iter().map(|one| one.to_string());
    let said = format!(
        "# Verdicts\n\n{}\n# What would make a scene agree\n\n{}\n\n# \"This recording would also fit …\"\n\n{}\n",
        judgments.collect::<Vec<_>>().join("\n"),
        remedies().join("\n\n"),
        alternatives().join("\n")
    );
    if std::env::var_os("GRIDEYE_WRITE_GOLDEN").is_some() {
        std::fs::write(path, said).unwrap();
        return;
    }
    let read = std::fs::read_to_string(path).unwrap();
    let pairs = read.lines().zip(said.lines());
    for (read, said) in pairs {
        assert_eq!(read, said);
    }
    assert_eq!(read, said);
}
