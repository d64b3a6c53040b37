//! An agent's count as JSON: how the store keeps it and the pages show it.

use crate::store::StoreError;
use grideye_recording::wire::Account;
use serde_json::{Value, json};
use std::collections::BTreeMap;

pub(crate) fn to_json(account: &Account) -> Value {
    json!({
        "read": account.read,
        "missing": account.missing,
        "dropped": account.dropped,
        "spooled": account.spooled,
        "errors": account.errors,
    })
}

/// From what [`to_json`] wrote.
pub(crate) fn from_json(text: &str) -> Result<Account, StoreError> {
    let damaged = || StoreError::Failed(format!("the store holds a count that is none: {text}"));
    let json: Value = serde_json::from_str(text).map_err(|_no_json| damaged())?;
    let number = |name: &str| json[name].as_u64().ok_or_else(damaged);
    let by_reason = |name: &str| -> Result<BTreeMap<String, u64>, StoreError> {
        let counts = json[name].as_object().ok_or_else(damaged)?;
        counts
            .iter()
            .map(|(reason, count)| Ok((reason.clone(), count.as_u64().ok_or_else(damaged)?)))
            .collect()
    };
    Ok(Account {
        read: number("read")?,
        missing: number("missing")?,
        dropped: by_reason("dropped")?,
        spooled: number("spooled")?,
        errors: by_reason("errors")?,
    })
}
