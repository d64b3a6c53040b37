//! What a request is told that is not done: `{"error":{"code","message","field","hint"}}`.

use crate::store::StoreError;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Json, Response};
use grideye_recording::wire::WireError;
use serde_json::json;

/// A request that is not done, and what to do about it.
#[derive(Debug)]
pub(super) struct Refusal {
    status: StatusCode,
    code: &'static str,
    message: String,
    field: Option<String>,
    hint: Option<String>,
}

impl Refusal {
    /// `message` may bring its hint along, on a line of its own.
    pub(super) fn new(status: StatusCode, code: &'static str, message: impl Into<String>) -> Self {
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
        }
    }

    pub(super) fn field(mut self, field: impl Into<String>) -> Self {
        self.field = Some(field.into());
        self
    }

    pub(super) fn hint(mut self, hint: impl Into<String>) -> Self {
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
        if self.status == StatusCode::SERVICE_UNAVAILABLE {
            let second = HeaderValue::from_static("1");
            response.headers_mut().insert(header::RETRY_AFTER, second);
        }
        response
    }
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
            StoreError::Locked => (StatusCode::SERVICE_UNAVAILABLE, "store_locked", None),
            StoreError::Busy { .. } => (StatusCode::SERVICE_UNAVAILABLE, "busy", None),
            StoreError::Closed => (StatusCode::SERVICE_UNAVAILABLE, "stopping", None),
            StoreError::NotADatabase
            | StoreError::Foreign
            | StoreError::Newer { .. }
            | StoreError::Unusable { .. }
            | StoreError::Failed(_) => (StatusCode::INTERNAL_SERVER_ERROR, "store_failed", None),
        };
        let refusal = Self::new(status, code, error.to_string());
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
