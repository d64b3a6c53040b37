//! `grideye enroll` and `grideye token`: who may do what at a collector. They change the folder, not the collector.

use crate::cli::{Enroll, TokenList, TokenMake, TokenRevoke, TokenWhat};
use crate::exit::{Outcome, bad_input};
use crate::files;
use crate::output::outln;
use crate::progress;
use anyhow::{Context as _, Result, anyhow};
use grideye_agent::join::{JoinLine, Pin, Secret};
use grideye_collector::auth::{AccessError, AccessFolder, Address, Scope, Token, TokenRecord};
use serde_json::json;
use std::collections::BTreeSet;
use std::fs::OpenOptions;
use std::io::{self, Write as _};
use std::net::{IpAddr, UdpSocket};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

const PORT: u16 = 8833;
const PEM_BYTES_MAX: u64 = 64 * 1024;

pub(crate) fn enroll(options: &Enroll) -> Result<Outcome> {
    let folder = AccessFolder::new(&options.folder.path);
    let devices: BTreeSet<String> = options.devices.iter().cloned().collect();
    let first = options.devices.first().cloned().unwrap_or_default();
    let address = address(options, &folder)?;
    // The address is checked before a token is made; the names are checked as it is made.
    let mut line = JoinLine {
        collector: address.url,
        device: None,
        token: None,
        pin: address.pin.map(|pin| pin.parse::<Pin>()).transpose()?,
    };
    line.reveal().parse::<JoinLine>().map_err(|_not_one| {
        bad_input(anyhow!(
            "{} is no address that an agent can join\nhint: --url https://HOST:PORT, as the agent calls the collector",
            line.collector
        ))
    })?;
    let is_alone = devices.len() == 1;
    if options.esp32 && !is_alone {
        let what =
            "--esp32 is for one device\nhint: `grideye enroll DEVICE --esp32` for each of them";
        return Err(bad_input(anyhow!(what)));
    }
    let authority = match &line.pin {
        Some(pin) if options.esp32 => Some(authority_pem(options, &folder, pin)?),
        _ => None,
    };
    if is_loopback(&line.collector) {
        progress::say(
            "this address reaches the collector only from this machine; for other machines, start it with --listen ADDR and give that address with --url",
        );
    }
    let note = match (options.esp32, options.json) {
        (true, _) => "this holds a secret: keep it out of repositories",
        (_, true) => "this holds its code",
        _ => "paste this line on the Raspberry Pi:",
    };
    hand_out(options.out.as_deref(), note, || {
        let token = make(&folder, &first, Scope::Ingest { devices })?;
        if options.url.is_some() {
            let (url, pin) = (
                line.collector.clone(),
                line.pin.as_ref().map(Pin::to_string),
            );
            // Of another certificate than its own the collector knows the pin alone.
            let pin = pin.or(folder.address()?.and_then(|known| known.pin));
            folder.set_address(&Address { url, pin })?;
        }
        line.device = is_alone.then_some(first);
        line.token = Some(Secret::new(&token.reveal())?);
        let text = match (options.esp32, options.json) {
            (true, _) => header(&line, authority.as_deref()),
            (_, true) => enrolled(options, &line, &token),
            _ => line.command(),
        };
        Ok((token, text))
    })
}

fn enrolled(options: &Enroll, line: &JoinLine, token: &Token) -> String {
    let enrolled = json!({
        "collector": line.collector,
        "devices": options.devices,
        "token_id": token.id().to_string(),
        "code": line.reveal(),
        "command": line.command(),
    });
    enrolled.to_string()
}

pub(crate) fn token(what: &TokenWhat) -> Result<Outcome> {
    match what {
        TokenWhat::Make(options) => make_token(options),
        TokenWhat::List(options) => list(options),
        TokenWhat::Revoke(options) => revoke(options),
    }
}

