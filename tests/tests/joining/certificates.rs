//! Certificates of the site that the agent must reject, and what join and check report.

use crate::site::Site;
use grideye_tests::programs::{grideye_agent, run};
use rcgen::{BasicConstraints, CertificateParams, IsCa, Issuer, KeyPair, date_time_ymd};
use std::fs;
use std::path::Path;

/// A collector with a certificate for this name and these years, by an authority that the line pins.
struct Signed {
    folder: tempfile::TempDir,
    site: Site,
}

fn signed(name: &str, from: i32, until: i32) -> Signed {
    let folder = tempfile::tempdir().unwrap();
    let authority_key = KeyPair::generate().unwrap();
    let mut authority = CertificateParams::new(Vec::new()).unwrap();
    authority.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
    let authority_pem = authority.self_signed(&authority_key).unwrap().pem();
    let issuer = Issuer::new(authority, authority_key);
    let key = KeyPair::generate().unwrap();
    let mut params = CertificateParams::new(vec![name.to_owned()]).unwrap();
    (params.not_before, params.not_after) = (date_time_ymd(from, 1, 1), date_time_ymd(until, 1, 1));
    let certificate = params.signed_by(&key, &issuer).unwrap().pem();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("chain.pem"), certificate + &authority_pem).unwrap();
    fs::write(path("key.pem"), key.serialize_pem()).unwrap();
    fs::write(path("authority.pem"), authority_pem).unwrap();
    let text = |path: &Path| path.to_str().unwrap().to_owned();
    let (chain, key) = (text(&path("chain.pem")), text(&path("key.pem")));
    let site = Site::with(&["--tls-cert", &chain, "--tls-key", &key]);
    Signed { folder, site }
}

impl Signed {
    /// The line for the site's own authority.
    fn enroll(&self) -> String {
        let authority = self.folder.path().join("authority.pem");
        let authority = authority.to_str().unwrap();
        let enrolled = self
            .site
            .grideye(&["enroll", "pi-1", "--authority", authority]);
        assert_eq!(enrolled.code, 0, "{enrolled:?}");
        enrolled.stdout.trim().to_owned()
    }
}

/// The clock of a Raspberry Pi without a network is years off: the certificate is rejected because of the clock.
#[test]
fn a_certificate_that_is_refused_for_its_time_or_its_name_says_so_and_what_to_look_at() {
    let good = signed("127.0.0.1", 2020, 2100);
    let joined = good.site.join(&good.enroll());
    assert_eq!(joined.code, 0, "{joined:?}");
    let file = fs::read_to_string(good.site.path("collector.toml")).unwrap();
    let clock = "\nhint: what this machine's clock says decides that: see `timedatectl`";
    let name = "\nhint: the collector's certificate is for another name";
    for (subject, from, until, hint) in [
        ("127.0.0.1", 2020, 2021, clock),
        ("127.0.0.1", 2099, 2100, clock),
        ("pc.local", 2020, 2100, name),
    ] {
        let bad = signed(subject, from, until);
        let refused = bad.site.join(&bad.enroll());
        let context = format!("{subject}, {from} to {until}: {refused:?}");
        assert_eq!(refused.code, 1, "{context}");
        let step = "error: step 2 of 6, the collector, failed (nothing was changed): ";
        assert!(
            refused.stderr.starts_with(step) && refused.stderr.contains(hint),
            "{context}"
        );
        // An agent that joined before, when clock and name were right.
        let authority = fs::read_to_string(bad.folder.path().join("authority.pem")).unwrap();
        let mut joined: toml::Table = file.parse().unwrap();
        joined.insert("collector".to_owned(), bad.site.url.clone().into());
        joined.insert("authority".to_owned(), authority.into());
        fs::write(bad.site.path("collector.toml"), joined.to_string()).unwrap();
        let config = "[[bus]]\npath = \"/nonexistent/i2c-1\"\n[[bus.sensor]]\naddress = 0x69\n";
        fs::write(bad.site.path("agent.toml"), config).unwrap();
        let checked = run(grideye_agent()
            .args(["check", "--config"])
            .arg(bad.site.path("agent.toml")));
        assert!(
            checked.stdout.contains("collector: failed\nerror: ") && checked.stdout.contains(hint),
            "{context}: {checked:?}"
        );
    }
}
