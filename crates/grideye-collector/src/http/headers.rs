//! The headers of every response.

use axum::http::{HeaderMap, HeaderName, HeaderValue, header};
use axum::response::Response;
use std::sync::LazyLock;

/// Allows only what this server serves, and no inline script or style.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

const HEADERS: [(HeaderName, &str); 6] = [
    (header::CONTENT_SECURITY_POLICY, POLICY),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, "no-referrer"),
    (header::X_FRAME_OPTIONS, "DENY"),
    (
        HeaderName::from_static("cross-origin-resource-policy"),
        "same-origin",
    ),
    (
        HeaderName::from_static("cross-origin-opener-policy"),
        "same-origin",
    ),
];

/// The policy for a response that no browser shows.
const POLICY_OF_NO_PAGE: &str = "default-src 'none'; frame-ancestors 'none'";

/// All headers of such a JSON response: those that matter without a page.
pub(crate) static OF_NO_PAGE: LazyLock<HeaderMap> = LazyLock::new(|| {
    of([
        (header::CONTENT_TYPE, "application/json"),
        (header::CACHE_CONTROL, "no-store"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::CONTENT_SECURITY_POLICY, POLICY_OF_NO_PAGE),
    ])
});

fn of(headers: impl IntoIterator<Item = (HeaderName, &'static str)>) -> HeaderMap {
    let headers = headers.into_iter();
    headers
        .map(|(name, value)| (name, HeaderValue::from_static(value)))
        .collect()
}

/// Adds the headers of every response, unless it has [`OF_NO_PAGE`]; headers the response already has stay.
pub(crate) fn protect(response: &mut Response) {
    static EVERY: LazyLock<HeaderMap> = LazyLock::new(|| {
        let every = HEADERS.into_iter();
        of(every.chain([(header::CACHE_CONTROL, "no-store")]))
    });
    let policy = response.headers().get(header::CONTENT_SECURITY_POLICY);
    if policy.is_some_and(|policy| policy == POLICY_OF_NO_PAGE) {
        return;
    }
    // Copying the whole map is cheaper than adding one header after another.
    let own = std::mem::replace(response.headers_mut(), EVERY.clone());
    response.headers_mut().extend(own);
}
