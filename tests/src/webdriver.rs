//! A small WebDriver client: enough to drive one page as a person would, and to ask it what it shows.
//!
//! Speaks the W3C protocol (<https://www.w3.org/TR/webdriver2/>) with a chromedriver that it starts and ends itself.

use crate::patience::WAIT_MAX;
use serde_json::{Value, json};
use std::error::Error;
use std::fmt;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// The key under which an element's number stands (W3C WebDriver §12, "web element identifier").
const ELEMENT_KEY: &str = "element-6066-11e4-a52e-4f735466cecf";
const LOOK_AGAIN: Duration = Duration::from_millis(50);
/// Lines of chromedriver's greeting in which its port is looked for.
const GREETING_LINES_MAX: usize = 20;

/// Set to 1 where there is no browser, to leave out the tests that need one.
pub const WITHOUT_BROWSER: &str = "GRIDEYE_WITHOUT_BROWSER";

/// Whatever went wrong with the browser; tests only print it.
pub type Failure = Box<dyn Error + Send + Sync>;

/// One headless Chromium with a profile of its own, gone when this is dropped.
pub struct Browser {
    agent: ureq::Agent,
    session_url: String,
    // Ended before the profile's folder is removed, which is last.
    _driver: Driver,
    _profile: tempfile::TempDir,
}

/// One element of the page.
#[derive(Debug, Clone)]
pub struct Element(String);

/// How large the window is, in CSS pixels, and how many device pixels each of those has.
#[derive(Debug, Clone, Copy)]
pub struct Screen {
    /// CSS pixels across.
    pub width: u32,
    /// CSS pixels down.
    pub height: u32,
    /// Device pixels per CSS pixel.
    pub scale: f64,
    /// Whether it is a telephone.
    pub mobile: bool,
}

impl Browser {
    /// Starts chromedriver and a browser.
    ///
    /// # Errors
    /// If either is missing or does not start; the message says which.
    pub fn start() -> Result<Self, Failure> {
        let driver = Driver::start()?;
        let profile = tempfile::tempdir()?;
        let config = ureq::Agent::config_builder()
            .timeout_global(Some(WAIT_MAX))
            .http_status_as_error(false)
            .build();
        let mut browser = Self {
            agent: ureq::Agent::new_with_config(config),
            session_url: format!("http://127.0.0.1:{}/session", driver.port),
            _driver: driver,
            _profile: profile,
        };
        let capabilities = capabilities(browser._profile.path());
        let session = browser.command("", &json!({ "capabilities": capabilities }))?;
        let id = session["sessionId"]
            .as_str()
            .ok_or("the driver named no session")?;
        browser.session_url = format!("{}/{id}", browser.session_url);
        Ok(browser)
    }

    /// Opens a page and waits until it is loaded.
    ///
    /// # Errors
    /// If the page cannot be reached.
    pub fn open(&self, url: &str) -> Result<(), Failure> {
        self.command("/url", &json!({ "url": url })).map(drop)
    }

    /// The first element that a CSS selector finds.
    ///
    /// # Errors
    /// If there is none.
    pub fn find(&self, selector: &str) -> Result<Element, Failure> {
        let found = self.command(
            "/element",
            &json!({ "using": "css selector", "value": selector }),
        )?;
        let id = found[ELEMENT_KEY]
            .as_str()
            .ok_or("the driver named no element")?;
        Ok(Element(id.to_owned()))
    }

    /// Clicks the middle of an element, as a person would: it must be visible and not covered.
    ///
    /// # Errors
    /// If it is not there or cannot be clicked.
    pub fn click(&self, selector: &str) -> Result<(), Failure> {
        let Element(id) = self.find(selector)?;
        self.command(&format!("/element/{id}/click"), &json!({}))
            .map(drop)
    }

    /// Types into an element. Keys without a letter have the numbers of W3C WebDriver §17.4.2.
    ///
    /// # Errors
    /// If it is not there or cannot be typed into.
    pub fn type_into(&self, selector: &str, text: &str) -> Result<(), Failure> {
        let Element(id) = self.find(selector)?;
        self.command(&format!("/element/{id}/value"), &json!({ "text": text }))
            .map(drop)
    }

