//! The live page in a real browser, in front of the real program, and frames to show.

use crate::programs::{grideye, terminate, wait};
use crate::webdriver::{Browser, Failure};
use serde_json::{Value, json};
use std::io::{BufRead as _, BufReader};
use std::net::SocketAddr;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{SystemTime, UNIX_EPOCH};

/// What a test of the page comes to.
pub type Outcome = Result<(), Failure>;

/// The cold end of the palette "inferno", from matplotlib's table.
pub const COLDEST: [u64; 3] = [0, 0, 4];
/// The hot end.
pub const HOTTEST: [u64; 3] = [252, 255, 164];

/// A collector, which can be stopped and started again at the same address.
pub struct Server {
    address: SocketAddr,
    running: Option<Child>,
}

impl Server {
    /// A collector at a free port of loopback.
    ///
    /// # Errors
    /// If it does not start.
    pub fn start(store: &Path) -> Result<Self, Failure> {
        let mut server = Self {
            address: ([127, 0, 0, 1], 0).into(),
            running: None,
        };
        server.begin(store)?;
        Ok(server)
    }

    /// Starts it, at the address that it had before.
    ///
    /// # Errors
    /// If it does not start.
    pub fn begin(&mut self, store: &Path) -> Outcome {
        let mut collector = grideye();
        collector
            .args(["collect", "--listen", &self.address.to_string(), "--store"])
            .arg(store)
            // Where there is no folder of scenes, so that the page is the collector's alone.
            .current_dir(store.parent().ok_or("the store is in no folder")?)
            .stdout(Stdio::piped())
            .stderr(Stdio::null());
        let mut running = collector.spawn()?;
        let mut line = String::new();
        let said = running.stdout.take().ok_or("nothing is said")?;
        BufReader::new(said).read_line(&mut line)?;
        self.running = Some(running);
        let address = line.trim().trim_end_matches('/').strip_prefix("http://");
        self.address = address
            .ok_or_else(|| format!("the collector said {line:?}"))?
            .parse()?;
        Ok(())
    }

    /// Stops it, and waits until it has.
    ///
    /// # Errors
    /// If it ends with another exit code than 0.
    pub fn end(&mut self) -> Outcome {
        let mut running = self.running.take().ok_or("the collector is not running")?;
        terminate(&running);
        match wait(&mut running) {
            0 => Ok(()),
            code => Err(format!("the collector ended with {code}").into()),
        }
    }

    /// The address of a path.
    #[must_use]
    pub fn url(&self, path: &str) -> String {
        format!("http://{}{path}", self.address)
    }

    /// What stands at a path.
    ///
    /// # Errors
    /// If it is not JSON.
    pub fn get(&self, path: &str) -> Result<Value, Failure> {
        Ok(ureq::get(self.url(path)).call()?.body_mut().read_json()?)
    }

    /// Posts frames.
    ///
    /// # Errors
    /// If they are refused.
    pub fn post(&self, body: &Value) -> Outcome {
        ureq::post(self.url("/v1/frames")).send_json(body)?;
        Ok(())
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        if let Some(mut running) = self.running.take() {
            // It may have ended by itself.
            let _ = running.kill();
            let _ = running.wait();
        }
    }
}

/// A frame of one temperature, in quarters of a degree, with one other pixel.
#[must_use]
pub fn pixels(all: u16, index: usize, other: u16) -> Vec<u16> {
    let mut pixels = vec![all; 64];
    pixels[index] = other;
    pixels
}

/// Frames of one sensor, each as it stands on the wire but for its times.
#[must_use]
pub fn batch(sensor: &str, first_seq: u64, frames: &[Value]) -> Value {
    let utc_ns = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |since| since.as_nanos());
    let records: Vec<Value> = (first_seq..)
        .zip(frames)
        .map(|(seq, frame)| {
            let mut record = frame.clone();
            record["seq"] = seq.into();
            record["t_boot_ns"] = boot_ns(seq).into();
            record["t_utc_ns"] = u64::try_from(utc_ns).unwrap_or(0).into();
            record["clock"] = "synced".into();
            record
        })
        .collect();
    let sent = boot_ns(first_seq + u64::try_from(frames.len()).unwrap_or(0) - 1);
    json!({
        "device": "pi-1", "boot": "b1", "t_sent_boot_ns": sent,
        "sensors": [{ "sensor": sensor, "frames": records }]
    })
}

/// When a frame was measured, on the device's clock.
#[must_use]
pub fn boot_ns(seq: u64) -> u64 {
    1_000_000_000 + seq * 100_000_000
}

/// A frame as it stands on the wire, without its times.
#[must_use]
pub fn frame(pixels: &[u16], thermistor: u16) -> Value {
    json!({ "pixels_raw": pixels, "thermistor_raw": thermistor })
}

