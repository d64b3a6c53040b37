//! The OpenAPI 3.1 document.

use crate::http::Annex;
use axum::body::Bytes;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

/// The OpenAPI 3.1 document with the paths of the annexes.
///
/// # Panics
/// If an annex's description is not a JSON object.
pub(crate) fn openapi(annexes: &[Annex]) -> Bytes {
    let mut document: Value = part_of_openapi(include_str!("../openapi.json"));
    for annex in annexes {
        let paths: Map<String, Value> = part_of_openapi(annex.described);
        for (path, methods) in paths {
            document["paths"][path] = methods;
        }
    }
    document.to_string().into()
}

#[expect(clippy::expect_used, reason = "it is a part of the program")]
fn part_of_openapi<T: DeserializeOwned>(json: &str) -> T {
    serde_json::from_str(json).expect("a part of an OpenAPI document")
}
