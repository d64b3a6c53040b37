//! The comparison as an HTML page.

use crate::compare::{Comparison, FilmFrame};
use crate::frames::Protocol;
use crate::metrics::{IS_THRESHOLD, SENSOR_ACCURACY_C};
use crate::report::image::{self, Shows};
use crate::report::text::{Context, list, marked};
use crate::report::{assumptions, criteria, paper, plots, scores};
use crate::verdict::Verdict;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use grideye_draw::Rgb;
use grideye_draw::text::{escape, fixed, seconds, signed, upper};
use std::time::Duration;

/// The comparison as one HTML file without scripts or network, readable in gray and in print.
#[must_use]
pub fn html(comparison: &Comparison, context: &Context) -> String {
    let title = format!(
        "{}: {} and {}",
        comparison.judgment.verdict, context.scene, context.recording
    );
    let body = [
        verdict(comparison),
        frames(comparison, context),
        scores::section(comparison, context),
        folded("Criteria", &criteria::section(comparison)),
        folded(
            "Graphs",
            &(evaluation(comparison) + &plots::section(comparison)),
        ),
        folded("Where it is off", &image::maps_section(comparison)),
        folded("Recording and scene", &facts(comparison, context)),
        folded("Thresholds", &criteria::thresholds(context)),
        folded("Assumptions", &assumptions::section(comparison, context)),
        folded("Reproduce", &reproduce(comparison, context)),
        footer(context),
    ]
    .concat();
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{}</title>\n<style>\n{}</style>\n</head>\n<body>\n<main>\n{body}</main>\n</body>\n</html>\n",
        escape(&title),
        include_str!("style.css")
    )
}

/// The scene's time in the frames that are shown large, and the colors of the real one; `None` without frames.
#[must_use]
pub fn key_colors(comparison: &Comparison) -> Option<(Duration, Vec<Rgb>)> {
    let shows = Shows::Temperatures(image::shared_range(comparison));
    let key = image::key_frame(comparison)?;
    let colors = key.real.iter().map(|celsius| shows.color(*celsius));
    Some((key.scene_time, colors.collect()))
}

/// A section that a click opens; nothing of an empty one.
fn folded(title: &str, body: &str) -> String {
    match body {
        "" => String::new(),
        body => format!(
            "<details class=\"section\"><summary><h2>{title}</h2></summary>\n{body}</details>\n"
        ),
    }
}

fn verdict(comparison: &Comparison) -> String {
    let judgment = &comparison.judgment;
    let mark = match judgment.verdict {
        Verdict::Agrees => "✓",
        Verdict::Disagrees => "✗",
        Verdict::CannotTell => "?",
    };
    let verdict = judgment.verdict.name();
    let (title, found) = judgment.headline.split_once(": ").unwrap_or_default();
    // The first reason is the headline's own.
    let reasons = list(judgment.reasons.iter().skip(1));
    let next = match judgment.next_step.as_str() {
        "" => String::new(),
        next => format!("<p><b>Next:</b> {}</p>\n", marked(next)),
    };
    let warnings: String = comparison
        .warnings
        .iter()
        .map(|warning| format!("<p><b>Warning:</b> {}</p>\n", escape(warning)))
        .collect();
    format!(
        "<section class=\"verdict {verdict}\">\n<h1><span aria-hidden=\"true\">{mark}</span> {title}</h1>\n\
         <p class=\"lead\">{}</p>\n{warnings}{next}{reasons}</section>\n",
        marked(&upper(found)),
    )
}

fn facts(comparison: &Comparison, context: &Context) -> String {
    let protocol = match comparison.settings.protocol {
        Protocol::Static => format!(
            "static, {} real × {} simulated frames",
            comparison.real_frames, comparison.simulated_frames
        ),
        Protocol::Dynamic => format!("dynamic, {} pairs of frames", comparison.pairs),
    };
    let noise = comparison.noise_sigma_c.map_or_else(
        || "unknown".to_owned(),
        |sigma| format!("{} °C", fixed(sigma, 2)),
    );
    let offset = signed(comparison.offset_c, 2);
    let drift = fixed(comparison.drift_c, 2);
    let facts = [
        ("Scene", context.scene.clone()),
        ("Recording", context.recording.clone()),
        ("Model", comparison.settings.model.to_owned()),
        ("Sensor", context.sensor.clone()),
        ("Protocol", protocol),
        ("Recording minus scene", format!("{offset} °C overall")),
        ("This offset varies by", format!("{drift} °C")),
        ("Sensor noise, 1σ", noise),
    ];
    let items: String = facts
        .iter()
        .filter(|(_, fact)| !fact.is_empty())
        .map(|(name, fact)| format!("<div><dt>{name}</dt><dd>{}</dd></div>\n", escape(fact)))
        .collect();
    format!("<dl class=\"facts\">\n{items}</dl>\n")
}

