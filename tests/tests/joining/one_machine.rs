//! The recipe for one machine in the collector's README, run by a shell as it stands but for its port.

use grideye_tests::programs::{folder, root, run};
use std::net::TcpListener;
use std::process::Command;

#[test]
fn the_recipe_for_one_machine_runs_as_it_stands() {
    let readme = root().join("crates/grideye-collector/README.md");
    let readme = std::fs::read_to_string(readme).unwrap();
    let (_, recipe) = readme.split_once("```sh one-machine\n").unwrap();
    let (recipe, _) = recipe.split_once("```").unwrap();
    let free = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let recipe = recipe.replace("8833", &free.port().to_string());
    // A busy computer keeps the agent from frames, which `record` says by its exit code. And however the recipe ends, what it
    // started ends too.
    let recipe = recipe.replace("authority.pem\n", "authority.pem || test $? = 3\n");
    let recipe = format!("trap 'kill $collector $agent 2>/dev/null || true' EXIT\n{recipe}");
    let at = tempfile::tempdir().unwrap();
    let programs = folder().canonicalize().unwrap();
    let path = std::env::var("PATH").unwrap();
    let ended = run(Command::new("timeout")
        .args(["120", "sh", "-e", "-c", &recipe])
        .env("PATH", format!("{}:{path}", programs.display()))
        .current_dir(at.path()));
    assert_eq!(ended.code, 0, "{ended:?}");
    let account = "pi-1 i2c-1:0x69";
    for words in [
        "joined https://127.0.0.1:",
        "as \"evening\"",
        account,
        " + dropped 0 + spooled 0",
    ] {
        assert!(ended.stdout.contains(words), "no {words:?} in {ended:?}");
    }
    let recording = std::fs::read_to_string(at.path().join("evening.csv")).unwrap();
    assert!(recording.lines().count() > 10, "{ended:?}");
    assert!(recording.contains(",22,22,22,"), "{recording}");
}
