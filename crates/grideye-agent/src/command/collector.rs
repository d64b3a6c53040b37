//! What the collector is asked while the agent joins, in the agent's own way.

use super::exit::BadUsage;
use grideye_agent::advice;
use grideye_agent::deliver::transport::{self, signed};
use grideye_agent::join::Credentials;
use grideye_recording::wire::{Batch, JSON_TYPE};
use serde_json::Value;
use std::time::Duration;

/// How long the collector may take to answer while the agent joins.
pub(super) const TIMEOUT: Duration = Duration::from_secs(10);

/// The boot of the batch that proves a token: no frame ever comes of it.
const BOOT: &str = "join";

/// Status and body of a GET.
pub(super) fn get(
    collector: &str,
    credentials: &Credentials,
    path: &str,
) -> anyhow::Result<(u16, Value)> {
    let client = transport::client(credentials, TIMEOUT).map_err(BadUsage)?;
    let request = client.get(format!("{collector}{path}"));
    answer(
        collector,
        signed(request, credentials.token.as_ref()).call(),
    )
}

/// Status and answer of a post of frames.
fn post(collector: &str, credentials: &Credentials, batch: &Batch) -> anyhow::Result<(u16, Value)> {
    let client = transport::client(credentials, TIMEOUT).map_err(BadUsage)?;
    let request = client.post(format!("{collector}/v1/frames"));
    let request = signed(request, credentials.token.as_ref()).header("content-type", JSON_TYPE);
    answer(collector, request.send(batch.to_json()?))
}

fn answer(
    collector: &str,
    answered: Result<ureq::http::Response<ureq::Body>, ureq::Error>,
) -> anyhow::Result<(u16, Value)> {
    let mut response = answered.map_err(|error| {
        anyhow::anyhow!("{collector}: {error}{}", advice::network::hint(&error))
    })?;
    let status = response.status().as_u16();
    let text = response.body_mut().read_to_string().unwrap_or_default();
    Ok((status, serde_json::from_str(&text).unwrap_or_default()))
}

/// Proves that this device's frames are taken: posts a batch without frames, as the agent posts them with.
pub(super) fn prove(
    collector: &str,
    credentials: &Credentials,
    device: &str,
) -> anyhow::Result<&'static str> {
    let empty = Batch {
        device: device.to_owned(),
        boot: BOOT.to_owned(),
        t_sent_boot_ns: None,
        sensors: Vec::new(),
    };
    let (status, answer) = post(collector, credentials, &empty)?;
    let error = &answer["error"];
    match (status, error["code"].as_str()) {
        (200, _) if answer["durable_through"].is_object() => Ok(match credentials.token {
            Some(_) => "its frames are taken",
            None => "anybody's frames are taken there",
        }),
        (401, _) => anyhow::bail!(
            "{collector}: the token is not, or no longer, known there\nhint: print a new line with `grideye enroll {device}`"
        ),
        (403, Some("foreign_device")) => anyhow::bail!(
            "{collector}: this token is for another device, and this one is called {device}\nhint: print a line with `grideye enroll {device}`, or set `device` in agent.toml to the name that the token is for"
        ),
        (403, Some("wrong_scope")) => anyhow::bail!(
            "{collector}: this token is not for frames\nhint: print a line with `grideye enroll {device}`"
        ),
        (_, Some(_)) => anyhow::bail!(
            "{collector}: answered {status}: {}\nhint: {}",
            error["message"].as_str().unwrap_or_default(),
            error["hint"]
                .as_str()
                .unwrap_or("see the collector's log, and paste the line again")
        ),
        (_, None) => anyhow::bail!(
            "{collector}: answered {status}, which no collector does\nhint: is this the address of `grideye collect`?"
        ),
    }
}
