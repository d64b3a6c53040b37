//! Tests the collector's HTTP API against its OpenAPI document and its page of examples: schemathesis generates
//! requests from the document and checks every response; every example is run.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::live_page::{Outcome, Server, batch, frame, person};
use grideye_tests::programs::{Ended, RunningCollector, grideye, is_left_out, root, run, target};
use grideye_tests::python;
use grideye_tests::webdriver::Failure;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

const WITHOUT_REST: &str = "GRIDEYE_WITHOUT_REST";
const DOCUMENT: &str = include_str!("../../../crates/grideye-collector/openapi.json");
const EXAMPLES: &str = include_str!("../../../crates/grideye-collector/REST.md");
/// The URL in the examples; the tests use another port.
const URL: &str = "http://127.0.0.1:8833";

/// The annexes' documents, each in its own file.
const BROUGHT: [(&str, &str, &str); 5] = [
    (
        "exports",
        include_str!("../../../crates/grideye-export/openapi.json"),
        include_str!("../../../crates/grideye-export/src/annex.rs"),
    ),
    (
        "scenes",
        include_str!("../../../crates/grideye-studio/openapi/scenes.json"),
        include_str!("../../../crates/grideye-studio/src/beside/mod.rs"),
    ),
    (
        "editor",
        include_str!("../../../crates/grideye-studio/openapi/editor.json"),
        include_str!("../../../crates/grideye-studio/src/editor/mod.rs"),
    ),
    (
        "mqtt",
        include_str!("../../../crates/grideye-homeassistant/openapi.json"),
        include_str!("../../../crates/grideye-homeassistant/src/lib.rs"),
    ),
    (
        "files",
        include_str!("../../../crates/grideye/openapi/files.json"),
        include_str!("../../../crates/grideye/src/dropped.rs"),
    ),
];

fn document() -> serde_json::Value {
    serde_json::from_str(DOCUMENT).unwrap()
}

#[test]
fn the_document_names_every_path_that_programs_may_call() {
    let routes = routes(include_str!(
        "../../../crates/grideye-collector/src/router.rs"
    ));
    let for_people = [
        "/",
        "/editor",
        "/assets/{name}",
        "/login",
        "/v1/login",
        "/v1/logout",
    ];
    let document = document();
    let described: BTreeSet<&str> = document["paths"]
        .as_object()
        .unwrap()
        .keys()
        .map(String::as_str)
        // One route serves all three.
        .filter(|path| !["/v1/recordings/{id}.csv", "/v1/recordings/{id}.frames"].contains(path))
        .collect();
    let called = |path: &&str| !for_people.contains(path);
    let routes: BTreeSet<&str> = routes.into_iter().filter(called).collect();
    assert_eq!(described, routes);
    for (annex, paths, source) in BROUGHT {
        let paths: BTreeMap<String, serde_json::Value> = serde_json::from_str(paths).unwrap();
        let described: BTreeSet<&str> = paths.keys().map(String::as_str).collect();
        let routes = self::routes(source).into_iter().filter(called);
        assert_eq!(described, routes.collect::<BTreeSet<_>>(), "{annex}");
    }
}

/// The paths of the routes in a source text.
fn routes(source: &str) -> BTreeSet<&str> {
    let pieces = source.split(".route(").skip(1);
    pieces.filter_map(|rest| rest.split('"').nth(1)).collect()
}

