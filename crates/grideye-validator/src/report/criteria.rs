//! The criteria, what else was considered, and the thresholds with their sources.

use crate::compare::Comparison;
use crate::decision::{Alternatively, Decision};
use crate::report::text::{Context, marked};
use crate::verdict::{Criterion, State};
use grideye_draw::text::{escape, fixed};

pub(crate) fn section(comparison: &Comparison) -> String {
    let criteria = || comparison.judgment.criteria.iter();
    let is_shown = |criterion: &&Criterion| {
        let is_decisive = ["right", "contrast", "told_apart"].contains(&criterion.name);
        is_decisive || matches!(criterion.state, State::Failed | State::Open)
    };
    let rows = |rows: String| {
        format!("<table class=\"list criteria\">\n<tbody>\n{rows}</tbody>\n</table>\n")
    };
    let shown = rows(criteria().filter(is_shown).map(row).collect());
    let others = criteria().filter(|criterion| !is_shown(criterion));
    let (count, others) = (others.clone().count(), others.map(row).collect());
    let decision = comparison.decision.as_ref();
    format!(
        "<p>Every criterion that was asked must be met.</p>\n{shown}{}{}\
         <details><summary>{count} more, met or not asked</summary>\n{}</details>\n",
        decision.map_or_else(String::new, p_value),
        decision.map_or_else(String::new, alternatives),
        rows(others)
    )
}

fn p_value(decision: &Decision) -> String {
    format!(
        "<p>p-value {}: the share of simulated recordings of the scene that are as far from it as this one, or farther. The least \
         likely of it: {}.</p>\n",
        fixed(decision.right, 3),
        marked(&decision.worst)
    )
}

/// Far below zero, the number says no more.
fn shown(likeness: f64) -> String {
    if likeness < -2.0 {
        "below −2".to_owned()
    } else {
        fixed(likeness, 2)
    }
}

/// What else was considered, nearest first.
fn alternatives(decision: &Decision) -> String {
    let mut all: Vec<&Alternatively> = decision.alternatives.iter().collect();
    all.sort_by(|a, b| (a.likeness - a.limit).total_cmp(&(b.likeness - b.limit)));
    let rows: String = all
        .iter()
        .map(|one| {
            format!(
                "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{} %</td><td>{}</td></tr>\n",
                marked(&one.what),
                shown(one.likeness),
                shown(one.limit),
                fixed(100.0 * one.power, 0),
                one.finding()
            )
        })
        .collect();
    format!(
        "<details><summary>{} other explanations</summary>\n<p>1 is as the scene, 0 as the other explanation, less what noise may \
         add. It is excluded above what simulated recordings of it reach; the power is the share of right recordings that do.</p>\n\
         <div class=\"wide\"><table>\n<thead><tr><th scope=\"col\">Explanation</th><th scope=\"col\">This recording</th>\
         <th scope=\"col\">It reaches</th><th scope=\"col\">Power</th><th scope=\"col\">State</th></tr></thead>\n<tbody>\n{rows}</tbody></table></div></details>\n",
        all.len()
    )
}

fn row(criterion: &Criterion) -> String {
    let (mark, word) = match criterion.state {
        State::Met => ("✓", "met"),
        State::Failed => ("✗", "failed"),
        State::Open => ("?", "cannot tell"),
        State::NotAsked => ("–", "not asked"),
    };
    let text = format!("{} {}", criterion.sentence, criterion.next_step);
    format!(
        "<tr class=\"{}\"><th scope=\"row\">{}</th><td class=\"state\"><span aria-hidden=\"true\">{mark}</span> {word}</td><td>{}</td></tr>\n",
        criterion.state.name(),
        escape(criterion.title),
        marked(text.trim_end()),
    )
}

/// Each threshold with its number and source; empty without thresholds.
pub(crate) fn thresholds(context: &Context) -> String {
    if context.thresholds.is_empty() {
        return String::new();
    }
    let rows: String = context
        .thresholds
        .iter()
        .map(|line| {
            format!(
                "<tr><th scope=\"row\"><code>{}</code></th><td>{}</td><td>{}<br><span class=\"soft\">{}</span></td></tr>\n",
                line.key,
                line.value,
                escape(&line.source),
                escape(&line.file)
            )
        })
        .collect();
    format!(
        "<p>Keys ending in <code>_c</code> are in °C. Change \
         them with <code>--thresholds FILE</code>.</p>\n\
         <table class=\"list thresholds\">\n<tbody>\n{rows}</tbody>\n</table>\n"
    )
}
