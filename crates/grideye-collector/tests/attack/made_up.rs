//! Generated requests: good ones with changes, and known attacks.

use serde_json::{Value, json};

/// Pseudo-random numbers, the same for the same seed (splitmix64, Steele et al. 2014).
pub(crate) struct Dice(u64);

impl Dice {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(crate) fn roll(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// From 0 to `end`, exclusive.
    pub(crate) fn below(&mut self, end: usize) -> usize {
        usize::try_from(self.roll() % u64::try_from(end.max(1)).unwrap()).unwrap()
    }

    pub(crate) fn of<'a, T>(&mut self, all: &'a [T]) -> &'a T {
        &all[self.below(all.len())]
    }
}

pub(crate) const METHODS: [&str; 11] = [
    "GET", "GET", "GET", "POST", "POST", "POST", "PUT", "DELETE", "OPTIONS", "TRACE", "BREW",
];

const PATHS: [&str; 45] = [
    "/",
    "/v1/frames",
    "/v1/frames",
    "/v1/frames",
    "/v1/frames",
    "/v1/recordings",
    "/v1/recordings",
    "/v1/recordings/1",
    "/v1/recordings/1.csv",
    "/v1/recordings/1.frames",
    "/v1/recordings/1/stop",
    "/v1/recordings/1/note",
    "/v1/recordings/-1",
    "/v1/recordings/99999999999999999999999",
    "/v1/recordings/%2e%2e%2f%2e%2e%2fetc%2fpasswd",
    "/v1/recordings/../../etc/passwd",
    "/v1/recordings/1.csv%00.csv",
    "/v1/recordings/' OR 1=1 --.csv",
    "/v1/sensors",
    "/v1/audit",
    "/v1/devices",
    "/v1/devices/pi-1",
    "/v1/devices/..%2f..%2fetc%2fpasswd",
    "/v1/live",
    "/v1/login",
    "/v1/login",
    "/v1/logout",
    "/v1/whoami",
    "/v1/health",
    "/metrics",
    "/healthz",
    "/login",
    "/assets/main.js",
    "/assets/..%2f..%2fCargo.toml",
    "/assets/../../../../etc/passwd",
    "/assets/%2e%2e/%2e%2e/etc/passwd",
    "/assets/..\\..\\etc\\passwd",
    "/assets/%c0%ae%c0%ae/passwd",
    "/%00",
    "//evil.example/",
    "/v1//frames",
    "/V1/FRAMES",
    "/v1/frames/",
    "/v1/frames;x=1",
    "/.git/config",
];

const HEADERS: [(&str, &str); 28] = [
    ("host", "127.0.0.1:8080"),
    ("host", "evil.example"),
    ("host", "127.0.0.1:8080, evil.example"),
    ("host", ""),
    ("origin", "http://evil.example"),
    ("origin", "null"),
    ("origin", "http://127.0.0.1:8080"),
    ("content-type", "application/json"),
    ("content-type", "text/plain"),
    ("content-type", "application/json; charset=utf-7"),
    ("content-type", "multipart/form-data; boundary=x"),
    ("content-length", "99999999999999999999"),
    ("content-length", "-1"),
    ("content-length", "0"),
    ("content-encoding", "gzip"),
    ("transfer-encoding", "chunked"),
    ("authorization", "Bearer"),
    ("authorization", "Basic cm9vdDpyb290"),
    (
        "authorization",
        "Bearer grideye-000000000000-0000000000000000000000000000000000000000000000000000000000000000",
    ),
    ("cookie", "grideye-session=000000000000.99999999999.00"),
    (
        "cookie",
        "grideye-session=; grideye-session=x; __Host-grideye-session=y",
    ),
    ("accept", "text/html"),
    ("range", "bytes=0-0,1-1,2-2"),
    ("x-forwarded-for", "127.0.0.1"),
    ("x-http-method-override", "DELETE"),
    ("expect", "100-continue"),
    ("upgrade", "websocket"),
    ("if-none-match", "*"),
];

/// A path: a known one, one with a suffix, or random bytes.
pub(crate) fn path(dice: &mut Dice) -> String {
    let mut path = (*dice.of(&PATHS)).to_owned();
    match dice.below(12) {
        0 => path.push_str("?token=x&a[]=1&a[]=2&%00=%ff"),
        1 => path.extend(std::iter::repeat_n("/a", dice.below(2000))),
        2 => {
            path = "/".to_owned();
            for _ in 0..dice.below(40) {
                path.push_str(&format!("%{:02x}", dice.below(256)));
            }
        }
        _ => {}
    }
    path.replace(' ', "%20")
        .replace('\\', "%5c")
        .replace('\'', "%27")
}

