use super::picture::{self, Shows};
use super::{Context, alignment, criteria, graph, maps, timeline};
use crate::metrics::{IS_THRESHOLD, SENSOR_ACCURACY_C};
use crate::paper::{self, EXPERIMENTS};
use crate::text::{UNDEFINED, escape, fixed, frames as frames_in_words, seconds, signed, value};
use crate::{Better, Comparison, Measure, Protocol, RoomFrom, Score, Verdict};

/// The comparison as one HTML file: no script, no network, readable in grey and in print. The verdict comes first.
#[must_use]
pub fn html(comparison: &Comparison, context: &Context) -> String {
    let title = format!(
        "{}: {} and {}",
        comparison.judgement.verdict, context.scene, context.recording
    );
    let body = [
        verdict(comparison),
        facts(comparison, context),
        criteria::section(comparison),
        frames(comparison),
        scores(comparison, context),
        evaluation(comparison),
        timeline::section(comparison),
        maps::section(comparison),
        alignment::section(comparison),
        criteria::thresholds(context),
        assumed(comparison, context),
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

/// What the verdict rests on, then the paper's own and plain distances, then what counts bins.
pub(super) const GROUPS: [(&str, &str, &[Measure]); 4] = [
    (
        "The verdict rests on",
        "rests",
        &[Measure::Correlation, Measure::Gain],
    ),
    (
        "Distances, reported",
        "reported",
        &[
            Measure::ImageSimilarity,
            Measure::Rmse,
            Measure::Mae,
            Measure::Bias,
            Measure::GainWithOffset,
        ],
    ),
    (
        "Places, structure and the sensor's noise, reported",
        "reported",
        &[
            Measure::ForegroundRmse,
            Measure::ContrastSlope,
            Measure::CentroidErrorPixels,
            Measure::CentroidErrorDegrees,
            Measure::WarmOverlap,
            Measure::StructuralSimilarity,
            Measure::ChiSquaredPerDegree,
        ],
    ),
    (
        "Entropy and mutual information, reported, not believed",
        "reported",
        &[
            Measure::EntropyRealGrey,
            Measure::EntropySimulatedGrey,
            Measure::JointEntropyGrey,
            Measure::MutualInformationGrey,
            Measure::MutualInformationGreyCorrected,
            Measure::EntropyRealBinned,
            Measure::EntropySimulatedBinned,
            Measure::JointEntropyBinned,
            Measure::MutualInformationBinned,
            Measure::MutualInformationBinnedCorrected,
        ],
    ),
];

fn verdict(comparison: &Comparison) -> String {
    let judgement = &comparison.judgement;
    let mark = match judgement.verdict {
        Verdict::Agrees => "✓",
        Verdict::Disagrees => "✗",
        Verdict::CannotTell => "?",
    };
    let reasons = list(judgement.reasons.iter());
    format!(
        "<section class=\"verdict {}\">\n<div class=\"badge\"><span aria-hidden=\"true\">{mark}</span> Verdict: {}</div>\n\
         <h1>{}</h1>\n{reasons}<p class=\"small\"><b>What would change it:</b> {}</p>\n</section>\n",
        judgement.verdict.name(),
        judgement.verdict,
        escape(&judgement.headline),
        escape(&judgement.would_change)
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
    let facts = [
        ("Scene", context.scene.clone()),
        ("Recording", context.recording.clone()),
        ("Sensor", context.sensor.clone()),
        ("Protocol", protocol),
        (
            "Recording less scene",
            format!("{} °C all over", signed(comparison.offset_c, 2)),
        ),
        (
            "That offset wanders by",
            format!("{} °C", fixed(comparison.drift_c, 2)),
        ),
        ("Sensor noise, 1σ", noise),
        (
            "Warm pixels a frame",
            format!(
                "{} real, {} claimed",
                fixed(warm.real, 1),
                fixed(warm.claimed, 1)
            ),
        ),
    ];
    let items: String = facts
        .iter()
        .map(|(name, fact)| format!("<div><dt>{name}</dt><dd>{}</dd></div>\n", escape(fact)))
        .collect();
    format!("<dl class=\"facts\">\n{items}</dl>\n")
}

fn scores(comparison: &Comparison, context: &Context) -> String {
    let papers = context
        .experiment
        .filter(|&number| paper::experiment(number).is_some());
    let papers = papers.map_or_else(|| "exp. 1–4".to_owned(), |number| format!("exp. {number}"));
    let rows: String = GROUPS
        .iter()
        .map(|(title, class, measures)| {
            let rows: String = measures
                .iter()
                .map(|&measure| row(&comparison.score(measure), context.experiment))
                .collect();
            format!("<tbody class=\"{class}\">\n<tr class=\"group\"><th colspan=\"8\" scope=\"rowgroup\">{title}</th></tr>\n{rows}</tbody>\n")
        })
        .collect();
    format!(
        "<h2>Scores, and what they are worth</h2>\n\
         <p>A score means something only between its floor (what a blank frame at {} °C, the simulation's own pixels in \
         random order, or an image of nothing but the sensor's noise would have scored) and its ceiling (the recording \
         against itself {} later; in C, gain, RMSE, MAE, contrast, centroid and χ² the sensor's noise counted once, \
         elsewhere as it comes). Skill is the place between the two, 0 to 1. A value \
         can pass its ceiling, for example where something has moved on before the repeat; its skill is 1 then.</p>\n\
         <div class=\"wide\"><table>\n<thead><tr><th scope=\"col\">Measure</th><th scope=\"col\">Value</th>\
         <th scope=\"col\">Skill</th><th scope=\"col\">Floor:<br>blank frame</th>\
         <th scope=\"col\">Floor: shuffled,<br>mean (best 5 %)</th><th scope=\"col\">Floor:<br>noise only</th>\
         <th scope=\"col\">Ceiling:<br>own repeat</th>\
         <th scope=\"col\">The paper's,<br>{papers}</th></tr></thead>\n{rows}</table></div>\n\
         <p class=\"small soft\">The paper's figures come from its own room and recordings: they are there to compare the order \
         of magnitude, not to be reached. A skill of “{UNDEFINED}” says that the ceiling does not rise above chance: on this \
         recording that measure cannot tell a right scene from a wrong one.</p>\n",
        fixed(comparison.settings.ambient_c, 2),
        frames_in_words(comparison.settings.lag_frames),
    )
}

fn row(score: &Score, experiment: Option<u8>) -> String {
    let measure = score.measure;
    let unit = match measure.unit() {
        "" | "%" => String::new(),
        unit => format!(" <span class=\"unit\">{unit}</span>"),
    };
    let shuffled = score.shuffled.map_or_else(
        || UNDEFINED.to_owned(),
        |shuffled| {
            let mean = value(measure, Some(shuffled.mean));
            match measure.better() {
                // Where neither more nor less is better, no order of the pixels is the best.
                Better::Neither => mean,
                _ => format!("{mean} ({})", value(measure, Some(shuffled.p95))),
            }
        },
    );
    format!(
        "<tr><th scope=\"row\">{measure}{unit}</th><td class=\"value\">{}</td><td>{}</td><td>{}</td><td>{shuffled}</td><td>{}</td><td>{}</td><td class=\"paper\">{}</td></tr>\n",
        value(measure, score.value),
        skill(score),
        value(measure, score.blank),
        value(measure, score.noise),
        value(measure, score.ceiling),
        papers_figure(measure, experiment)
    )
}

fn skill(score: &Score) -> String {
    score.skill().map_or_else(
        || UNDEFINED.to_owned(),
        |skill| {
            format!(
                "<span class=\"skill\"><span class=\"bar\" aria-hidden=\"true\"><i style=\"width:{:.0}%\"></i></span>{skill:.2}</span>",
                100.0 * skill
            )
        },
    )
}

fn papers_figure(measure: Measure, experiment: Option<u8>) -> String {
    if let Some(experiment) = experiment.and_then(paper::experiment) {
        return experiment
            .figure(measure)
            .map_or_else(String::new, |figure| papers_digits(measure, figure));
    }
    let figures: Vec<f64> = EXPERIMENTS
        .iter()
        .filter_map(|experiment| experiment.figure(measure))
        .collect();
    let lowest = figures.iter().copied().fold(f64::INFINITY, f64::min);
    let highest = figures.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    match lowest.total_cmp(&highest) {
        _ if figures.is_empty() => String::new(),
        std::cmp::Ordering::Equal => papers_digits(measure, lowest),
        _ => format!(
            "{} – {}",
            papers_digits(measure, lowest),
            papers_digits(measure, highest)
        ),
    }
}

/// As many digits as the paper prints, no more.
fn papers_digits(measure: Measure, figure: f64) -> String {
    match measure {
        Measure::ImageSimilarity => format!("{} %", fixed(100.0 * figure, 0)),
        Measure::Correlation => fixed(figure, 2),
        _ => fixed(figure, 1),
    }
}

fn frames(comparison: &Comparison) -> String {
    let temperatures = Shows::Temperatures(picture::shared_range(comparison));
    let differences = Shows::Differences {
        limit_c: picture::difference_limit(comparison),
    };
    let Some(key) = picture::key_frame(comparison) else {
        return String::new();
    };
    let time = seconds(key.time);
    let difference = picture::difference(&key.real, &key.simulated);
    let figure = |values: &[f64], shows, name: &str, caption: &str| {
        let svg = picture::svg(
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
        picture::scale(temperatures),
        picture::scale(differences),
        film(comparison, temperatures, differences)
    )
}

fn film(comparison: &Comparison, temperatures: Shows, differences: Shows) -> String {
    let cell = |values: &[f64], shows, title: &str| {
        format!(
            "<td>{}</td>",
            picture::svg(comparison.shape, values, shows, false, title)
        )
    };
    let strip = |name: &str, picture: &dyn Fn(&crate::FilmFrame) -> String| {
        let cells: String = comparison.film.iter().map(picture).collect();
        format!("<tr><th scope=\"row\">{name}</th>{cells}</tr>\n")
    };
    let times: String = comparison
        .film
        .iter()
        .map(|frame| {
            format!(
                "<th scope=\"col\" class=\"soft small\">{}</th>",
                seconds(frame.time)
            )
        })
        .collect();
    format!(
        "<div class=\"wide\"><table class=\"film\">\n<thead><tr><th scope=\"col\">Film</th>{times}</tr></thead>\n<tbody>\n{}{}{}</tbody></table></div>\n",
        strip("Real", &|frame| cell(&frame.real, temperatures, "real")),
        strip("Simulated", &|frame| cell(
            &frame.simulated,
            temperatures,
            "simulated"
        )),
        strip("Difference", &|frame| {
            cell(
                &picture::difference(&frame.real, &frame.simulated),
                differences,
                "difference",
            )
        }),
    )
}

fn evaluation(comparison: &Comparison) -> String {
    format!(
        "<h2>Evaluation graph</h2>\n<p>How many pixels differ by less than a threshold. A simulation earns what its curve \
         gains on the dashed one: a blank frame already reaches the top when little of the view is warm. IS is read at \
         {IS_THRESHOLD:.2} °C: the paper takes the datasheet's accuracy of ±{SENSOR_ACCURACY_C:.1} °C as 3σ and reads at 2σ. That σ is not \
         the sensor's noise.</p>\n\
         <figure>{}</figure>\n",
        graph::svg(&comparison.evaluation)
    )
}

fn assumed(comparison: &Comparison, context: &Context) -> String {
    let settings = &comparison.settings;
    let own = [
        background(comparison),
        format!(
            "A pixel of one frame is warm when it lies more than {} °C above the background ({} σ of the sensor's noise, at least two steps of the sensor).",
            fixed(comparison.warm_above_c, 2),
            fixed(settings.thresholds.warm_sigma, 0)
        ),
        union_sentence(comparison),
        "C does not see a common offset; RMSE, MAE, bias and IS do. RMSE and MAE also charge the simulation for noise of its \
         own, which a blank frame has not."
            .to_owned(),
        format!(
            "Entropies are counted in 256 grey levels over each frame's own range, as an 8-bit picture has them, and in {} (the chosen bins). \
             The paper does not name its binning; 256 levels fit its figures. Where the bias is taken out, it is that of the first order, after Miller and Madow.",
            settings.binning.in_words()
        ),
        information(comparison),
        noise_fit(comparison),
        format!("Shuffled scores are those of {} random orders of the pixels, seed {}.", settings.shuffles, settings.seed),
    ];
    let papers_room = context.experiment.and_then(paper::experiment).map(|experiment| {
        format!(
            "The paper's figures belong to its own experiment {}. What the scene file marks as assumed is not the paper's: room, \
             sensor position and furniture sizes are lost in the copies that were to hand.",
            experiment.number
        )
    });
    let sentences = context
        .assumptions
        .iter()
        .chain(&papers_room)
        .chain(&comparison.notes)
        .chain(&own);
    format!("<h2>What was assumed</h2>\n{}", list(sentences))
}

fn background(comparison: &Comparison) -> String {
    let ambient = fixed(comparison.settings.ambient_c, 2);
    match comparison.above_room.map(|above| above.from) {
        Some(RoomFrom::Profile) => format!(
            "The blank frame is uniform at the scene's ambient temperature of {ambient} °C; the pattern of the profile is added to the scene."
        ),
        _ => format!(
            "The background is uniform at the scene's ambient temperature of {ambient} °C; no background map of the empty room was used."
        ),
    }
}

fn information(comparison: &Comparison) -> String {
    let p = |measure| {
        let shuffled = comparison.score(measure).shuffled;
        let p = shuffled.and_then(|shuffled| shuffled.p);
        p.map_or_else(|| "not defined".to_owned(), |p| fixed(p, 3))
    };
    format!(
        "Of orders of the pixels as good as the true one or better, the true one counted among them, the share is {} for MI in 256 levels and {} in the chosen bins (permutation p-value).",
        p(Measure::MutualInformationGrey),
        p(Measure::MutualInformationBinned)
    )
}

fn noise_fit(comparison: &Comparison) -> String {
    let fit = &comparison.noise_fit;
    let p = fit
        .p_value()
        .map_or_else(|| "not defined".to_owned(), |p| fixed(p, 3));
    let drift = comparison
        .drift_c_per_min
        .map_or_else(String::new, |slope| {
            format!(
                " The common offset drifts by {} °C a minute.",
                signed(slope, 2)
            )
        });
    format!(
        "What is left between the recording and the noise-free claim is χ² = {} at {} degrees of freedom (p = {p}); the sensor's fixed pattern is in it, so that even a right scene need not reach 1 a degree.{drift}",
        fixed(fit.value, 0),
        fit.degrees_of_freedom
    )
}

fn union_sentence(comparison: &Comparison) -> String {
    let frame = match comparison.settings.protocol {
        Protocol::Static => "the mean of the real frames",
        Protocol::Dynamic => "the real frame",
    };
    let overlap = comparison.warm.overlap.map_or_else(String::new, |share| {
        format!(
            " Of these pixels {} % are warm on both sides.",
            fixed(100.0 * share, 0)
        )
    });
    format!(
        "The gain over the blank frame is 1 less the ratio of the simulation's RMSE to the blank frame's, \
         taken over the pixels that lie more than {} °C above ambient in {frame} or more than {} °C in the \
         noise-free simulated one, after the common offset of each pair was taken out.{overlap}",
        fixed(comparison.union_above_c, 2),
        fixed(comparison.union_above_c / 2.0, 2)
    )
}

fn reproduce(comparison: &Comparison, context: &Context) -> String {
    let mut rows = vec![("Program".to_owned(), context.program.clone())];
    rows.push((
        "Validator".to_owned(),
        concat!("grideye-validator ", env!("CARGO_PKG_VERSION")).to_owned(),
    ));
    rows.extend(
        context
            .seeds
            .iter()
            .map(|(name, seed)| (format!("Seed, {name}"), seed.to_string())),
    );
    rows.push((
        "Seed, shuffled pixels".to_owned(),
        comparison.settings.seed.to_string(),
    ));
    rows.extend(
        context
            .inputs
            .iter()
            .map(|input| (input.name.clone(), input.hash.clone())),
    );
    if !context.created.is_empty() {
        rows.push(("Made".to_owned(), context.created.clone()));
    }
    let rows: String = rows
        .iter()
        .filter(|(_, entry)| !entry.is_empty())
        .map(|(name, entry)| {
            format!(
                "<tr><th scope=\"row\">{}</th><td><code>{}</code></td></tr>\n",
                escape(name),
                escape(entry)
            )
        })
        .collect();
    let command = if context.command.is_empty() {
        String::new()
    } else {
        format!("<pre>{}</pre>\n", escape(&context.command))
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

fn list<'a>(sentences: impl Iterator<Item = &'a String>) -> String {
    let items: String = sentences
        .map(|sentence| format!("<li>{}</li>\n", escape(sentence)))
        .collect();
    format!("<ul>\n{items}</ul>\n")
}
