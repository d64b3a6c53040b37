//! Signing in to the live page, in a real browser, and being signed out.

use grideye_collector::auth::{AccessFolder, Scope, Token};
use grideye_collector::{Collector, CollectorError, Config, StoreLocation, SystemClock};
use grideye_tests::patience::wait_for;
use grideye_tests::webdriver::{Browser, Failure, left_out};
use std::path::Path;
use std::sync::Arc;
use tokio::runtime::Runtime;
use tokio::sync::oneshot;
use tokio::task::JoinHandle;

type Outcome = Result<(), Failure>;

/// A collector in this process that asks for tokens.
struct Server {
    runtime: Runtime,
    url: String,
    folder: AccessFolder,
    stop: Option<oneshot::Sender<()>>,
    served: Option<JoinHandle<Result<(), CollectorError>>>,
}

impl Server {
    fn start(at: &Path) -> Result<Self, Failure> {
        let runtime = Runtime::new()?;
        let folder = AccessFolder::new(at.join("access"));
        folder.change(|book| book.add("nobody", Scope::Read, 1))?;
        let store = StoreLocation::File(at.join("frames.sqlite"));
        let clock = Arc::new(SystemClock::new());
        let config = Config {
            access: Some(folder.clone()),
            ..Config::new(([127, 0, 0, 1], 0).into(), store, clock)
        };
        let collector = runtime.block_on(Collector::bind(config))?;
        let url = format!("http://{}", collector.local_addr());
        let (stop, stopped) = oneshot::channel::<()>();
        let served = runtime.spawn(collector.serve(async {
            let _ = stopped.await;
        }));
        Ok(Self {
            runtime,
            url,
            folder,
            stop: Some(stop),
            served: Some(served),
        })
    }

    fn token(&self, name: &str, scope: Scope) -> Result<Token, Failure> {
        let token = self.folder.change(|book| book.add(name, scope, 1))?;
        // The collector notices within a second, or when a busy machine lets it.
        let bearer = format!("Bearer {}", token.reveal());
        wait_for("the token", || {
            let asked = ureq::get(format!("{}/v1/sensors", self.url));
            asked.header("authorization", &bearer).call().ok()
        });
        Ok(token)
    }

    fn end(&mut self) -> Outcome {
        self.stop = None;
        if let Some(served) = self.served.take() {
            self.runtime.block_on(served)??;
        }
        Ok(())
    }
}

fn wait_for_page(browser: &Browser, path: &str) -> Outcome {
    let at = || browser.execute("return location.pathname");
    browser
        .wait_for(&format!("page {path}"), at, |found| found == path)
        .map(drop)
}

fn sign_in(browser: &Browser, token: &Token) -> Outcome {
    browser.execute("document.querySelector('#token').value = ''")?;
    browser.type_into("#token", &format!("{}\u{E007}", token.reveal()))?;
    Ok(())
}

#[test]
fn a_person_signs_in_with_a_token_works_signs_out_and_is_sent_out_when_it_is_revoked() -> Outcome {
    if left_out("a_person_signs_in_with_a_token") {
        return Ok(());
    }
    let at = tempfile::tempdir()?;
    let mut server = Server::start(at.path())?;
    let ana = server.token("ana", Scope::Admin)?;
    let browser = Browser::start()?;
    browser.open(&format!("{}/", server.url))?;
    wait_for_page(&browser, "/login")?;
    // A token that nobody knows is refused in words, and the page stays.
    sign_in(&browser, &Token::random()?)?;
    browser.wait_for_text("#trouble", |text| text.contains("unknown or was revoked"))?;
    sign_in(&browser, &ana)?;
    wait_for_page(&browser, "/")?;
    browser.wait_for_text("#link", |text| text == "connected")?;
    // No script gets at what signs the person in.
    let readable = browser.execute("return document.cookie + JSON.stringify(localStorage)")?;
    assert_eq!(readable, "{}");
    browser.type_into("#name", "kitchen\u{E007}")?;
    browser.wait_for_text("#list", |text| text.contains("kitchen"))?;
    browser.wait_for_text("#sign-out", |text| text == "Sign out")?;
    browser.click("#sign-out")?;
    wait_for_page(&browser, "/login")?;
    browser.open(&format!("{}/", server.url))?;
    wait_for_page(&browser, "/login")?;

    let ben = server.token("ben", Scope::Read)?;
    sign_in(&browser, &ben)?;
    wait_for_page(&browser, "/")?;
    // What this token may not do is not offered.
    browser.wait_for_text("#read-only", |text| text.contains("may only read"))?;
    assert_eq!(browser.text("#start")?, "");
    assert_eq!(browser.text("#list [data-field=stop]")?, "");
    browser.click("nav [data-view=recordings]")?;
    let note = "return document.querySelector('#library [data-field=note]')?.readOnly";
    browser.wait_for("a note", || browser.execute(note), |seen| *seen == true)?;
    server.folder.change(|book| book.revoke("ben", 2))?;
    // What is followed ends, and the page notices why.
    wait_for_page(&browser, "/login")?;
    let faults: Vec<String> = browser
        .console()?
        .into_iter()
        .filter(|line| !line.contains("401") && !line.contains("403"))
        .collect();
    assert_eq!(faults, Vec::<String>::new());
    server.end()
}