    /// Moves the mouse to a place given in CSS pixels from the middle of an element.
    ///
    /// # Errors
    /// If it is not there, or the place is outside of the window.
    pub fn point_at(&self, selector: &str, from_middle: (i32, i32)) -> Result<(), Failure> {
        let moved = self.move_to(selector, from_middle)?;
        self.mouse(&json!([moved]))
    }

    /// Presses the mouse at one place, given in CSS pixels from the middle of an element, and lets go at another.
    ///
    /// # Errors
    /// If it is not there, or a place is outside of the window.
    pub fn drag(&self, selector: &str, from: (i32, i32), to: (i32, i32)) -> Result<(), Failure> {
        let [start, end] = [self.move_to(selector, from)?, self.move_to(selector, to)?];
        let press = json!({ "type": "pointerDown", "button": 0 });
        let release = json!({ "type": "pointerUp", "button": 0 });
        self.mouse(&json!([start, press, end, release]))
    }

    /// As [`drag`](Self::drag), but does not let go: [`release`](Self::release) does.
    ///
    /// # Errors
    /// If it is not there, or a place is outside of the window.
    pub fn hold(&self, selector: &str, from: (i32, i32), to: (i32, i32)) -> Result<(), Failure> {
        let [start, end] = [self.move_to(selector, from)?, self.move_to(selector, to)?];
        let press = json!({ "type": "pointerDown", "button": 0 });
        self.mouse(&json!([start, press, end]))
    }

    /// Releases the mouse button.
    ///
    /// # Errors
    /// If the browser refuses.
    pub fn release(&self) -> Result<(), Failure> {
        self.mouse(&json!([{ "type": "pointerUp", "button": 0 }]))
    }

    fn move_to(&self, selector: &str, (x, y): (i32, i32)) -> Result<Value, Failure> {
        let Element(id) = self.find(selector)?;
        Ok(
            json!({ "type": "pointerMove", "duration": 0, "origin": { ELEMENT_KEY: id }, "x": x, "y": y }),
        )
    }

    fn mouse(&self, actions: &Value) -> Result<(), Failure> {
        let mouse = json!({
            "type": "pointer", "id": "mouse", "parameters": { "pointerType": "mouse" }, "actions": actions
        });
        self.command("/actions", &json!({ "actions": [mouse] }))
            .map(drop)
    }

    /// Presses a key wherever the focus is.
    ///
    /// # Errors
    /// If the browser refuses.
    pub fn press(&self, key: &str) -> Result<(), Failure> {
        let strokes =
            json!([{ "type": "keyDown", "value": key }, { "type": "keyUp", "value": key }]);
        let keyboard = json!({ "type": "key", "id": "keyboard", "actions": strokes });
        self.command("/actions", &json!({ "actions": [keyboard] }))
            .map(drop)
    }

    /// Presses the keys of a text one after the other, wherever the focus is.
    ///
    /// # Errors
    /// If the browser refuses.
    pub fn press_text(&self, text: &str) -> Result<(), Failure> {
        let strokes = text.chars().flat_map(|key| {
            ["keyDown", "keyUp"].map(|kind| json!({ "type": kind, "value": key.to_string() }))
        });
        let strokes: Vec<Value> = strokes.collect();
        let keyboard = json!({ "type": "key", "id": "keyboard", "actions": strokes });
        self.command("/actions", &json!({ "actions": [keyboard] }))
            .map(drop)
    }

    /// Presses keys together, wherever the focus is: the first ones are held while the last is pressed.
    ///
    /// # Errors
    /// If the browser refuses.
    pub fn press_together(&self, keys: &[&str]) -> Result<(), Failure> {
        let stroke = |kind: &'static str| move |key: &&str| json!({ "type": kind, "value": key });
        let down = keys.iter().map(stroke("keyDown"));
        let up = keys.iter().rev().map(stroke("keyUp"));
        let strokes: Vec<Value> = down.chain(up).collect();
        let keyboard = json!({ "type": "key", "id": "keyboard", "actions": strokes });
        self.command("/actions", &json!({ "actions": [keyboard] }))
            .map(drop)
    }

    /// Runs a script as the body of a function, and answers what it returns.
    ///
    /// # Errors
    /// If it throws.
    pub fn execute(&self, script: &str) -> Result<Value, Failure> {
        self.command("/execute/sync", &json!({ "script": script, "args": [] }))
    }

