//! Small bodies: one JSON object of known fields.

use crate::app::answer::Refusal;
use axum::http::StatusCode;
use serde_json::{Map, Value};

/// The object in the body, which may have these fields and nests at most so deep.
pub(super) fn object(
    body: &[u8],
    depth_max: usize,
    fields: &[&str],
    hint: &str,
) -> Result<Map<String, Value>, Refusal> {
    if depth(body) > depth_max {
        let what = format!("the body nests more than {depth_max} deep");
        return Err(Refusal::new(StatusCode::BAD_REQUEST, "too_deep", what)
            .field("body")
            .hint(hint));
    }
    let json: Value = serde_json::from_slice(body).map_err(|error| {
        let what = format!("the body is not JSON: {error}");
        Refusal::new(StatusCode::BAD_REQUEST, "not_json", what)
            .field("body")
            .hint(hint)
    })?;
    let Value::Object(object) = json else {
        let what = format!("expected an object with {}", fields.join(", "));
        return Err(
            Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, "wrong_value", what)
                .field(fields.first().copied().unwrap_or("body"))
                .hint(hint),
        );
    };
    match object.keys().find(|key| !fields.contains(&key.as_str())) {
        None => Ok(object),
        Some(unknown) => {
            let shown: String = unknown.chars().take(64).collect();
            let what = format!(
                "unknown field {shown:?}; expected only {}",
                fields.join(", ")
            );
            Err(
                Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, "wrong_value", what)
                    .field(shown)
                    .hint(hint),
            )
        }
    }
}

/// How deep arrays and objects are nested, whether they are closed or not.
fn depth(json: &[u8]) -> usize {
    let (mut now, mut deepest) = (0_usize, 0);
    let (mut in_string, mut escaped) = (false, false);
    for byte in json {
        if in_string {
            match byte {
                _ if escaped => escaped = false,
                b'\\' => escaped = true,
                b'"' => in_string = false,
                _ => {}
            }
            continue;
        }
        match byte {
            b'"' => in_string = true,
            b'[' | b'{' => {
                now += 1;
                deepest = deepest.max(now);
            }
            b']' | b'}' => now = now.saturating_sub(1),
            _ => {}
        }
    }
    deepest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_is_that_of_brackets_outside_of_strings() {
        for (json, deep) in [
            ("1", 0),
            ("{}", 1),
            (r#"{"a":[1,[2]],"b":{}}"#, 3),
            (r#"{"a":"[[[[{{{{"}"#, 1),
            (r#"{"a":"\"[[","b":"\\"}"#, 1),
            ("[[[[", 4),
            ("]]]][", 1),
        ] {
            assert_eq!(depth(json.as_bytes()), deep, "{json}");
        }
    }
}