fn frames(comparison: &Comparison, context: &Context) -> String {
    let temperatures = Shows::Temperatures(image::shared_range(comparison));
    let differences = Shows::Differences {
        limit_c: image::difference_limit(comparison),
    };
    let Some(key) = image::key_frame(comparison) else {
        return String::new();
    };
    let time = seconds(key.time);
    let difference = image::difference(&key.real, &key.simulated);
    let figure = |values: &[f64], shows, name: &str, caption: &str| {
        let svg = image::svg(values, shows, true, &format!("{name} frame at {time}"));
        format!(
            "<figure>{svg}{}<figcaption><b>{name}</b> {caption}</figcaption></figure>\n",
            image::scale(shows)
        )
    };
    format!(
        "<div class=\"frames\">\n{}{}{}{}</div>\n{}<p class=\"small soft\">The frames above are those at {time}; real and simulated share one scale. Pixel 1 is at \
         the upper left. Hatched cells differ by {IS_THRESHOLD:.2} °C or more and do not count as similar.</p>\n",
        figure(&key.real, temperatures, "Real", "as measured, °C"),
        figure(
            &key.simulated,
            temperatures,
            "Simulated",
            "with sensor noise, °C"
        ),
        figure(
            &difference,
            differences,
            "Difference",
            "real minus simulated, °C"
        ),
        room(context, seconds(key.scene_time).as_str()),
        film(comparison, temperatures, differences)
    )
}

/// As an image, whose styles stay its own.
fn room(context: &Context, time: &str) -> String {
    if context.room.is_empty() {
        return String::new();
    }
    let room = STANDARD.encode(&context.room);
    format!(
        "<figure><img alt=\"The room at {time} of the scene\" src=\"data:image/svg+xml;base64,{room}\">\
         <figcaption><b>Room</b> at {time} of the scene, with what each pixel sees in the color of the real frame</figcaption></figure>\n"
    )
}

fn film(comparison: &Comparison, temperatures: Shows, differences: Shows) -> String {
    let strip = |name: &str, shows, values: &dyn Fn(&FilmFrame) -> Vec<f64>| {
        let title = name.to_lowercase();
        let picture = |frame| image::svg(&values(frame), shows, false, &title);
        let cells = comparison.film.iter();
        let cells: String = cells
            .map(|frame| format!("<td>{}</td>", picture(frame)))
            .collect();
        format!("<tr><th scope=\"row\">{name}</th>{cells}</tr>\n")
    };
    let time = |frame: &FilmFrame| {
        let time = seconds(frame.time);
        format!("<th scope=\"col\" class=\"soft small\">{time}</th>")
    };
    let times: String = comparison.film.iter().map(time).collect();
    let difference = |frame: &FilmFrame| image::difference(&frame.real, &frame.simulated);
    format!(
        "<div class=\"wide\"><table class=\"film\">\n<thead><tr><th scope=\"col\">Film</th>{times}</tr></thead>\n<tbody>\n{}{}{}</tbody></table></div>\n",
        strip("Real", temperatures, &|frame| frame.real.clone()),
        strip("Simulated", temperatures, &|frame| frame.simulated.clone()),
        strip("Difference", differences, &difference),
    )
}

fn evaluation(comparison: &Comparison) -> String {
    format!(
        "<h3>Evaluation graph</h3>\n<p>Share of pixels that differ by less than a threshold. Only the gap to the dashed curve counts: with \
         little warm in view, a blank frame is similar too.</p>\n\
         <figure>{}</figure>\n<details><summary>Why IS is read at {IS_THRESHOLD:.2} °C</summary><p>The paper takes the datasheet's \
         accuracy of ±{SENSOR_ACCURACY_C:.1} °C as 3σ and reads at 2σ. This σ is not the sensor's noise.</p></details>\n",
        plots::evaluation_graph(&comparison.evaluation)
    )
}

fn reproduce(comparison: &Comparison, context: &Context) -> String {
    let validator = concat!("grideye-validator ", env!("CARGO_PKG_VERSION"));
    let seeds = context.seeds.iter();
    let seeds = seeds.map(|(name, seed)| (format!("Seed, {name}"), seed.to_string()));
    let shuffles = comparison.settings.seed.to_string();
    let inputs = context.inputs.iter();
    let inputs = inputs.map(|input| (input.name.clone(), input.hash.clone()));
    let rows: String = [("Program".to_owned(), context.program.clone())]
        .into_iter()
        .chain([("Validator".to_owned(), validator.to_owned())])
        .chain(seeds)
        .chain([("Seed, shuffled pixels".to_owned(), shuffles)])
        .chain(inputs)
        .chain([("Made".to_owned(), context.created.clone())])
        .filter(|(_, entry)| !entry.is_empty())
        .map(|(name, entry)| {
            let (name, entry) = (escape(&name), escape(&entry));
            format!("<tr><th scope=\"row\">{name}</th><td><code>{entry}</code></td></tr>\n")
        })
        .collect();
    let command = match context.command.as_str() {
        "" => String::new(),
        command => format!("<pre>{}</pre>\n", escape(command)),
    };
    format!("{command}<table class=\"list\">\n<tbody>\n{rows}</tbody>\n</table>\n")
}

fn footer(context: &Context) -> String {
    let figures = context.experiment.and_then(paper::experiment).map_or_else(
        String::new,
        |experiment| {
            format!(
                "The paper's figures are from its table {0}, experiment {0}: {1}. They are from its own room; compare only their order of magnitude. ",
                experiment.number, experiment.title
            )
        },
    );
    format!("<footer>{figures}{}.</footer>\n", escape(paper::CITATION))
}
