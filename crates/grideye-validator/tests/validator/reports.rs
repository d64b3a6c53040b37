//! The page, the JSON and the terminal table of a comparison.

use crate::toy::{AMBIENT_C, Blob, PERSON, UNIT, recording, settings, simulation};
use grideye_validator::report::{Context, Input, html, json, table};
use grideye_validator::thresholds::ThresholdSet;
use grideye_validator::{
    Better, Comparison, Criterion, FILM_FRAMES_MAX, Measure, Protocol, RoomSource, State, compare,
    paper,
};
use serde_json::Value;

fn comparison(claimed: &[Blob]) -> Comparison {
    let real = recording(10, UNIT, 1, |_| vec![PERSON]);
    let simulated = simulation(10, 2, |_| claimed.to_vec());
    let mut comparison = compare(&real, &simulated, &settings(Protocol::Static)).unwrap();
    comparison
        .notes
        .push("A note of the comparison.".to_owned());
    comparison
}

fn context() -> Context {
    Context {
        scene: "<b>kitchen</b>".to_owned(),
        recording: "monday & tuesday.csv".to_owned(),
        sensor: "\"ceiling\"".to_owned(),
        command: "grideye compare --scene kitchen.toml --recording 'monday & tuesday.csv'"
            .to_owned(),
        program: "grideye 0.1.0".to_owned(),
        created: "2025-01-31 12:00 UTC".to_owned(),
        seeds: vec![("simulation".to_owned(), 7)],
        inputs: vec![Input {
            name: "kitchen.toml".to_owned(),
            hash: "sha256:00ff".to_owned(),
        }],
        assumptions: vec!["The sensor looks straight down.".to_owned()],
        experiment: Some(1),
        thresholds: ThresholdSet::shipped().lines,
        room: String::new(),
    }
}