    /// The name of an element in the accessibility tree.
    ///
    /// # Errors
    /// If the element is not there.
    pub fn label(&self, selector: &str) -> Result<String, Failure> {
        let Element(id) = self.find(selector)?;
        let label = self.ask(&format!("/element/{id}/computedlabel"))?;
        Ok(label.as_str().unwrap_or_default().to_owned())
    }

    /// The visible text of an element.
    ///
    /// # Errors
    /// If it is not there.
    pub fn text(&self, selector: &str) -> Result<String, Failure> {
        let Element(id) = self.find(selector)?;
        let text = self.ask(&format!("/element/{id}/text"))?;
        Ok(text.as_str().unwrap_or_default().to_owned())
    }

    /// Looks again and again until the text of an element satisfies.
    ///
    /// # Errors
    /// If it does not in [`WAIT_MAX`]; the message says what the text was at last.
    pub fn wait_for_text(
        &self,
        selector: &str,
        satisfies: impl Fn(&str) -> bool,
    ) -> Result<String, Failure> {
        self.wait_for(selector, || self.text(selector), |text| satisfies(text))
    }

    /// Looks again and again until what is seen satisfies.
    ///
    /// # Errors
    /// If it does not in [`WAIT_MAX`]; the message says what was seen at last.
    pub fn wait_for<T: fmt::Debug>(
        &self,
        what: &str,
        look: impl Fn() -> Result<T, Failure>,
        satisfies: impl Fn(&T) -> bool,
    ) -> Result<T, Failure> {
        let began = Instant::now();
        loop {
            let seen = look();
            match seen {
                Ok(seen) if satisfies(&seen) => return Ok(seen),
                seen if began.elapsed() > WAIT_MAX => {
                    return Err(format!("{what}: at last {seen:?}").into());
                }
                _ => std::thread::sleep(LOOK_AGAIN),
            }
        }
    }

    /// What the page wrote to its console since this was last asked, errors of loading included.
    ///
    /// # Errors
    /// If the driver does not say.
    pub fn console(&self) -> Result<Vec<String>, Failure> {
        let log = self.command("/se/log", &json!({ "type": "browser" }))?;
        let entries = log.as_array().ok_or("the driver gave no log")?;
        let line = |entry: &Value| {
            let text = |key: &str| entry[key].as_str().unwrap_or_default().to_owned();
            format!("{} {} {}", text("level"), text("source"), text("message"))
        };
        Ok(entries.iter().map(line).collect())
    }

    /// Pretends to have another screen.
    ///
    /// # Errors
    /// If the browser refuses.
    pub fn set_screen(&self, screen: Screen) -> Result<(), Failure> {
        let metrics = json!({
            "width": screen.width, "height": screen.height, "deviceScaleFactor": screen.scale, "mobile": screen.mobile
        });
        self.devtools("Emulation.setDeviceMetricsOverride", &metrics)
    }

    /// Prefers light or dark, as the system's setting would.
    ///
    /// # Errors
    /// If the browser refuses.
    pub fn prefer_scheme(&self, scheme: &str) -> Result<(), Failure> {
        let features = json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] });
        self.devtools("Emulation.setEmulatedMedia", &features)
    }

    /// Keeps what is downloaded in a folder, without asking.
    ///
    /// # Errors
    /// If the browser refuses.
    pub fn download_into(&self, folder: &Path) -> Result<(), Failure> {
        let behavior = json!({ "behavior": "allow", "downloadPath": folder });
        self.devtools("Browser.setDownloadBehavior", &behavior)
    }

    /// What the window shows, as the bytes of a PNG file.
    ///
    /// # Errors
    /// If the driver gives no picture.
    pub fn screenshot(&self) -> Result<Vec<u8>, Failure> {
        let picture = self.ask("/screenshot")?;
        from_base64(picture.as_str().ok_or("the driver gave no picture")?)
    }

    fn devtools(&self, command: &str, parameters: &Value) -> Result<(), Failure> {
        self.command(
            "/goog/cdp/execute",
            &json!({ "cmd": command, "params": parameters }),
        )
        .map(drop)
    }

    fn command(&self, path: &str, body: &Value) -> Result<Value, Failure> {
        let url = format!("{}{path}", self.session_url);
        value_of(self.agent.post(url).send_json(body)?)
    }

    fn ask(&self, path: &str) -> Result<Value, Failure> {
        value_of(
            self.agent
                .get(format!("{}{path}", self.session_url))
                .call()?,
        )
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // Ends the browser; the driver itself is ended by its own drop, whatever this says.
        let _ = self.agent.delete(&self.session_url).call();
    }
}

