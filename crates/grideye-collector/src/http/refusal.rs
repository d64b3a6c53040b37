//! What a request is told that is not done: `{"error":{"code","message","field","hint"}}`.

use crate::auth::AccessError;
use crate::store::StoreError;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Json, Response};
use grideye_recording::wire::WireError;
use serde_json::json;
use std::time::Duration;

/// Why an answer is a refusal, for the counters; carried by the response.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RefusedCode(pub(crate) &'static str);

/// How long who was told that the store is full should wait: somebody has to make room first.
const FULL_RETRY: Duration = Duration::from_secs(30);

/// A request that is not done, and what to do about it: `{"error":{"code","message","field","hint"}}`.
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
    /// `message` may bring its hint along, on a line of its own.
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

    /// What in the request is at fault.
    #[must_use]
    pub fn field(mut self, field: impl Into<String>) -> Self {
        self.field = Some(field.into());
        self
    }

    /// When to come again, in whole seconds and at least one.
    #[must_use]
    pub fn retry_after(mut self, wait: Duration) -> Self {
        self.retry_after = Some(wait);
        self
    }

    /// What to do about it.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
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

/// Bytes of a text in which a framework refuses.
const PLAIN_BYTES_MAX: usize = 4096;

/// A refusal in the form of all others, where a framework wrote one as plain text.
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
        let (status, code, field) = match &error {
            StoreError::Conflict { .. } => (StatusCode::CONFLICT, "conflict", Some("seq")),
            StoreError::NumberTooLarge { field, .. } => (
                StatusCode::UNPROCESSABLE_ENTITY,
                "number_too_large",
                Some(*field),
            ),
            StoreError::NameTaken { .. } => (StatusCode::CONFLICT, "name_taken", Some("name")),
            StoreError::NoSuchRecording { .. } => {
                (StatusCode::NOT_FOUND, "no_such_recording", None)
            }
            StoreError::NoSuchLabel { .. } => (StatusCode::NOT_FOUND, "no_such_label", None),
            StoreError::TooManyLabels { .. } => {
                (StatusCode::INSUFFICIENT_STORAGE, "too_many_labels", None)
            }
            StoreError::NotRunning { .. } => (StatusCode::CONFLICT, "not_running", None),
            StoreError::TooManyStreams { .. } => {
                (StatusCode::INSUFFICIENT_STORAGE, "too_many_streams", None)
            }
            StoreError::TooManyRecordings { .. } => (
                StatusCode::INSUFFICIENT_STORAGE,
                "too_many_recordings",
                None,
            ),
            StoreError::Full => (StatusCode::INSUFFICIENT_STORAGE, "disk_full", None),
            StoreError::QuotaReached { .. } => {
                (StatusCode::INSUFFICIENT_STORAGE, "quota_reached", None)
            }
            StoreError::Locked => (StatusCode::SERVICE_UNAVAILABLE, "store_locked", None),
            StoreError::Gone { .. } => (StatusCode::SERVICE_UNAVAILABLE, "store_gone", None),
            StoreError::Unreachable { .. } => {
                (StatusCode::SERVICE_UNAVAILABLE, "store_unreachable", None)
            }
            StoreError::Contended { .. } => (StatusCode::SERVICE_UNAVAILABLE, "contended", None),
            StoreError::Busy { .. } => (StatusCode::SERVICE_UNAVAILABLE, "busy", None),
            StoreError::Closed => (StatusCode::SERVICE_UNAVAILABLE, "stopping", None),
            StoreError::NotADatabase
            | StoreError::Foreign
            | StoreError::Unfinished
            | StoreError::NotEmpty
            | StoreError::Newer { .. }
            | StoreError::Older { .. }
            | StoreError::NoRoomForBackup { .. }
            | StoreError::BackupInTheWay { .. }
            | StoreError::Unusable { .. }
            | StoreError::Failed(_) => (StatusCode::INTERNAL_SERVER_ERROR, "store_failed", None),
        };
        let mut refusal = Self::new(status, code, error.to_string());
        if matches!(error, StoreError::Full | StoreError::QuotaReached { .. }) {
            refusal = refusal.retry_after(FULL_RETRY);
        }
        match field {
            Some(field) => refusal.field(field),
            None => refusal,
        }
    }
}

impl From<WireError> for Refusal {
    fn from(error: WireError) -> Self {
        let (status, code) = match &error {
            WireError::NotJson { .. } => (StatusCode::BAD_REQUEST, "not_json"),
            WireError::Malformed { .. } => (StatusCode::BAD_REQUEST, "malformed"),
            WireError::TooMany { .. } => (StatusCode::PAYLOAD_TOO_LARGE, "too_many"),
            WireError::UnknownField { .. } => (StatusCode::UNPROCESSABLE_ENTITY, "unknown_field"),
            WireError::MissingField { .. } => (StatusCode::UNPROCESSABLE_ENTITY, "missing_field"),
            WireError::Repeated { .. } => (StatusCode::UNPROCESSABLE_ENTITY, "repeated"),
            WireError::WrongValue { .. } => (StatusCode::UNPROCESSABLE_ENTITY, "wrong_value"),
        };
        let refusal = Self::new(status, code, error.to_string()).field(error.path());
        if refusal.hint.is_some() {
            return refusal;
        }
        refusal.hint("nothing of this batch was stored; correct the field and send it again")
    }
}

impl From<AccessError> for Refusal {
    fn from(error: AccessError) -> Self {
        Self::new(
            StatusCode::INTERNAL_SERVER_ERROR,
            "access_failed",
            error.to_string(),
        )
    }
}
