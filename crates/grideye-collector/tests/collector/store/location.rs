//! Locations of a store.

use grideye_collector::StoreLocation;

#[test]
fn anything_but_a_whole_url_is_refused_with_what_is_expected() {
    for (text, wrong) in [
        ("postgres://db/frames", "no user"),
        ("postgres://me@/frames", "no host"),
        ("postgres://me:pw@db", "no database"),
        ("postgres://me:pw@db:port/frames", "not understood"),
        ("postgres://me:pw@db/frames?sslmode=require", "TLS"),
        ("postgres://me:pw@db/frames?colour=red", "not understood"),
        ("mysql://me:pw@db/frames", "mysql://"),
    ] {
        let error = text.parse::<StoreLocation>().unwrap_err().to_string();
        assert!(error.contains(wrong), "{text}: {error}");
        assert!(error.contains("\nhint: "), "{error}");
        assert!(!error.contains("pw"), "{error}");
    }
    let file = "frames.sqlite".parse::<StoreLocation>();
    assert_eq!(file, Ok(StoreLocation::File("frames.sqlite".into())));
}
