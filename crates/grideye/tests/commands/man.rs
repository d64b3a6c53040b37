//! The man pages.

use std::process::Command;

#[test]
fn the_page_of_a_command_ends_with_its_exit_status_and_its_example() {
    let folder = tempfile::tempdir().unwrap();
    let pages = folder.path().join("man1");
    let mut command = Command::new(env!("CARGO_BIN_EXE_grideye"));
    assert!(command.arg("man").arg(&pages).status().unwrap().success());
    let read = |name: &str| std::fs::read_to_string(pages.join(name)).unwrap();
    assert!(read("grideye-collect.1").contains("Discovery prefix of Home Assistant"));
    let compare = read("grideye-compare.1");
    for text in [
        ".SH NAME\ngrideye\\-compare \\- ",
        ".SH \"EXIT STATUS\"\nExit code 0: agrees",
        ".SH EXAMPLE\n.nf\ngrideye compare \\-\\-scene",
    ] {
        assert!(compare.contains(text), "{text}: {compare}");
    }
    assert!(
        read("grideye-agent-join.1")
            .contains("echo \\(aqCODE\\(aq | sudo grideye\\-agent join \\-")
    );
    assert!(read("grideye-token-make.1").contains("grideye token make"));
}