/// Red, green and blue in the middle of a cell of the first sensor's canvas.
///
/// # Errors
/// If there is no picture.
pub fn color(browser: &Browser, index: usize) -> Result<Vec<u64>, Failure> {
    color_in(browser, ".heat", index)
}

/// Red, green and blue in the middle of a cell of the first canvas that a selector finds.
///
/// # Errors
/// If there is none.
pub fn color_in(browser: &Browser, canvas: &str, index: usize) -> Result<Vec<u64>, Failure> {
    // A copy is read, because reading a canvas makes the browser remark on how that could be faster.
    let script = format!(
        "const canvas = document.querySelector('{canvas}');
         const cell = canvas.width / 8;
         const [x, y] = [({index} % 8 + 0.5) * cell, (Math.floor({index} / 8) + 0.5) * cell];
         const copy = Object.assign(document.createElement('canvas'), {{ width: 1, height: 1 }});
         const context = copy.getContext('2d', {{ willReadFrequently: true }});
         context.drawImage(canvas, x, y, 1, 1, 0, 0, 1, 1);
         return Array.from(context.getImageData(0, 0, 1, 1).data.slice(0, 3));"
    );
    let color = browser.execute(&script)?;
    Ok(serde_json::from_value(color)?)
}

/// Whether a color is another one, or as near to it as the spare at the ends of a scale makes it.
#[must_use]
pub fn is_like(seen: &[u64], wanted: [u64; 3]) -> bool {
    const NEAR: u64 = 150;
    seen.iter()
        .zip(wanted)
        .all(|(seen, wanted)| seen.abs_diff(wanted) <= NEAR)
}

/// Waits for a color in the middle of a cell, or one [like](is_like) it.
///
/// # Errors
/// If it does not come.
pub fn wait_for_color(browser: &Browser, index: usize, wanted: [u64; 3]) -> Outcome {
    let what = format!("color of cell {index}, wanted {wanted:?}");
    browser
        .wait_for(
            &what,
            || color(browser, index),
            |seen| is_like(seen, wanted),
        )
        .map(drop)
}

/// Waits until a part of the first sensor's card says something.
///
/// # Errors
/// If it does not.
pub fn field(browser: &Browser, name: &str, wanted: &str) -> Outcome {
    let selector = format!(".sensor [data-field={name}]");
    browser
        .wait_for_text(&selector, |text| text.contains(wanted))
        .map(drop)
}

/// Nothing was written to the console; what is lost while the collector is away is no fault of the page.
///
/// # Errors
/// If the browser does not say.
///
/// # Panics
/// If something was written.
pub fn assert_quiet(browser: &Browser, allowed: &str) -> Outcome {
    let faults: Vec<String> = browser
        .console()?
        .into_iter()
        .filter(|line| allowed.is_empty() || !line.contains(allowed))
        .collect();
    assert_eq!(faults, Vec::<String>::new());
    Ok(())
}

/// Keeps what the window shows, for a person to look at, in the folder that `GRIDEYE_SCREENSHOTS` names.
///
/// # Errors
/// If there is no picture, or no such folder.
pub fn keep_picture(browser: &Browser, name: &str) -> Outcome {
    if let Some(folder) = std::env::var_os("GRIDEYE_SCREENSHOTS") {
        std::fs::write(
            Path::new(&folder).join(format!("{name}.png")),
            browser.screenshot()?,
        )?;
    }
    Ok(())
}

/// Drops a file of this name and text on the page.
///
/// # Errors
/// If the browser refuses.
pub fn drop_file(browser: &Browser, name: &str, text: &str) -> Outcome {
    let (name, text) = (json!(name), json!(text));
    let script = format!(
        "const dataTransfer = new DataTransfer();
         dataTransfer.items.add(new File([{text}], {name}));
         for (const kind of ['dragover', 'drop']) document.body.dispatchEvent(new DragEvent(kind, {{ bubbles: true, cancelable: true, dataTransfer }}));"
    );
    browser.execute(&script).map(drop)
}

/// A server, a browser on its page, and the folder of the store.
///
/// # Errors
/// If one of them does not start.
pub fn set_up() -> Result<(Server, Browser, tempfile::TempDir), Failure> {
    let folder = tempfile::tempdir()?;
    let server = Server::start(&folder.path().join("frames.sqlite"))?;
    let browser = Browser::start()?;
    browser.open(&server.url("/"))?;
    browser.wait_for_text("#link", |text| text == "connected")?;
    Ok((server, browser, folder))
}

/// A warm shape before a wall, in raw words.
#[must_use]
pub fn person() -> Vec<u16> {
    let shape = [
        "00000000", "00022000", "00277200", "00279300", "00389400", "00288300", "00267200",
        "00156100",
    ];
    let cells = shape.iter().flat_map(|row| row.bytes());
    cells
        .enumerate()
        .map(|(index, digit)| {
            84 + u16::from(digit - b'0') * 4 + u16::try_from(index % 3).unwrap_or(0)
        })
        .collect()
}
