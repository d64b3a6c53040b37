//! The page of metrics, compared with the format's specification.

use grideye_recording::prometheus::Text;

#[test]
fn families_are_written_as_the_format_says() {
    let mut text = Text::new();
    text.gauge("a_hertz", "How often.");
    text.sample(&[("device", "p\"i\\\n"), ("x", "y")], 9.5);
    text.histogram("t_seconds", "How long.", &[0.1, 1.0], &[2, 1, 4], 7.25);
    assert_eq!(
        text.into_string(),
        "# HELP a_hertz How often.\n# TYPE a_hertz gauge\na_hertz{device=\"p\\\"i\\\\\\n\",x=\"y\"} 9.5\n\
         # HELP t_seconds How long.\n# TYPE t_seconds histogram\n\
         t_seconds_bucket{le=\"0.1\"} 2\nt_seconds_bucket{le=\"1\"} 3\nt_seconds_bucket{le=\"+Inf\"} 7\n\
         t_seconds_sum 7.25\nt_seconds_count 7\n"
    );
}
