//! What the collector is asked while the agent joins, in the agent's own way.

use super::TIMEOUT;
use crate::BadUsage;
use grideye_agent::join::Credentials;
use grideye_agent::transport;
use serde_json::Value;

/// Status and body of a GET.
pub(super) fn get(
    collector: &str,
    credentials: &Credentials,
    path: &str,
) -> anyhow::Result<(u16, Value)> {
    let client = transport::client(credentials, TIMEOUT).map_err(BadUsage)?;
    let mut request = client.get(format!("{collector}{path}"));
    if let Some(token) = &credentials.token {
        request = request.header("authorization", format!("Bearer {}", token.reveal()));
    }
    let mut response = request
        .call()
        .map_err(|error| anyhow::anyhow!("{collector}: {error}{}", transport::hint(&error)))?;
    let status = response.status().as_u16();
    let text = response.body_mut().read_to_string().unwrap_or_default();
    Ok((status, serde_json::from_str(&text).unwrap_or_default()))
}

/// Asks the collector what the token allows.
pub(crate) fn whoami(collector: &str, credentials: &Credentials) -> anyhow::Result<String> {
    let (status, answer) = get(collector, credentials, "/v1/whoami")?;
    if status == 401 {
        anyhow::bail!(
            "{collector}: the token is not, or no longer, known there\nhint: print a new line with `grideye enroll DEVICE`"
        );
    }
    match answer["scope"].as_str() {
        Some("ingest") => Ok("its frames are taken".to_owned()),
        Some("open") => Ok("anybody's frames are taken there".to_owned()),
        Some(other) => anyhow::bail!(
            "{collector}: this token is for {other}, not for frames\nhint: print a line with `grideye enroll DEVICE`"
        ),
        None => anyhow::bail!(
            "{collector}: answered {status}, which no collector does\nhint: is this the address of `grideye collect`?"
        ),
    }
}