/// The page as a person reads it: without markup and images, white space joined.
fn readable(page: &str) -> String {
    let body = page.split_once("<body>").unwrap().1;
    let mut text = String::new();
    let mut depth = 0_u32;
    for character in body.chars() {
        match character {
            '<' => {
                depth += 1;
                text.push(' ');
            }
            '>' => depth = depth.saturating_sub(1),
            _ if depth == 0 => text.push(character),
            _ => {}
        }
    }
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[track_caller]
fn holds(text: &str, sentences: &[&str]) {
    for sentence in sentences {
        assert!(text.contains(sentence), "`{sentence}` is not in:\n{text}");
    }
}

/// Each state has its mark, word and class; what decides and what is not met is shown, the rest folded.
#[test]
fn every_criterion_is_a_row_with_its_state() {
    let mut comparison = comparison(&[PERSON]);
    let states = [State::Met, State::Failed, State::Open, State::NotAsked];
    comparison.judgment.criteria = states
        .into_iter()
        .map(|state| Criterion {
            name: "one",
            title: "One & all",
            state,
            sentence: "1 < 2.".to_owned(),
            next_step: "Count.".to_owned(),
            keys: &[],
        })
        .collect();
    let page = html(&comparison, &context());
    let (_, rest) = page.split_once("<h2>Criteria</h2>").unwrap();
    let (section, _) = rest.split_once("</details>").unwrap();
    let (_, details) = section
        .split_once("<details><summary>2 more, met or not asked")
        .unwrap();
    assert_eq!(details.matches("<tr").count(), 2, "{section}");
    let rows: Vec<&str> = section
        .lines()
        .filter(|line| line.starts_with("<tr"))
        .collect();
    let expected = [
        ("failed", "✗", "failed"),
        ("open", "?", "cannot tell"),
        ("met", "✓", "met"),
        ("not_asked", "–", "not asked"),
    ]
    .map(|(class, mark, word)| {
        format!(
            "<tr class=\"{class}\"><th scope=\"row\">One &amp; all</th><td class=\"state\"><span aria-hidden=\"true\">{mark}</span> {word}</td><td>1 &lt; 2. Count.</td></tr>"
        )
    });
    assert_eq!(rows, expected);
}

#[test]
fn every_threshold_is_a_row_with_its_number_and_its_source() {
    let mut context = context();
    let all = context.thresholds.len();
    context.thresholds.truncate(1);
    context.thresholds[0].source = "Nine & a < b.".to_owned();
    let page = html(&comparison(&[PERSON]), &context);
    let line = &context.thresholds[0];
    let row = format!(
        "<tbody>\n<tr><th scope=\"row\"><code>right_min</code></th><td>0.015</td><td>Nine &amp; a &lt; b.<br><span class=\"soft\">{}</span></td></tr>\n</tbody>",
        line.file
    );
    assert!(page.contains(&row), "{row}");
    assert_eq!(all, 12);
    context.thresholds.clear();
    let page = html(&comparison(&[PERSON]), &context);
    assert!(!page.contains("<h2>Thresholds</h2>") && !page.contains("list thresholds"));
}

#[test]
fn the_page_prints_floors_ceilings_and_the_papers_figures_as_the_papers() {
    let page = html(&comparison(&[PERSON]), &context());
    let text = readable(&page);
    holds(
        &text,
        &[
            "Measure Value Skill Floor: blank frame Floor: shuffled, mean (best 5 %) Ceiling: own repeat The paper's, exp. 1 C, correlation",
            "The paper's figures are from its table 1, experiment 1",
            "PeerJ Computer Science 11:e3124",
        ],
    );
    holds(
        &page,
        &[
            "<td class=\"paper\">0.79</td>",
            "<td class=\"paper\">95 %</td>",
            "<td class=\"paper\">5.9</td>",
        ],
    );
    let any = html(
        &comparison(&[PERSON]),
        &Context {
            experiment: None,
            ..context()
        },
    );
    assert!(!readable(&any).contains("The paper's") && !any.contains("class=\"paper\""));
}

#[test]
fn the_page_shows_scale_assumptions_and_command() {
    let text = readable(&html(&comparison(&[PERSON]), &context()));
    holds(
        &text,
        &[
            "real and simulated share one scale",
            "Hatched cells differ by 1.67 °C or more",
            "threshold in °C",
            "blank frame (floor)",
            "own repeat (ceiling)",
            "Assumptions The sensor looks straight down. The paper&#39;s figures are from its own experiment 1. Values that the scene file marks as assumed are ours",
            "A note of the comparison.",
            "Reproduce grideye compare --scene kitchen.toml",
            "Program grideye 0.1.0",
            "Seed, simulation 7",
            "kitchen.toml sha256:00ff",
            "Made 2025-01-31 12:00 UTC",
        ],
    );
}

/// A reader must be able to work out every figure that could be confused with another.
#[test]
fn the_page_explains_its_figures() {
    let text = readable(&html(&comparison(&[PERSON]), &context()));
    holds(
        &text,
        &[
            "The ceiling counts the sensor's noise once in C, RMSE and centroid, twice elsewhere.",
            "A value can exceed it",
            "Entropies use 256 gray levels over each frame&#39;s own range",
            "Why IS is read at 1.67 °C The paper takes the datasheet's accuracy of ±2.5 °C as 3σ and reads at 2σ. This σ is not the sensor's noise.",
        ],
    );
    let any = Context {
        experiment: None,
        ..context()
    };
    assert!(!readable(&html(&comparison(&[PERSON]), &any)).contains("its own experiment"));
}

/// That column is headed "best 5 %", but an entropy has no better or worse.
#[test]
fn only_measures_with_a_better_side_have_a_best_shuffle() {
    let comparison = comparison(&[PERSON]);
    let page = html(&comparison, &context());
    for measure in Measure::ALL {
        let row = page
            .split("<tr>")
            .find(|row| row.contains(&format!("<th scope=\"row\">{measure}")))
            .unwrap();
        let has_a_side = measure.better() != Better::Neither;
        assert_eq!(row.contains(" ("), has_a_side, "{row}");
    }
}

/// In print, the table must not end before its last columns, which are scrolled away on screen.
#[test]
fn nothing_scrolls_in_print() {
    let page = html(&comparison(&[PERSON]), &context());
    let (screen, print) = page.split_once("@media print").unwrap();
    let scrolled: Vec<_> = screen
        .lines()
        .filter(|line| line.contains("overflow-x: auto"))
        .map(|line| line.split_once(" {").unwrap().0)
        .collect();
    assert_eq!(scrolled, [".wide", "pre"]);
    holds(
        print,
        &[
            ".wide, pre { overflow: visible; }",
            "pre { white-space: pre-wrap;",
        ],
    );
}

#[test]
fn the_page_is_self_contained() {
    let page = html(&comparison(&[PERSON]), &context());
    for foreign in [
        "<script",
        "<link",
        "src=\"http",
        "href=\"http",
        "url(",
        "@import",
    ] {
        assert!(!page.contains(foreign), "{foreign}");
    }
    assert_eq!(
        page.matches("data:image/png;base64,").count(),
        3 + 2 + 3 * FILM_FRAMES_MAX
    );
    assert!(page.len() < 200_000, "{} bytes", page.len());
}

/// Verdict, frames and room, film, scores; a click opens the rest.
#[test]
fn the_first_screen_has_the_verdict_the_frames_and_the_room() {
    let mut context = context();
    context.room = "<svg/>".to_owned();
    let page = html(&comparison(&[PERSON]), &context);
    let (open, folded) = page.split_once("<details class=\"section\">").unwrap();
    let places = [
        "<h1>",
        "<b>Real</b>",
        "<b>Simulated</b>",
        "<b>Difference</b> real minus simulated",
        "src=\"data:image/svg+xml;base64,PHN2Zy8+\"",
        "class=\"film\"",
        "<h2>Scores</h2>",
    ]
    .map(|piece| open.find(piece).unwrap_or_else(|| panic!("{piece}")));
    assert!(places.is_sorted(), "{places:?}");
    let titles = folded.matches("<summary><h2>").count();
    assert_eq!((titles, open.matches("<h2>").count()), (7, 1));
    context.room.clear();
    assert!(!html(&comparison(&[PERSON]), &context).contains("svg+xml"));
}

#[test]
fn names_cannot_become_markup() {
    let page = html(&comparison(&[PERSON]), &context());
    assert!(!page.contains("<b>kitchen"));
    holds(
        &page,
        &[
            "<dd>&lt;b&gt;kitchen&lt;/b&gt;</dd>",
            "<dd>monday &amp; tuesday.csv</dd>",
            "<dd>&quot;ceiling&quot;</dd>",
            "<title>cannot tell: &lt;b&gt;kitchen&lt;/b&gt; and monday &amp; tuesday.csv</title>",
            "--recording &#39;monday &amp; tuesday.csv&#39;",
        ],
    );
}

/// Compares numbers read back from text, where the parser may lose the last bit.
#[track_caller]
fn same(found: &Value, expected: Option<f64>) {
    match (found.as_f64(), expected) {
        (Some(found), Some(expected)) => {
            assert!((found - expected).abs() <= 1e-12, "{found} {expected}");
        }
        (found, expected) => assert_eq!(found, expected),
    }
}

#[test]
fn json_holds_the_numbers_of_the_comparison() {
    let comparison = comparison(&[PERSON]);
    let document: Value = serde_json::from_str(&json(&comparison, &context())).unwrap();
    assert_eq!(document["format"], "grideye-comparison");
    assert_eq!(document["version"], 1);
    assert_eq!(document["verdict"], "cannot_tell");
    assert_eq!(
        document["reasons"].as_array().unwrap().len(),
        comparison.judgment.reasons.len()
    );
    assert_eq!(document["pairs"], 100);
    same(&document["offset_c"], Some(comparison.offset_c));
    same(&document["noise_sigma_c"], comparison.noise_sigma_c);
    assert_eq!(document["settings"]["ambient_c"].as_f64(), Some(AMBIENT_C));
    assert_eq!(document["context"]["scene"], "<b>kitchen</b>");
    assert_eq!(
        document["context"]["assumptions"][1],
        "A note of the comparison."
    );
    assert_eq!(
        document["film"].as_array().unwrap().len(),
        comparison.film.len()
    );
    assert_eq!(
        document["film"][0]["real_c"][63].as_f64(),
        Some(comparison.film[0].real[63])
    );
}

#[test]
fn json_holds_every_score_under_its_stable_name() {
    let comparison = comparison(&[PERSON]);
    let document: Value = serde_json::from_str(&json(&comparison, &context())).unwrap();
    assert_eq!(
        document["scores"].as_object().unwrap().len(),
        Measure::ALL.len()
    );
    for score in comparison.scores.iter() {
        let entry = &document["scores"][score.measure.name()];
        same(&entry["value"], score.value);
        same(&entry["blank"], score.blank);
        same(&entry["ceiling"], score.ceiling);
        same(&entry["skill"], score.skill());
        same(
            &entry["shuffled"]["mean"],
            score.shuffled.map(|shuffled| shuffled.mean),
        );
        same(
            &entry["shuffled"]["p95"],
            score.shuffled.map(|shuffled| shuffled.p95),
        );
    }
    assert_eq!(document["scores"]["correlation"]["papers"], 0.79);
    assert_eq!(document["scores"]["correlation"]["blank"], Value::Null);
    assert_eq!(document["scores"]["image_similarity"]["unit"], "share");
    let graph = &document["evaluation_graph"];
    for curve in ["simulated", "blank", "repeat"] {
        let lengths = (
            graph[curve].as_array().unwrap().len(),
            graph["thresholds_c"].as_array().unwrap().len(),
        );
        assert_eq!(lengths.0, lengths.1);
    }
}

#[test]
fn json_holds_the_frames_one_by_one_and_the_pixels_over_time() {
    let comparison = comparison(&[PERSON]);
    let document: Value = serde_json::from_str(&json(&comparison, &context())).unwrap();
    let timeline = &document["timeline"];
    assert_eq!(timeline["time_s"].as_array().unwrap().len(), 10);
    for (index, frame) in comparison.timeline.iter().enumerate() {
        same(&timeline["offset_c"][index], Some(frame.offset_c));
        same(
            &timeline["difference_c"][index][63],
            Some(frame.difference_c[63]),
        );
        for measure in Measure::ALL {
            same(
                &timeline["scores"][measure.name()][index],
                frame.get(measure),
            );
        }
    }
    for pixel in 0..64 {
        let over_time = comparison
            .timeline
            .iter()
            .map(|frame| frame.difference_c[pixel]);
        let mean = over_time.sum::<f64>() / 10.0;
        same(&document["maps"]["bias_c"][pixel], Some(mean));
    }
}

/// Columns line up, and all of the page's table is there.
#[test]
fn the_table_for_a_terminal_lines_up() {
    let comparison = comparison(&[PERSON]);
    let text = table(&comparison, Some(1));
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 1 + Measure::ALL.len() + 1);
    holds(
        lines[0],
        &[
            "score",
            "blank",
            "shuffled",
            "repeat",
            "the paper's, table 1",
        ],
    );
    let end = |line: &str, word: &str| line.find(word).map(|at| line[..at].chars().count());
    let correlation = lines
        .iter()
        .find(|line| line.starts_with("C, correlation"))
        .unwrap();
    assert_eq!(
        end(lines[0], "the paper's").unwrap() + "the paper's, table 1".len(),
        end(correlation, "0.79").unwrap() + 4
    );
    holds(
        &text,
        &["entropies in 256 gray levels; 20 shuffled orders; offset "],
    );
    assert!(!table(&comparison, None).contains("the paper's,"));
}

