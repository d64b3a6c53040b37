//! The folder of tokens and its list, without a server.

use grideye_collector::auth::{
    AccessFolder, DEVICES_PER_TOKEN_MAX, FILE_BYTES_MAX, Scope, Token, TokenBook,
};
use std::fs::{self, File};
use std::os::unix::fs::MetadataExt as _;

fn ingest(devices: &[&str]) -> Scope {
    let devices = devices.iter().map(|device| (*device).to_owned());
    Scope::Ingest {
        devices: devices.collect(),
    }
}

fn folder() -> (tempfile::TempDir, AccessFolder) {
    let around = tempfile::tempdir().unwrap();
    let folder = AccessFolder::new(around.path());
    (around, folder)
}

#[test]
fn an_invalid_token_is_rejected_and_not_repeated() {
    let good = Token::random().unwrap().reveal();
    for bad in [
        "",
        "grideye",
        "grideye-",
        &good[1..],
        &good[..good.len() - 1],
        &format!("{good}0"),
        &format!("{good}-"),
        &good.to_uppercase(),
        &good.replacen("grideye", "Grideye", 1),
        &format!(" {good}"),
        "grideye-00000000000g-00",
    ] {
        let error = bad.parse::<Token>().unwrap_err().to_string();
        assert!(bad.len() < 20 || !error.contains(bad), "{error}");
    }
}

#[test]
fn a_token_is_revoked_by_number_or_name_and_the_book_does_not_become_empty() {
    let mut book = TokenBook::default();
    let first = book.add("pi-1", ingest(&["pi-1"]), 1).unwrap();
    let second = book.add("pi-1", ingest(&["pi-1"]), 2).unwrap();
    assert_eq!(book.revoke(&first.id().to_string(), 3).unwrap().len(), 1);
    let revoked = |book: &TokenBook| [0, 1].map(|place| book.records()[place].t_revoked_s);
    assert_eq!(revoked(&book), [Some(3), None]);
    assert_eq!(book.revoke("pi-1", 4).unwrap()[0].id, *second.id());
    let error = book.revoke("pi-1", 5).unwrap_err().to_string();
    let is_whole = error.contains("pi-1") && error.contains("\nhint: ");
    assert!(is_whole, "{error}");
    assert!(!book.is_empty());
    assert_eq!(revoked(&book), [Some(3), Some(4)], "the first is not moved");
}

#[test]
fn names_and_the_number_of_devices_are_bounded() {
    let mut book = TokenBook::default();
    let devices: Vec<String> = (0..=DEVICES_PER_TOKEN_MAX)
        .map(|number| format!("pi-{number}"))
        .collect();
    let names: Vec<&str> = devices.iter().map(String::as_str).collect();
    assert!(book.add("fleet", ingest(&names[1..]), 1).is_ok());
    let refused = |scope| {
        let added = TokenBook::default().add("fleet", scope, 1);
        added.unwrap_err().to_string()
    };
    assert!(refused(ingest(&names)).contains("found 65"));
    assert!(refused(ingest(&[])).contains("found 0"));
    assert!(refused(ingest(&["../etc"])).contains("\"../etc\" cannot be the name of a device"));
    for name in ["", "a b", "=1+1", "-x", &"x".repeat(65)] {
        let error = book.add(name, Scope::Read, 1).unwrap_err().to_string();
        assert!(error.contains("cannot be the name of a token"), "{error}");
    }
}

#[test]
fn a_file_that_was_tampered_with_is_refused_whole() {
    let (around, folder) = folder();
    let added = folder.change(|book| book.add("pi-1", ingest(&["pi-1"]), 1));
    added.unwrap();
    let file = around.path().join("tokens.json");
    let good = fs::read_to_string(&file).unwrap();
    let refused = |json: String| {
        fs::write(&file, json).unwrap();
        folder.book().unwrap_err().to_string()
    };
    for (found, with) in [
        ("\"layout\": 1", "\"layout\": 2"),
        ("\"ingest\"", "\"root\""),
        ("\"ingest\"", "\"admin\""),
        ("\"t_made_s\"", "\"made\""),
        ("\"sha256\": \"", "\"sha256\": \"0"),
        ("\"id\": \"", "\"id\": \"x"),
        ("\"pi-1\"", "\"p i\""),
        ("]\n}", "]\n"),
    ] {
        assert!(good.contains(found), "{found}");
        let error = refused(good.replace(found, with));
        assert!(error.contains("/tokens.json: "), "{error}");
    }
    let (open, close) = (good.rfind('{').unwrap(), good.rfind("\n  ]").unwrap());
    let (start, entry) = (&good[..open], &good[open..close]);
    let error = refused(format!("{start}{entry},{entry}\n]}}"));
    assert!(error.contains("duplicate token "), "{error}");
}

#[test]
fn changes_at_the_same_time_are_all_kept() {
    let (_around, folder) = folder();
    std::thread::scope(|scope| {
        for thread in 0..8 {
            let folder = &folder;
            scope.spawn(move || {
                for number in 0..8 {
                    let name = format!("t{thread}-{number}");
                    let added = folder.change(|book| book.add(&name, Scope::Read, 1));
                    added.unwrap();
                }
            });
        }
    });
    assert_eq!(folder.book().unwrap().records().len(), 64);
}

#[test]
fn a_change_that_is_refused_leaves_the_list_as_it_was() {
    let (around, folder) = folder();
    let added = folder.change(|book| book.add("page", Scope::Read, 1));
    added.unwrap();
    let state = || {
        let found = fs::metadata(around.path().join("tokens.json")).unwrap();
        (found.ino(), found.len(), found.mtime(), found.mtime_nsec())
    };
    let before = state();
    let refused = folder.change(|book| {
        book.revoke("page", 2)?;
        book.add("a b", Scope::Read, 2)
    });
    assert!(refused.is_err());
    assert_eq!(state(), before);
}

#[test]
fn a_file_that_is_far_too_long_is_not_read_to_its_end() {
    let (around, folder) = folder();
    let file = File::create(around.path().join("tokens.json")).unwrap();
    file.set_len(FILE_BYTES_MAX + 1).unwrap();
    let error = folder.book().unwrap_err().to_string();
    assert!(error.contains("longer than"), "{error}");
}
