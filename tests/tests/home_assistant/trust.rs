//! Passwords and certificates.

use crate::feed::collector;
use grideye_tests::broker::Broker;
use grideye_tests::patience::wait_for;
use grideye_tests::programs::{grideye, run};
use std::path::Path;

#[test]
fn a_refused_password_is_told_with_what_to_do_and_stands_nowhere() {
    let what = "a_refused_password_is_told_with_what_to_do_and_stands_nowhere";
    let broker = Broker::start_with(what, |folder| {
        let file = folder.join("passwords");
        let made = run(std::process::Command::new("mosquitto_passwd")
            .args(["-b", "-c"])
            .arg(&file)
            .args(["ana", "right-horse-battery"]));
        assert_eq!(made.code, 0, "{made:?}");
        format!("password_file {}\n", file.display())
    });
    let Some(broker) = broker else {
        return;
    };
    let at = tempfile::tempdir().unwrap();
    let file = at.path().join("password");
    let url = broker.url().replace("mqtt://", "mqtt://ana@");
    let with_password = |password: &str| {
        std::fs::write(&file, format!("{password}\n")).unwrap();
        collector(
            at.path(),
            &url,
            &["--mqtt-password-file", file.to_str().unwrap()],
        )
    };
    let refused = with_password("wrong-horse-battery");
    let fault = wait_for("the refusal", || {
        let status = refused.json("/v1/mqtt");
        status["fault"].is_object().then(|| status["fault"].clone())
    });
    assert_eq!(
        fault["message"],
        "the broker refuses the user or the password"
    );
    assert!(
        fault["hint"]
            .as_str()
            .unwrap()
            .contains("--mqtt-password-file"),
        "{fault}"
    );
    let arguments = std::fs::read(format!("/proc/{}/cmdline", refused.pid())).unwrap();
    let log = refused.stop().stderr;
    assert!(
        log.contains("mqtt_fault") && log.contains("the broker refuses the user or the password"),
        "{log}"
    );
    let said = format!("{}{log}{fault}", String::from_utf8_lossy(&arguments));
    assert!(!said.contains("horse"), "{said}");
    let nobody = collector(at.path(), &broker.url(), &[]);
    let fault = wait_for("the refusal of nobody", || {
        let status = nobody.json("/v1/mqtt");
        status["fault"].is_object().then(|| status["fault"].clone())
    });
    assert_eq!(
        fault["message"],
        "the broker requires a user and a password"
    );
    drop(nobody);
    let taken = with_password("right-horse-battery");
    wait_for("the connection", || {
        (taken.json("/v1/mqtt")["connected"] == true).then_some(())
    });
    let log = taken.stop().stderr;
    assert!(
        log.contains("mqtt_connected") && !log.contains("horse"),
        "{log}"
    );
}

#[test]
fn a_password_in_the_address_is_refused_without_being_repeated() {
    let refused = run(grideye().args(["collect", "--mqtt", "mqtt://ana:hunter2@127.0.0.1"]));
    assert_eq!(refused.code, 2, "{refused:?}");
    assert!(
        refused.stderr.contains("--mqtt-password-file"),
        "{refused:?}"
    );
    assert!(!refused.stderr.contains("hunter2"), "{refused:?}");
}

#[test]
fn an_encrypted_broker_is_believed_by_its_authority_alone() {
    let what = "an_encrypted_broker_is_believed_by_its_authority_alone";
    let at = tempfile::tempdir().unwrap();
    let (ours, other) = (at.path().join("ours.pem"), at.path().join("other.pem"));
    let broker = Broker::start_with(what, |folder| {
        let authority = authority();
        std::fs::write(&ours, authority.0.pem()).unwrap();
        std::fs::write(&other, self::authority().0.pem()).unwrap();
        let key = rcgen::KeyPair::generate().unwrap();
        let parameters = rcgen::CertificateParams::new(vec!["127.0.0.1".to_owned()]).unwrap();
        let certificate = parameters.signed_by(&key, &authority.1).unwrap();
        let (chain, secret) = (folder.join("chain.pem"), folder.join("key.pem"));
        std::fs::write(&chain, certificate.pem()).unwrap();
        std::fs::write(&secret, key.serialize_pem()).unwrap();
        let (chain, secret) = (chain.display(), secret.display());
        format!("allow_anonymous true\ncertfile {chain}\nkeyfile {secret}\n")
    });
    let Some(broker) = broker else {
        return;
    };
    let url = broker.url().replace("mqtt://", "mqtts://");
    let with_authority = |file: &Path| {
        collector(
            at.path(),
            &url,
            &["--mqtt-authority", file.to_str().unwrap()],
        )
    };
    let collector = with_authority(&other);
    let fault = wait_for("the mistrust", || {
        let status = collector.json("/v1/mqtt");
        status["fault"].is_object().then(|| status["fault"].clone())
    });
    let message = fault["message"].as_str().unwrap();
    assert!(
        message.contains("cannot trust the broker's certificate"),
        "{fault}"
    );
    drop(collector);
    let collector = with_authority(&ours);
    wait_for("the connection", || {
        (collector.json("/v1/mqtt")["connected"] == true).then_some(())
    });
    assert_eq!(collector.json("/v1/mqtt")["broker"], url);
}

/// A certificate authority and its issuer.
fn authority() -> (rcgen::Certificate, rcgen::Issuer<'static, rcgen::KeyPair>) {
    let key = rcgen::KeyPair::generate().unwrap();
    let mut parameters = rcgen::CertificateParams::new(Vec::<String>::new()).unwrap();
    parameters.is_ca = rcgen::IsCa::Ca(rcgen::BasicConstraints::Unconstrained);
    let certificate = parameters.self_signed(&key).unwrap();
    (certificate, rcgen::Issuer::new(parameters, key))
}
