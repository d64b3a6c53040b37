//! The error response of a rejected request.

use crate::auth::AccessError;
use crate::store::StoreError;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Json, Response};
use grideye_recording::wire::{WireError, WireFault};
use serde_json::json;
use std::fmt;
use std::time::Duration;

/// The code of a rejection, stored in the response for the counters.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RefusedCode(pub(crate) &'static str);

/// Retry time while the store is full: someone must free space first.
const FULL_RETRY: Duration = Duration::from_secs(30);

/// A rejected request, with a hint: `{"error":{"code","message","field","hint"}}`.
#[derive(Debug)]
pub struct Refusal {
    status: StatusCode,
    code: &'static str,
    message: String,
    field: Option<String>,
    hint: Option<String>,
    retry_after: Option<Duration>,
}

impl Refusal {
    /// `message` may contain its hint, after `\nhint: `.
    #[must_use]
    pub fn new(status: StatusCode, code: &'static str, message: impl Into<String>) -> Self {
        let whole = message.into();
        let (message, hint) = match whole.split_once("\nhint: ") {
            Some((message, hint)) => (message.to_owned(), Some(hint.to_owned())),
            None => (whole, None),
        };
        Self {
            status,
            code,
            message,
            field: None,
            hint,
            retry_after: (status == StatusCode::SERVICE_UNAVAILABLE)
                .then_some(Duration::from_secs(1)),
        }
    }

    /// A field of the body has an invalid value.
    pub(crate) fn wrong_value(
        field: impl Into<String>,
        what: impl Into<String>,
        hint: &str,
    ) -> Self {
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, "wrong_value", what)
            .field(field)
            .hint(hint)
    }

    /// Whether the same request may succeed later.
    #[must_use]
    pub fn may_pass(&self) -> bool {
        let is_too_early = self.status == StatusCode::TOO_MANY_REQUESTS;
        is_too_early || self.status.is_server_error()
    }

    /// The part of the request that is wrong.
    #[must_use]
    pub fn field(mut self, field: impl Into<String>) -> Self {
        self.field = Some(field.into());
        self
    }

    /// When to retry, in whole seconds, at least one.
    #[must_use]
    pub fn retry_after(mut self, wait: Duration) -> Self {
        self.retry_after = Some(wait);
        self
    }

    /// What the caller can do.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }
}

/// The message, and its hint on a line of its own.
impl fmt::Display for Refusal {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.message)?;
        let mut hint = self.hint.iter();
        hint.try_for_each(|hint| write!(formatter, "\nhint: {hint}"))
    }
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        let body = json!({ "error": {
            "code": self.code,
            "message": self.message,
            "field": self.field,
            "hint": self.hint,
        } });
        let mut response = (self.status, Json(body)).into_response();
        if let Some(wait) = self.retry_after {
            let seconds = wait.as_secs() + u64::from(wait.subsec_nanos() > 0);
            let seconds = HeaderValue::from(seconds.max(1));
            response.headers_mut().insert(header::RETRY_AFTER, seconds);
        }
        response.extensions_mut().insert(RefusedCode(self.code));
        response
    }
}

const PLAIN_BYTES_MAX: usize = 4096;

/// Rewrites a framework's plain text error in this form.
pub(crate) async fn in_own_form(response: Response) -> Response {
    let kind = response.headers().get(header::CONTENT_TYPE);
    let is_plain = kind.is_some_and(|kind| kind.as_bytes().starts_with(b"text/plain"));
    if !response.status().is_client_error() || !is_plain {
        return response;
    }
    let status = response.status();
    let said = axum::body::to_bytes(response.into_body(), PLAIN_BYTES_MAX).await;
    let said = said.unwrap_or_default();
    Refusal::new(status, "wrong_request", String::from_utf8_lossy(&said)).into_response()
}

impl From<StoreError> for Refusal {
    fn from(error: StoreError) -> Self {
        const CONFLICT: StatusCode = StatusCode::CONFLICT;
        const ABSENT: StatusCode = StatusCode::NOT_FOUND;
        const FULL: StatusCode = StatusCode::INSUFFICIENT_STORAGE;
        const LATER: StatusCode = StatusCode::SERVICE_UNAVAILABLE;
        let (status, code) = match &error {
            StoreError::Conflict { .. } => (CONFLICT, "conflict"),
            StoreError::NameTaken { .. } => (CONFLICT, "name_taken"),
            StoreError::NotRunning { .. } => (CONFLICT, "not_running"),
            StoreError::NumberTooLarge { .. } => {
                (StatusCode::UNPROCESSABLE_ENTITY, "number_too_large")
            }
            StoreError::NoSuchRecording { .. } => (ABSENT, "no_such_recording"),
            StoreError::NoSuchLabel { .. } => (ABSENT, "no_such_label"),
            StoreError::TooManyLabels { .. } => (FULL, "too_many_labels"),
            StoreError::TooManyRecordings { .. } => (FULL, "too_many_recordings"),
            StoreError::Full => (FULL, "disk_full"),
            StoreError::QuotaReached { .. } => (FULL, "quota_reached"),
            StoreError::Locked => (LATER, "store_locked"),
            StoreError::Gone { .. } | StoreError::Overwritten(_) => (LATER, "store_gone"),
            StoreError::Unreachable { .. } => (LATER, "store_unreachable"),
            StoreError::Contended { .. } => (LATER, "contended"),
            StoreError::Busy { .. } => (LATER, "busy"),
            StoreError::Closed => (LATER, "stopping"),
            _ => (StatusCode::INTERNAL_SERVER_ERROR, "store_failed"),
        };
        let field = match &error {
            StoreError::Conflict { .. } => Some("seq"),
            StoreError::NumberTooLarge { field, .. } => Some(*field),
            StoreError::NameTaken { .. } => Some("name"),
            _ => None,
        };
        let mut refusal = Self::new(status, code, error.to_string());
        if matches!(error, StoreError::Full | StoreError::QuotaReached { .. }) {
            refusal = refusal.retry_after(FULL_RETRY);
        }
        refusal.field = field.map(str::to_owned);
        refusal
    }
}

impl From<WireError> for Refusal {
    fn from(error: WireError) -> Self {
        let status = match error.fault {
            WireFault::NotJson | WireFault::Malformed => StatusCode::BAD_REQUEST,
            WireFault::TooMany => StatusCode::PAYLOAD_TOO_LARGE,
            _ => StatusCode::UNPROCESSABLE_ENTITY,
        };
        let refusal = Self::new(status, error.fault.name(), error.to_string()).field(error.path);
        if refusal.hint.is_some() {
            return refusal;
        }
        refusal.hint("nothing of this batch was stored; correct the field and retry")
    }
}

impl From<AccessError> for Refusal {
    fn from(error: AccessError) -> Self {
        let status = StatusCode::INTERNAL_SERVER_ERROR;
        Self::new(status, "access_failed", error.to_string())
    }
}
