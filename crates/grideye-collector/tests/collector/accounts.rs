//! The counts of a stream, in words.

use grideye_collector::Account;

#[test]
fn the_equation_says_when_it_does_not_hold() {
    let mut row: Account = serde_json::from_value(serde_json::json!({
        "device": "pi-1", "sensor": "i2c-1:0x69", "boot": "b", "read": 12, "stored": 9, "missing": 1,
        "dropped": { "ring-full": 1, "spool-full": 1 }, "spooled": 1, "balanced": true
    }))
    .unwrap();
    assert_eq!(
        row.to_string(),
        "read 12 = stored 9 + dropped 2 (ring-full 1, spool-full 1) + spooled 1, missing 1"
    );
    row.expired = 4;
    assert!(
        row.to_string()
            .contains("= stored 9 (4 of them deleted since) + dropped 2")
    );
    row.expired = 0;
    row.balanced = Some(false);
    assert!(row.to_string().contains("read 12 ≠ stored 9"));
    row.read = None;
    assert_eq!(
        row.to_string(),
        "stored 9, missing 1; the agent sent no count"
    );
}
