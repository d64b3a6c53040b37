//! The text of log events.

use grideye_collector::{Level, LogEvent};
use serde_json::Value;

#[test]
fn an_event_is_one_line_as_text_and_as_json_whatever_its_fields_hold() {
    let event = LogEvent::new(Level::Warning, "refused")
        .with("code", "bad_token")
        .with("path", "/x\n\u{1b}[2J \"y\"=z");
    assert_eq!(
        event.to_string(),
        r#"warning: refused code=bad_token path="/x\n\u{1b}[2J \"y\"=z""#
    );
    let json = event.to_json();
    assert_eq!(json.lines().count(), 1);
    let read: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(read["path"], "/x\n\u{1b}[2J \"y\"=z");
    assert_eq!(read["event"], "refused");
    assert_eq!(read["level"], "warning");
    assert!(read.get("unsaid").is_none());
}
