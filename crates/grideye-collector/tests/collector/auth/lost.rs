//! Tokens and keys that get lost: nobody is let in for that.

use crate::socket::{anywhere, at};
use grideye_collector::auth::{AccessFolder, Scope};
use grideye_collector::{
    Certificates, Collector, CollectorError, Config, Log, LogEvent, StoreLocation, Tls,
};
use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::sync::{Arc, Mutex};

struct Site {
    around: tempfile::TempDir,
    events: Arc<Mutex<Vec<LogEvent>>>,
}

impl Site {
    fn new() -> Self {
        Self {
            around: tempfile::tempdir().unwrap(),
            events: Arc::default(),
        }
    }

    fn folder(&self) -> AccessFolder {
        AccessFolder::new(self.around.path().join("access"))
    }

    fn add(&self) {
        self.folder()
            .change(|book| book.add("pi-1", Scope::Read, 1))
            .unwrap();
    }

    fn config(&self, access: &Path) -> Config {
        let sink = Arc::clone(&self.events);
        let store = StoreLocation::File(self.around.path().join("frames.sqlite"));
        Config {
            access: Some(AccessFolder::new(access)),
            log: Log::new(move |event| sink.lock().unwrap().push(event.clone())),
            ..at(anywhere(), store)
        }
    }

    /// Starts and stops a collector.
    async fn start(&self, config: Config) -> Result<(), CollectorError> {
        Collector::bind(config)
            .await?
            .serve(std::future::ready(()))
            .await
    }

    fn of(&self, name: &str, field: &str) -> Vec<String> {
        let events = self.events.lock().unwrap();
        let named = events.iter().filter(|event| event.event == name);
        let fields = named
            .flat_map(|event| &event.fields)
            .filter(|(key, _)| *key == field);
        fields.map(|(_, value)| value.clone()).collect()
    }
}

#[tokio::test]
async fn a_store_that_was_used_with_tokens_is_not_opened_to_everyone_when_they_are_gone() {
    let site = Site::new();
    let folder = site.folder().path().to_owned();
    site.start(site.config(&folder)).await.unwrap();
    site.start(site.config(&folder)).await.unwrap();
    site.add();
    site.start(site.config(&folder)).await.unwrap();
    assert_eq!(
        site.of("listening", "access"),
        vec![folder.display().to_string(); 3]
    );
    // Another working directory.
    let elsewhere = site.around.path().join("elsewhere");
    let refused = site.start(site.config(&elsewhere)).await.unwrap_err();
    let text = refused.to_string();
    assert!(
        text.contains(&elsewhere.display().to_string()) && text.contains("--access"),
        "{text}"
    );
    // The list is lost.
    let list = folder.join("tokens.json");
    let kept = fs::read(&list).unwrap();
    fs::remove_file(&list).unwrap();
    for _ in 0..2 {
        let refused = site.start(site.config(&folder)).await;
        assert!(
            matches!(refused, Err(CollectorError::TokensGone(_))),
            "{refused:?}"
        );
    }
    let told = Config {
        tokens_forgotten: true,
        ..site.config(&folder)
    };
    site.start(told).await.unwrap();
    assert_eq!(
        site.of("listening", "asks_for_tokens"),
        ["false", "false", "true", "false"]
    );
    fs::write(&list, kept).unwrap();
    site.start(site.config(&folder)).await.unwrap();
    assert_eq!(
        site.of("readable_by_others", "file"),
        [list.display().to_string()]
    );
}

#[tokio::test]
async fn tokens_made_while_a_collector_runs_count_too() {
    let site = Site::new();
    let folder = site.folder().path().to_owned();
    let collector = Collector::bind(site.config(&folder)).await.unwrap();
    site.add();
    collector
        .serve(tokio::time::sleep(std::time::Duration::from_millis(50)))
        .await
        .unwrap();
    fs::remove_file(folder.join("tokens.json")).unwrap();
    let refused = site.start(site.config(&folder)).await;
    assert!(
        matches!(refused, Err(CollectorError::TokensGone(_))),
        "{refused:?}"
    );
}

#[tokio::test]
async fn a_lost_certificate_of_the_authority_is_not_made_anew() {
    let site = Site::new();
    let folder = site.folder();
    let pin = folder.authority().unwrap().pin();
    let certificate = folder.path().join("authority.pem");
    let kept = fs::read(&certificate).unwrap();
    fs::remove_file(&certificate).unwrap();
    let tls = Tls {
        certificates: Certificates::OwnAuthority,
        client_authorities: None,
    };
    let config = || Config {
        tls: Some(tls.clone()),
        ..site.config(folder.path())
    };
    let refused = site.start(config()).await.unwrap_err().to_string();
    assert!(
        refused.contains("authority.pem") && refused.contains("\nhint: "),
        "{refused}"
    );
    fs::write(&certificate, kept).unwrap();
    let key = folder.path().join("authority.key");
    fs::set_permissions(&key, Permissions::from_mode(0o640)).unwrap();
    site.start(config()).await.unwrap();
    assert_eq!(folder.authority().unwrap().pin(), pin);
    assert_eq!(
        site.of("readable_by_others", "file"),
        [key.display().to_string()]
    );
}