#[test]
fn the_document_names_every_reason_and_the_program_s_version() {
    let document = document();
    let named: Vec<&str> = document["components"]["schemas"]["Reason"]["enum"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(serde_json::Value::as_str)
        .collect();
    let all = grideye_frame::NoData::ALL
        .iter()
        .map(|reason| reason.name());
    assert!(all.eq(named));
    assert_eq!(document["info"]["version"], env!("CARGO_PKG_VERSION"));
}

#[test]
fn every_answer_is_as_the_document_says() -> Outcome {
    if is_left_out(WITHOUT_REST, "every_answer_is_as_the_document_says") {
        return Ok(());
    }
    let folder = tempfile::tempdir()?;
    // The program with all annexes; the editor writes to a copy, and no broker is there.
    let scenes = folder.path().join("scenes");
    let copied = run(Command::new("cp")
        .arg("-r")
        .arg(root().join("scenes"))
        .arg(&scenes));
    assert_eq!(copied.code, 0, "{copied:?}");
    let arguments = [
        "--scenes".as_ref(),
        scenes.as_os_str(),
        "--mqtt".as_ref(),
        "mqtt://127.0.0.1:1".as_ref(),
    ];
    let server = RunningCollector::start_with(folder.path().join("frames.sqlite"), &arguments);
    // Create what the document's examples refer to.
    assert_eq!(server.start_recording("short"), 1);
    ureq::post(format!("{}/v1/frames", server.url())).send_json(batch(
        "i2c-1:0x69",
        0,
        &vec![frame(&person(), 402); 5],
    ))?;
    let mut whole = document();
    for (_, paths, _) in BROUGHT {
        let paths: serde_json::Map<String, serde_json::Value> = serde_json::from_str(paths)?;
        whole["paths"].as_object_mut().unwrap().extend(paths);
    }
    assert_eq!(server.json("/v1/openapi.json"), whole);
    let environment = target().join("rest");
    let set_up = run(Command::new(root().join("tests/python/set-up"))
        .arg(&environment)
        .arg(root().join("tests/rest/requirements.txt")));
    assert_eq!(
        set_up.code, 0,
        "schemathesis could not be installed: {set_up:?}\nhint: set {WITHOUT_REST}=1 to leave it out"
    );
    let asked = run(Command::new(environment.join("bin/python"))
        .current_dir(folder.path())
        .args([
            "-m",
            "schemathesis.cli",
            "run",
            &format!("{}/v1/openapi.json", server.url()),
            "--url",
            server.url(),
        ])
        // It never ends.
        .args(["--exclude-path", "/v1/live"])
        // A schema cannot say that numbers ascend.
        .args(["--exclude-checks", "positive_data_acceptance"])
        .args([
            "--max-examples",
            "60",
            "--seed",
            "7",
            "--generation-deterministic",
        ]));
    assert_eq!(asked.code, 0, "{}\n{}", asked.stdout, asked.stderr);
    assert!(asked.stdout.contains("Examples (in"), "{}", asked.stdout);
    assert!(asked.stdout.contains(" passed"), "{}", asked.stdout);
    Ok(())
}

/// The examples in one language, with the address replaced.
fn examples<'a>(language: &'a str, url: &'a str) -> impl Iterator<Item = String> + 'a {
    let opening = format!("```{language}\n");
    EXAMPLES
        .match_indices(&opening.clone())
        .map(move |(at, _)| {
            let begin = at + opening.len();
            let end = begin + EXAMPLES[begin..].find("```").unwrap();
            EXAMPLES[begin..end].replace(URL, url)
        })
        .collect::<Vec<_>>()
        .into_iter()
}

fn server_with_a_person(folder: &Path) -> Result<Server, Failure> {
    let server = Server::start(&folder.join("frames.sqlite"))?;
    server.post(&batch("i2c-1:0x69", 0, &vec![frame(&person(), 402); 5]))?;
    Ok(server)
}

fn outcome(example: &str, ended: &Ended) -> String {
    assert_eq!(
        ended.code, 0,
        "{example}\n{}\n{}",
        ended.stdout, ended.stderr
    );
    ended.stdout.clone()
}

#[test]
fn every_example_for_curl_does_what_it_says() -> Outcome {
    if is_left_out(WITHOUT_REST, "every_example_for_curl_does_what_it_says") {
        return Ok(());
    }
    let folder = tempfile::tempdir()?;
    let server = server_with_a_person(folder.path())?;
    let url = server.url("");
    let said: Vec<String> = examples("sh", &url)
        .map(|example| {
            let mut shell = Command::new("bash");
            shell.args(["-euo", "pipefail", "-c", &example]);
            outcome(&example, &run(shell.current_dir(folder.path())))
        })
        .collect();
    let [now, recorded, live, posted] = said.as_slice() else {
        return Err(format!("{} examples", said.len()).into());
    };
    let hottest = person()
        .iter()
        .max()
        .copied()
        .map(|word| f64::from(word) / 4.0);
    assert_eq!(
        now.trim(),
        format!("pi-1 i2c-1:0x69 {:?}", hottest.unwrap())
    );
    assert!(recorded.contains("\"running\":false"), "{recorded}");
    let csv = std::fs::read_to_string(folder.path().join("kitchen.csv"))?;
    assert!(csv.contains("pixel64"), "{csv}");
    assert!(live.starts_with("event: snapshot\n"), "{live}");
    assert!(posted.contains("{\"i2c-1:0x69\":0}"), "{posted}");
    let sensors = server.get("/v1/sensors")?;
    assert_eq!(sensors["sensors"][0]["frame"]["pixels_celsius"][63], 31.0);
    Ok(())
}

/// Recording 1 with a label, also on disk as CSV and as arrays.
fn recorded_and_labeled(server: &Server, folder: &Path) -> Outcome {
    ureq::post(server.url("/v1/recordings")).send_json(serde_json::json!({"name": "r"}))?;
    let post = |seq| server.post(&batch("i2c-1:0x69", seq, &[frame(&person(), 402)]));
    for seq in 5..8 {
        post(seq)?;
    }
    let span = serde_json::json!({"device": "pi-1", "sensor": "i2c-1:0x69", "boot": "b1", "first_seq": 5, "last_seq": 6});
    ureq::post(server.url("/v1/recordings/1/labels"))
        .send_json(serde_json::json!({"name": "two people", "spans": [span]}))?;
    ureq::post(server.url("/v1/recordings/1/stop")).send_empty()?;
    let recorded = folder.join("kitchen.csv");
    let mut answer = ureq::get(server.url("/v1/recordings/1.csv")).call()?;
    std::fs::write(&recorded, answer.body_mut().read_to_string()?)?;
    let converted = run(grideye()
        .args(["convert", "kitchen.csv", "kitchen.npz"])
        .current_dir(folder));
    assert_eq!(converted.code, 0, "{converted:?}");
    Ok(())
}

#[test]
fn every_example_for_a_notebook_does_what_it_says() -> Outcome {
    let folder = tempfile::tempdir()?;
    let server = server_with_a_person(folder.path())?;
    let url = server.url("");
    recorded_and_labeled(&server, folder.path())?;
    let post = |seq| server.post(&batch("i2c-1:0x69", seq, &[frame(&person(), 402)]));
    let mut said = Vec::new();
    for example in examples("python", &url) {
        let what = "every_example_for_a_notebook_does_what_it_says";
        let script = folder.path().join(format!("example{}.py", said.len()));
        std::fs::write(&script, &example)?;
        let Some(mut python) = python::peer(script.to_str().unwrap(), &[], what) else {
            return Ok(());
        };
        python.current_dir(folder.path());
        let running = std::thread::spawn(move || run(&mut python));
        // One example waits for new frames.
        let mut seq = 8 + 1000 * u64::try_from(said.len())?;
        while !running.is_finished() {
            post(seq)?;
            seq += 1;
            std::thread::sleep(std::time::Duration::from_millis(100));
        }
        said.push(outcome(&example, &running.join().unwrap()));
    }
    let [now, live, recent, table, arrays, labeled] = said.as_slice() else {
        return Err(format!("{} examples", said.len()).into());
    };
    let hottest = person()
        .iter()
        .max()
        .copied()
        .map(|word| f64::from(word) / 4.0);
    let hottest = hottest.unwrap();
    let in_table = format!(" {hottest:.1}");
    let hottest = format!("{hottest:.2} °C");
    assert!(
        now.starts_with("i2c-1:0x69 (8, 8) ") && now.contains(&hottest),
        "{now}"
    );
    assert_eq!(live.matches(&hottest).count(), 5, "{live}");
    assert!(
        table.contains("hottest") && table.contains("i2c-1:0x69"),
        "{table}"
    );
    assert!(
        recent.contains("max_celsius") && recent.contains(&in_table),
        "{recent}"
    );
    assert!(
        arrays.contains("i2c-1:0x69") && arrays.contains("(3, 8, 8)"),
        "{arrays}"
    );
    let of_label = labeled.lines().find(|line| line.starts_with("two people"));
    let frames = of_label.and_then(|line| line.split_whitespace().last());
    assert_eq!(frames, Some("2"), "{labeled}");
    Ok(())
}
