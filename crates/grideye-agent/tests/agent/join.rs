//! The join line and the file that joining writes round-trip; cut or changed ones are rejected.

use grideye_agent::join::{ClientCertificate, Credentials, JoinLine, Joined, Pin, Secret};

const PIN: &str = "sha256-00112233445566778899aabbccddeeff00112233445566778899aabbccddeeff";

fn line() -> String {
    format!("grideye:https://192.168.1.20:8833,device=pi-1,token=grideye-12-34,pin={PIN}")
}

#[test]
fn a_line_reads_back_and_hides_its_token() {
    let read: JoinLine = line().parse().unwrap();
    assert_eq!(read.reveal(), line());
    assert_eq!(read.collector, "https://192.168.1.20:8833");
    assert_eq!(read.device.as_deref(), Some("pi-1"));
    assert!(!format!("{read:?}").contains("grideye-12-34"));
    let plain = "grideye:http://pc.local:8833,token=t";
    assert_eq!(plain.parse::<JoinLine>().unwrap().reveal(), plain);
    assert_eq!(format!(" {}\n", line()).parse::<JoinLine>().unwrap(), read);
}

#[test]
fn the_command_to_paste_reads_back_and_contains_no_shell_syntax() {
    let read: JoinLine = line().parse().unwrap();
    let command = read.command();
    let expected = format!("echo '{}' | sudo grideye-agent join -", line());
    assert_eq!(command, expected);
    assert_eq!(command.matches('\'').count(), 2);
    let as_argument = format!("sudo grideye-agent join '{}'", line());
    for command in [command, as_argument] {
        assert_eq!(format!("{command}\n").parse::<JoinLine>().unwrap(), read);
        // The whole line pasted in quotation marks, as a shell passes it on.
        let bare = command.replace('\'', "");
        assert_eq!(bare.parse::<JoinLine>().unwrap(), read);
        let cut = &command[3..];
        assert!(cut.parse::<JoinLine>().is_err(), "{cut}");
    }
}

#[test]
fn a_line_that_was_cut_or_changed_is_refused_with_the_fix_and_without_its_token() {
    let whole = line();
    let cuts = (0..whole.len()).map(|at| whole[..at].to_owned());
    let changed = [
        whole.replace("https", "http"),
        whole.replace(":8833", ""),
        whole.replace("token=", "token"),
        whole.replace("token=", "secret="),
        whole.replace("device=pi-1", "token=x"),
        whole.replace(PIN, "sha256-00"),
        whole.replace("grideye-12-34", ""),
        whole.replace("grideye-12-34", "a b"),
    ];
    for bad in cuts.chain(changed) {
        // Cut before the pin, it is simply a line without one.
        let error = bad.parse::<JoinLine>().unwrap_err().to_string();
        let hint = "\nhint: copy the whole line";
        assert!(error.contains(hint), "{bad}: {error}");
        assert!(!error.contains("grideye-12"), "{error}");
    }
}

#[test]
fn the_file_reads_back_and_hides_its_token() {
    let pem = "-----BEGIN CERTIFICATE-----\nAA==\n-----END CERTIFICATE-----\n";
    let client = ClientCertificate {
        chain: "chain".to_owned(),
        key: Secret::new("key").unwrap(),
    };
    let joined = Joined {
        collector: "https://pc:8833".to_owned(),
        device: Some("pi-1".to_owned()),
        credentials: Credentials {
            token: Some(Secret::new("grideye-12-34").unwrap()),
            authority: Some(pem.to_owned()),
            client: Some(client),
        },
    };
    let text = joined.to_toml().unwrap();
    assert_eq!(Joined::parse(&text, "collector.toml").unwrap(), joined);
    let shown = format!("{joined:?}");
    for secret in ["12-34", "\"key\""] {
        assert!(!shown.contains(secret), "{shown}");
    }
}

#[test]
fn a_file_that_was_changed_is_refused_with_its_place_and_without_its_token() {
    let good = "collector = \"http://pc:8833\"\ntoken = \"grideye-12-34\"\n";
    assert!(Joined::parse(good, "collector.toml").is_ok());
    for (found, with) in [
        ("token", "tokn"),
        ("http:", "https:"),
        (":8833", ""),
        ("grideye-12-34\"", "grideye-12-34"),
        ("token", "client_key = \"k\"\ntoken"),
        ("collector", "authority = \"a\"\ncollector"),
    ] {
        let changed = good.replacen(found, with, 1);
        let error = Joined::parse(&changed, "collector.toml").unwrap_err();
        let error = error.to_string();
        assert!(error.starts_with("collector.toml: ") && error.contains("\nhint: join again"));
        assert!(!error.contains("12-34"), "{error}");
    }
}

#[test]
fn a_pin_is_the_sha_256() {
    // FIPS 180-2, appendix B.1.
    let abc = "sha256-ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
    assert_eq!(Pin::of(b"abc").to_string(), abc);
}