/// Whether the tests that need a browser are left out; reports it.
#[must_use]
pub fn left_out(test: &str) -> bool {
    let left_out = std::env::var(WITHOUT_BROWSER).is_ok_and(|value| value == "1");
    if left_out {
        crate::skip::test(&format!("{test} in a browser ({WITHOUT_BROWSER}=1)"));
    }
    left_out
}

fn capabilities(profile: &Path) -> Value {
    let arguments = json!([
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-dev-shm-usage",
        "--disable-quic",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--window-size=1280,900",
        format!("--user-data-dir={}", profile.display()),
    ]);
    json!({ "alwaysMatch": {
        "browserName": "chrome",
        "goog:chromeOptions": { "args": arguments },
        "goog:loggingPrefs": { "browser": "ALL" },
    } })
}

fn value_of(mut response: ureq::http::Response<ureq::Body>) -> Result<Value, Failure> {
    let text = response
        .body_mut()
        .with_config()
        .limit(64 << 20)
        .read_to_string()?;
    let mut json: Value = serde_json::from_str(&text)?;
    let value = json["value"].take();
    match value["error"].as_str() {
        Some(error) => {
            Err(format!("{error}: {}", value["message"].as_str().unwrap_or_default()).into())
        }
        None => Ok(value),
    }
}

/// A chromedriver on a port of its own choice.
struct Driver {
    process: Child,
    port: u16,
}

impl Driver {
    /// Again where it ends at once: the port that it finds free for IPv4 may not be free for IPv6.
    fn start() -> Result<Self, Failure> {
        Self::try_start().or_else(|_failure| Self::try_start())
    }

    fn try_start() -> Result<Self, Failure> {
        let started = Command::new("chromedriver")
            .arg("--port=0")
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let mut process = started.map_err(|error| {
            format!(
                "chromedriver does not start: {error}\nhint: apt-get install chromium chromium-driver, or set {WITHOUT_BROWSER}=1 to leave this test out"
            )
        })?;
        let port = match process.stdout.take().map(announced_port) {
            Some(Some(port)) => port,
            _ => 0,
        };
        let driver = Self { process, port };
        if port == 0 {
            return Err("chromedriver did not say on which port it listens".into());
        }
        Ok(driver)
    }
}

/// "ChromeDriver was started successfully on port 41234."
fn announced_port(greeting: impl std::io::Read) -> Option<u16> {
    BufReader::new(greeting)
        .lines()
        .take(GREETING_LINES_MAX)
        .map_while(Result::ok)
        .filter(|line| line.contains("successfully"))
        .find_map(|line| line.rsplit(' ').next()?.trim_end_matches('.').parse().ok())
}

impl Drop for Driver {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// RFC 4648 §4, as the protocol encodes pictures.
fn from_base64(text: &str) -> Result<Vec<u8>, Failure> {
    const ALPHABET: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut held) = (0_u32, 0_u32);
    for letter in text.trim_end_matches('=').bytes() {
        let place = ALPHABET.iter().position(|known| *known == letter);
        let place = u32::try_from(place.ok_or("a picture that is not base64")?)?;
        bits = (bits << 6 | place) & 0xFF_FFFF;
        held += 6;
        if held >= 8 {
            held -= 8;
            bytes.push(u8::try_from(bits >> held & 0xFF)?);
        }
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_decoded_as_the_standard_says() {
        // RFC 4648 §10.
        for (text, bytes) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYmFy", "foobar"),
        ] {
            assert_eq!(from_base64(text).unwrap(), bytes.as_bytes());
        }
        assert!(from_base64("Zm9*").is_err());
    }

    #[test]
    fn the_port_is_found_in_the_greeting() {
        let greeting = "Starting ChromeDriver 156.0 on port 0\nOnly local connections are allowed.\nChromeDriver was started successfully on port 41234.\n";
        assert_eq!(announced_port(greeting.as_bytes()), Some(41234));
        assert_eq!(announced_port("nothing\n".as_bytes()), None);
    }
}