/// The page and the JSON work for any comparison, even of an empty room.
#[test]
fn an_undefined_score_is_a_dash_and_null() {
    let flat = [AMBIENT_C; 64];
    let real: Vec<_> = recording(3, UNIT, 1, |_| vec![])
        .into_iter()
        .map(|frame| grideye_validator::RealFrame {
            celsius: flat,
            later: Some(flat),
            ..frame
        })
        .collect();
    let simulated: Vec<_> = simulation(3, 1, |_| vec![])
        .into_iter()
        .map(|frame| grideye_validator::SimulatedFrame {
            celsius: flat,
            ..frame
        })
        .collect();
    let comparison = compare(&real, &simulated, &settings(Protocol::Static)).unwrap();
    let page = html(&comparison, &Context::default());
    assert!(readable(&page).starts_with("? Cannot tell "));
    assert!(page.contains("<th scope=\"row\">C, correlation</th><td class=\"value\">–</td>"));
    let text = readable(&page);
    assert!(!text.contains("NaN") && !text.contains("inf "), "{text}");
    let document: Value = serde_json::from_str(&json(&comparison, &Context::default())).unwrap();
    assert_eq!(document["verdict"], "cannot_tell");
    assert_eq!(document["scores"]["correlation"]["value"], Value::Null);
}

#[test]
fn room_sources_have_names() {
    let names = RoomSource::ALL.map(RoomSource::name);
    assert_eq!(names, ["scene", "profile", "recording"]);
}

#[test]
fn the_papers_figures_are_those_of_tables_1_to_4() {
    let figure = |number, measure| paper::experiment(number).unwrap().figure(measure);
    let row = |number| paper::MEASURES.map(|measure| figure(number, measure).unwrap());
    assert_eq!(row(1), [0.79, 3.5, 5.2, 5.9, 2.8, 0.95]);
    assert_eq!(row(2), [0.71, 3.3, 4.5, 5.9, 1.9, 0.90]);
    assert_eq!(row(3), [0.58, 3.2, 4.7, 5.9, 2.0, 0.94]);
    assert_eq!(row(4), [0.49, 2.9, 4.6, 5.9, 1.6, 0.92]);
    assert_eq!(figure(2, Measure::MutualInformation), Some(1.9));
    assert_eq!(figure(1, Measure::Rmse), None);
    assert_eq!(paper::experiment(5), None);
}
