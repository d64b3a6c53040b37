//! The comparison as one page.

use crate::compare::{Comparison, FilmFrame};
use crate::frames::Protocol;
use crate::metrics::{IS_THRESHOLD, SENSOR_ACCURACY_C};
use crate::report::image::{self, Shows};
use crate::report::text::{Context, list};
use crate::report::{alignment, assumptions, criteria, paper, plots, scores};
use crate::verdict::Verdict;
use grideye_draw::text::{escape, fixed, seconds, signed};

/// The comparison as one HTML file: no script, no network, readable in grey and in print. The verdict comes first.
#[must_use]
pub fn html(comparison: &Comparison, context: &Context) -> String {
    let title = format!(
        "{}: {} and {}",
        comparison.judgment.verdict, context.scene, context.recording
    );
    let body = [
        verdict(comparison),
        facts(comparison, context),
        criteria::section(comparison),
        frames(comparison),
        scores::section(comparison, context),
        evaluation(comparison),
        plots::section(comparison),
        image::maps_section(comparison),
        alignment::section(comparison),
        criteria::thresholds(context),
        assumptions::section(comparison, context),
        reproduce(comparison, context),
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

fn verdict(comparison: &Comparison) -> String {
    let judgment = &comparison.judgment;
    let mark = match judgment.verdict {
        Verdict::Agrees => "✓",
        Verdict::Disagrees => "✗",
        Verdict::CannotTell => "?",
    };
    let reasons = list(judgment.reasons.iter());
    let warnings: String = comparison
        .warnings
        .iter()
        .map(|warning| format!("<p><b>Warning:</b> {}</p>\n", escape(warning)))
        .collect();
    format!(
        "<section class=\"verdict {}\">\n<div class=\"badge\"><span aria-hidden=\"true\">{mark}</span> Verdict: {}</div>\n\
         <h1>{}</h1>\n{warnings}{reasons}<p class=\"small\"><b>What would change it:</b> {}</p>\n</section>\n",
        judgment.verdict.name(),
        judgment.verdict,
        escape(&judgment.headline),
        escape(&judgment.would_change)
    )
}

fn facts(comparison: &Comparison, context: &Context) -> String {
    let protocol = match comparison.settings.protocol {
        Protocol::Static => format!(
            "static, {} × {} frames",
            comparison.real_frames, comparison.simulated_frames
        ),
        Protocol::Dynamic => format!("dynamic, {} frames in step", comparison.pairs),
    };
    let noise = comparison.noise_sigma_c.map_or_else(
        || "not measurable".to_owned(),
        |sigma| format!("{} °C", fixed(sigma, 2)),
    );
    let warm = &comparison.warm;
    let (real, claimed) = (fixed(warm.real, 1), fixed(warm.claimed, 1));
    let offset = signed(comparison.offset_c, 2);
    let drift = fixed(comparison.drift_c, 2);
    let facts = [
        ("Scene", context.scene.clone()),
        ("Recording", context.recording.clone()),
        ("Sensor", context.sensor.clone()),
        ("Protocol", protocol),
        ("Recording less scene", format!("{offset} °C all over")),
        ("That offset wanders by", format!("{drift} °C")),
        ("Sensor noise, 1σ", noise),
        (
            "Warm pixels a frame",
            format!("{real} real, {claimed} claimed"),
        ),
    ];
    let items: String = facts
        .iter()
        .map(|(name, fact)| format!("<div><dt>{name}</dt><dd>{}</dd></div>\n", escape(fact)))
        .collect();
    format!("<dl class=\"facts\">\n{items}</dl>\n")
}

fn frames(comparison: &Comparison) -> String {
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
        let svg = image::svg(
            comparison.shape,
            values,
            shows,
            true,
            &format!("{name} frame at {time}"),
        );
        format!("<figure>{svg}<figcaption><b>{name}</b> {caption}</figcaption></figure>\n")
    };
    format!(
        "<h2>Frames</h2>\n<p>The frame at {time}, values in °C. Real and simulated share one scale; the first pixel of the \
         recording is at the upper left. In the difference, hatched cells are off by {IS_THRESHOLD:.2} °C or more and do \
         not count as similar.</p>\n<div class=\"frames\">\n{}{}{}</div>\n\
         <div class=\"scales\"><div>{}</div><div>{}</div></div>\n{}",
        figure(&key.real, temperatures, "Real", "as the sensor measured it"),
        figure(
            &key.simulated,
            temperatures,
            "Simulated",
            "with the sensor's noise"
        ),
        figure(
            &difference,
            differences,
            "Difference",
            "simulated less real"
        ),
        image::scale(temperatures),
        image::scale(differences),
        film(comparison, temperatures, differences)
    )
}

fn film(comparison: &Comparison, temperatures: Shows, differences: Shows) -> String {
    let strip = |name: &str, shows, values: &dyn Fn(&FilmFrame) -> Vec<f64>| {
        let title = name.to_lowercase();
        let picture = |frame| image::svg(comparison.shape, &values(frame), shows, false, &title);
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
        "<h2>Evaluation graph</h2>\n<p>How many pixels differ by less than a threshold. A simulation earns what its curve \
         gains on the dashed one: a blank frame already reaches the top when little of the view is warm. IS is read at \
         {IS_THRESHOLD:.2} °C: the paper takes the datasheet's accuracy of ±{SENSOR_ACCURACY_C:.1} °C as 3σ and reads at 2σ. That σ is not \
         the sensor's noise.</p>\n\
         <figure>{}</figure>\n",
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
    format!(
        "<h2>How to reproduce</h2>\n{command}<table class=\"list\">\n<tbody>\n{rows}</tbody>\n</table>\n"
    )
}

fn footer(context: &Context) -> String {
    let which = context.experiment.and_then(paper::experiment).map_or_else(
        || "The paper's figures are the ranges of its Tables 1 to 4".to_owned(),
        |experiment| {
            format!(
                "The paper's figures are those of its Table {0}, experiment {0}: {1}",
                experiment.number, experiment.title
            )
        },
    );
    format!("<footer>{which}. {}.</footer>\n", escape(paper::CITATION))
}