/// The address of this machine on its network, as others call it; no packet is sent to find it.
pub(crate) fn outward_address() -> Option<IpAddr> {
    // TEST-NET-1 (RFC 5737): a connected UDP socket learns its own address from the route, and stays silent.
    let socket = UdpSocket::bind("0.0.0.0:0").ok()?;
    socket.connect("192.0.2.1:9").ok()?;
    let address = socket.local_addr().ok()?.ip();
    (!address.is_unspecified()).then_some(address)
}

fn make_token(options: &TokenMake) -> Result<Outcome> {
    let folder = AccessFolder::new(&options.folder.path);
    hand_out(options.out.as_deref(), "it is shown this once", || {
        let token = make(&folder, &options.name, options.scope.clone())?;
        let text = token.reveal();
        Ok((token, text))
    })
}

/// Prints a new token, in its text, or writes it to a file that is there before the token is.
fn hand_out(
    out: Option<&Path>,
    note: &str,
    make: impl FnOnce() -> Result<(Token, String)>,
) -> Result<Outcome> {
    let Some(path) = out else {
        let (token, text) = make()?;
        progress::say(&format!("token {} made; {note}", token.id()));
        outln!("{text}")?;
        return Ok(Outcome::Done);
    };
    let mut file = create(path)?;
    let written = make().and_then(|(token, text)| {
        writeln!(file, "{text}")
            .and_then(|()| file.sync_all())
            .with_context(|| {
                format!(
                    "cannot write {}\nhint: is there room on the disk?",
                    path.display()
                )
            })?;
        Ok(token)
    });
    if written.is_err() {
        // A file without a token is useless, so it goes. The first error is the one to report.
        drop(std::fs::remove_file(path));
    }
    outln!("token {} written to {}", written?.id(), path.display())?;
    Ok(Outcome::Done)
}

fn list(options: &TokenList) -> Result<Outcome> {
    let book = AccessFolder::new(&options.folder.path).book()?;
    if options.json {
        let records = book.records().iter();
        let tokens: Vec<_> = records.map(|record| as_json(record)).collect();
        outln!("{}", serde_json::to_string_pretty(&tokens)?)?;
        return Ok(Outcome::Done);
    }
    if book.is_empty() {
        outln!("no token yet")?;
        return Ok(Outcome::Done);
    }
    outln!("token         made (UTC)        state    scope   name  devices")?;
    for record in book.records() {
        let state = record.t_revoked_s.map_or("good", |_| "revoked");
        let (id, name, made) = (&record.id, &record.name, minute(record.t_made_s));
        let (scope, devices) = (record.scope.name(), devices(record).join(" "));
        outln!("{id}  {made}  {state:7}  {scope:6}  {name}  {devices}")?;
    }
    Ok(Outcome::Done)
}

/// `2026-11-30 17:05`.
fn minute(t_s: i64) -> String {
    let (year, month, day) = grideye_frame::day_of(t_s.div_euclid(86_400));
    let minutes = t_s.rem_euclid(86_400) / 60;
    let (hour, minute) = (minutes / 60, minutes % 60);
    format!("{year}-{month:02}-{day:02} {hour:02}:{minute:02}")
}

fn revoke(options: &TokenRevoke) -> Result<Outcome> {
    let folder = AccessFolder::new(&options.folder.path);
    let revoked = folder.change(|book| book.revoke(&options.named, now_s()));
    for record in revoked.map_err(told)? {
        outln!("revoked {} ({})", record.id, record.name)?;
    }
    Ok(Outcome::Done)
}

fn make(folder: &AccessFolder, name: &str, scope: Scope) -> Result<Token> {
    let made = folder.change(|book| book.add(name, scope, now_s()));
    made.map_err(told)
}

/// An invalid name is bad input; a folder that cannot be written is a failure.
fn told(error: AccessError) -> anyhow::Error {
    match error {
        AccessError::Refused(_) => bad_input(error),
        AccessError::Failed(_) => error.into(),
    }
}

