//! What each pixel is off by over all frames.

use crate::compare::Comparison;
use crate::report::image;
use crate::report::image::{Range, Shows};

/// Mean difference, its root mean square, and structural similarity, pixel by pixel.
pub(crate) fn section(comparison: &Comparison) -> String {
    let maps = &comparison.maps;
    if maps.bias_c.is_empty() {
        return String::new();
    }
    let largest = |values: &[f64]| {
        values
            .iter()
            .fold(0.0_f64, |most, value| most.max(value.abs()))
    };
    let to_half = |value: f64| ((value * 2.0).ceil() / 2.0).max(0.5);
    let differences = Shows::Differences {
        limit_c: to_half(largest(&maps.bias_c)),
    };
    let errors = Shows::Temperatures(Range {
        coldest_c: 0.0,
        warmest_c: to_half(largest(&maps.rmse_c)),
    });
    let figure = |values: &[f64], shows, name: &str, caption: &str, scale: String| {
        let svg = image::svg(comparison.shape, values, shows, true, name);
        format!("<figure>{svg}{scale}<figcaption><b>{name}</b> {caption}</figcaption></figure>\n")
    };
    let structure = maps
        .structure
        .as_ref()
        .map_or_else(String::new, |structure| {
            let shows = Shows::Temperatures(Range {
                coldest_c: -1.0,
                warmest_c: 1.0,
            });
            figure(
                structure,
                shows,
                "Structure",
                "mean structural similarity of each pixel's neighbourhood, −1 (black) to 1 (light)",
                String::new(),
            )
        });
    format!(
        "<h2>Where it is off</h2>\n<p>Each pixel over all frames. One that stands out alone is a pixel's fault or a fixed \
         pattern; a patch is something that the scene has elsewhere, or has not.</p>\n<div class=\"frames\">\n{}{}{structure}</div>\n",
        figure(
            &maps.bias_c,
            differences,
            "Mean difference",
            "simulated less real, °C",
            image::scale(differences)
        ),
        figure(
            &maps.rmse_c,
            errors,
            "Error",
            "root mean square of the difference, °C",
            image::scale(errors)
        ),
    )
}
