//! A page that follows `GET /v1/live`.

use crate::server::{Server, request};
use axum::body::Body;
use axum::http::{Method, StatusCode, header};
use serde_json::Value;
use tokio_stream::StreamExt;
use tower::ServiceExt;

/// One client of the events.
pub(super) struct Client {
    body: axum::body::BodyDataStream,
    text: String,
}

impl Client {
    pub(super) async fn of(server: &Server) -> Self {
        let response = server
            .router
            .clone()
            .oneshot(request(Method::GET, "/v1/live", Body::empty()))
            .await
            .unwrap();
        assert_eq!(response.status(), StatusCode::OK);
        assert_eq!(
            response.headers()[header::CONTENT_TYPE],
            "text/event-stream"
        );
        Self {
            body: response.into_body().into_data_stream(),
            text: String::new(),
        }
    }

    /// The next event's name and data.
    pub(super) async fn next(&mut self) -> (String, Value) {
        while !self.text.contains("\n\n") {
            let piece = self.body.next().await.unwrap().unwrap();
            self.text.push_str(std::str::from_utf8(&piece).unwrap());
        }
        let whole = std::mem::take(&mut self.text);
        let (event, rest) = whole.split_once("\n\n").unwrap();
        self.text = rest.to_owned();
        let field = |name: &str| {
            event
                .lines()
                .find_map(|line| line.strip_prefix(name))
                .unwrap()
                .trim()
                .to_owned()
        };
        (
            field("event:"),
            serde_json::from_str(&field("data:")).unwrap(),
        )
    }
}