/// The collector's address for the agent: the given one, else the last that was given or that it was started with, else
/// this machine's.
fn address(options: &Enroll, folder: &AccessFolder) -> Result<Address> {
    let recorded = folder.address()?.unwrap_or_else(|| {
        let here = outward_address().unwrap_or(IpAddr::from([127, 0, 0, 1]));
        let (url, pin) = (url_of("https", here, PORT), None);
        Address { url, pin }
    });
    let named = options
        .url
        .as_deref()
        .map(|url| url.trim_end_matches('/').to_owned());
    let url = named.unwrap_or(recorded.url);
    let pin = match (&options.authority, recorded.pin) {
        _ if !url.starts_with("https://") => None,
        (Some(path), _) => Some(grideye_collector::pin_of_file(path).map_err(bad_input)?),
        (None, Some(pin)) => Some(pin),
        (None, None) => Some(folder.authority()?.pin()),
    };
    Ok(Address { url, pin })
}

/// The authority's certificate, which must be the one that agents pin.
fn authority_pem(options: &Enroll, folder: &AccessFolder, pin: &Pin) -> Result<String> {
    if let Some(path) = &options.authority {
        return Ok(String::from_utf8(files::short(path, PEM_BYTES_MAX)?)?);
    }
    let authority = folder.authority()?;
    if authority.pin() != pin.to_string() {
        return Err(bad_input(anyhow!(
            "the collector's last start used another authority than its own\nhint: --authority FILE, the certificate (PEM) that it signs with"
        )));
    }
    Ok(authority.certificate_pem().to_owned())
}

/// The header file of the ESP32's sketch.
fn header(line: &JoinLine, authority: Option<&str>) -> String {
    let quoted = |text: &str| format!("\"{text}\"");
    let lines = authority.unwrap_or_default().lines();
    let pem: Vec<String> = lines.map(|line| format!(" \\\n  \"{line}\\n\"")).collect();
    let defines = [
        ("URL", quoted(&line.collector)),
        ("DEVICE", quoted(line.device.as_deref().unwrap_or_default())),
        (
            "TOKEN",
            quoted(line.token.as_ref().map_or("", Secret::reveal)),
        ),
        (
            "AUTHORITY",
            if pem.is_empty() {
                quoted("")
            } else {
                pem.concat()
            },
        ),
    ];
    let defines = defines.map(|(name, value)| format!("#define COLLECTOR_{name} {value}\n"));
    format!(
        "// Made by `grideye enroll --esp32`. It holds a secret.\n#pragma once\n{}",
        defines.concat()
    )
}

/// `https://HOST:PORT`, with brackets around an address of version 6.
pub(crate) fn url_of(scheme: &str, address: IpAddr, port: u16) -> String {
    format!("{scheme}://{}", std::net::SocketAddr::new(address, port))
}

fn is_loopback(url: &str) -> bool {
    let host = url.split("://").nth(1).unwrap_or_default();
    let mut loopback = ["127.", "localhost:", "[::1]:"].iter();
    loopback.any(|loopback| host.starts_with(loopback))
}

fn devices(record: &TokenRecord) -> Vec<String> {
    match &record.scope {
        Scope::Ingest { devices } => devices.iter().cloned().collect(),
        Scope::Read | Scope::Admin => Vec::new(),
    }
}

fn as_json(record: &TokenRecord) -> serde_json::Value {
    json!({
        "id": record.id.to_string(),
        "name": record.name,
        "scope": record.scope.name(),
        "devices": devices(record),
        "t_made_s": record.t_made_s,
        "t_revoked_s": record.t_revoked_s,
    })
}

/// Creates a file that only its owner can read. Never replaces one, because its token may be in use.
fn create(path: &Path) -> Result<std::fs::File> {
    let created = OpenOptions::new()
        .write(true)
        .create_new(true)
        .mode(0o600)
        .open(path);
    created.map_err(|error| {
        let hint = match error.kind() {
            io::ErrorKind::AlreadyExists => "name a file that is not there yet",
            _ => "name a file in a folder of your own",
        };
        bad_input(anyhow!(
            "cannot make {}: {error}\nhint: {hint}",
            path.display()
        ))
    })
}

fn now_s() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |since| since.as_secs().try_into().unwrap_or(i64::MAX))
}
