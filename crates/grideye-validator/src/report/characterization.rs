//! The characterization as an HTML page: table and maps.

use crate::characterize::Characterization;
use crate::numbers::extremes;
use crate::report::image::{self, Shows};
use grideye_draw::text::escape;
use grideye_frame::PIXELS;

const STYLE: &str = include_str!("characterization.css");

impl Characterization {
    /// One HTML file without scripts or network, readable in gray and in print; equal input gives equal bytes.
    #[must_use]
    pub fn to_html(&self, recording: &str, command: &str) -> String {
        let (recording, command) = (escape(recording), escape(command));
        format!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
             <title>The sensor of {recording}</title><style>{STYLE}</style></head><body><main>\n\
             <h1>The sensor of {recording}</h1>\n{}{}\
             <h2>Reproduce</h2>\n<pre>{command}</pre>\n</main></body></html>\n",
            self.table(),
            self.maps(),
        )
    }

    fn table(&self) -> String {
        let mut html = "<h2>Findings</h2>\n<div class=\"wide\"><table>\n".to_owned();
        for line in self.lines() {
            html.push_str(&format!(
                "<tr><th>{}</th><td class=\"value\">{}</td><td>{}</td></tr>\n",
                escape(line.label),
                escape(&line.value),
                escape(&line.note)
            ));
        }
        html.push_str("</table></div>\n");
        html
    }

    fn maps(&self) -> String {
        let noise = figure(
            &self.noise.sigma_c,
            Shows::Temperatures(self.noise.range_c()),
            "Noise of each pixel, °C",
            "From frame to frame, as read. Pixel 1 is at the upper left.",
        );
        let of_pattern = self.pattern.map_or_else(String::new, |pattern| {
            let (low, high) = extremes(&pattern.offset_c);
            let limit_c = high.max(-low);
            let fixed = figure(
                &pattern.offset_c,
                Shows::Differences { limit_c },
                "Fixed pattern, °C",
                "Each pixel's constant difference from a smooth surface.",
            );
            let smooth = figure(
                &pattern.surface_c,
                Shows::Temperatures(extremes(&pattern.surface_c)),
                "Smooth surface, °C",
                "Relative to the median pixel. Attributed to the scene; in the profile only if the room is empty.",
            );
            fixed + &smooth
        });
        format!("<h2>Maps</h2>\n<div class=\"maps\">{noise}{of_pattern}</div>\n")
    }
}

fn figure(values: &[f64; PIXELS], shows: Shows, title: &str, note: &str) -> String {
    let svg = image::svg(values, shows, true, title);
    format!("<figure>{svg}<figcaption><b>{title}</b><br>{note}</figcaption></figure>")
}