pub(crate) fn headers(dice: &mut Dice) -> Vec<(&'static str, String)> {
    let mut headers = Vec::new();
    if dice.below(8) > 0 {
        headers.push(("host", "127.0.0.1:8080".to_owned()));
    }
    for _ in 0..dice.below(4) {
        let (name, value) = *dice.of(&HEADERS);
        headers.push((name, value.to_owned()));
    }
    if dice.below(50) == 0 {
        headers.push(("x-long", "y".repeat(dice.below(10_000))));
    }
    headers
}

/// A body: good, with changed values, with changed bytes, or arbitrary.
pub(crate) fn body(dice: &mut Dice) -> Vec<u8> {
    match dice.below(10) {
        0 => good(dice).to_string().into_bytes(),
        1..=3 => {
            let mut body = good(dice);
            change_a_value(&mut body, dice);
            body.to_string().into_bytes()
        }
        4..=6 => {
            let mut bytes = good(dice).to_string().into_bytes();
            change_bytes(&mut bytes, dice);
            bytes
        }
        7 => {
            let opening = *dice.of(&["[", "{\"a\":", "{\"sensors\":[", "[[{\"x\":"]);
            opening.repeat(dice.below(5000)).into_bytes()
        }
        8 => (0..dice.below(300)).map(|_| byte(dice)).collect(),
        _ => Vec::new(),
    }
}

fn byte(dice: &mut Dice) -> u8 {
    u8::try_from(dice.roll() & 255).unwrap()
}

/// As a device, a page or a person would send it. Sequence numbers are few, so that the store stays small.
fn good(dice: &mut Dice) -> Value {
    match dice.below(8) {
        0 => json!({ "token": "grideye-000000000000-00" }),
        1 => {
            json!({ "name": *dice.of(&["kitchen", "../../etc/passwd", "=1+1", "a\u{202e}b", "x\r\ny: z", ""]) })
        }
        _ => {
            let frames: Vec<Value> = (0..dice.below(4)).map(|seq| frame(seq, dice)).collect();
            json!({
                "device": *dice.of(&["pi-2", "pi-2", "pi-1", "pi-3"]),
                "boot": *dice.of(&["b1", "b2"]),
                "t_sent_boot_ns": 1,
                "sensors": [{
                    "sensor": *dice.of(&["s1", "i2c-1:0x69"]),
                    "account": { "read": 3, "missing": 0, "dropped": {}, "spooled": 0, "errors": { "nack": 1 } },
                    "frames": frames,
                }],
            })
        }
    }
}

fn frame(seq: usize, dice: &mut Dice) -> Value {
    // One content per number, except for an intended conflict now and then.
    let word = if dice.below(10) == 0 { 81 } else { 80 };
    json!({
        "seq": seq, "t_boot_ns": 5, "t_utc_ns": 6, "clock": "synced",
        "thermistor_raw": 402, "pixels_raw": vec![word; 64],
    })
}

/// Replaces a value anywhere in the body.
fn change_a_value(body: &mut Value, dice: &mut Dice) {
    let inner = match body {
        Value::Array(all) if !all.is_empty() && dice.below(5) > 0 => {
            let at = dice.below(all.len());
            all.get_mut(at)
        }
        Value::Object(all) if !all.is_empty() && dice.below(5) > 0 => {
            let at = dice.below(all.len());
            all.values_mut().nth(at)
        }
        _ => None,
    };
    if let Some(inner) = inner {
        return change_a_value(inner, dice);
    }
    *body = match dice.below(12) {
        0 => Value::Null,
        1 => json!(-1),
        2 => json!(u64::MAX),
        3 => json!(1e308),
        4 => json!(0.5),
        5 => json!(true),
        6 => json!("x".repeat(dice.below(5000))),
        7 => json!([]),
        8 => json!({ "": [] }),
        9 => json!("\u{0}\u{ffff}\r\n"),
        10 => json!(vec![80; dice.below(5000)]),
        _ => json!(9_223_372_036_854_775_807_u64),
    };
}

fn change_bytes(bytes: &mut Vec<u8>, dice: &mut Dice) {
    for _ in 0..=dice.below(4) {
        let at = dice.below(bytes.len());
        match dice.below(5) {
            0 => bytes.truncate(at),
            1 if at < bytes.len() => bytes[at] = byte(dice),
            2 => bytes.insert(at.min(bytes.len()), byte(dice)),
            3 if at < bytes.len() => drop(bytes.remove(at)),
            _ => {
                let piece = bytes[..at].to_vec();
                bytes.extend_from_slice(&piece);
            }
        }
    }
}
