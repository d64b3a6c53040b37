//! What the verdict rests on, part by part, and the thresholds with where they come from.

use crate::compare::Comparison;
use crate::expected::DRAWS;
use crate::report::context::Context;
use crate::report::ruler;
use crate::verdict::State;
use grideye_draw::text::escape;

/// Every part of the verdict with its state, in words and marks as well as in colour.
pub(crate) fn section(comparison: &Comparison) -> String {
    let rows: String = comparison
        .judgement
        .criteria
        .iter()
        .map(|criterion| {
            let (mark, word) = match criterion.state {
                State::Met => ("✓", "met"),
                State::Failed => ("✗", "failed"),
                State::Open => ("?", "cannot tell"),
                State::NotAsked => ("–", "not asked"),
            };
            format!(
                "<tr class=\"{}\"><th scope=\"row\">{}</th><td class=\"state\"><span aria-hidden=\"true\">{mark}</span> {word}</td><td>{}{}</td></tr>\n",
                criterion.state.name(),
                escape(criterion.title),
                escape(&criterion.sentence),
                criterion.asked.as_ref().map_or_else(String::new, ruler::svg)
            )
        })
        .collect();
    format!(
        "<h2>What the verdict rests on</h2>\n<p>All that were asked have to be met. MI and IS are not among them: they \
         hardly tell right scenes from wrong ones. On the lines, the diamond is what was found and the upright stroke what is \
         asked; the full bar holds what {DRAWS} drawn units score where the scene is right, the broken outline what they score \
         without the people, or without anything.</p>\n<table class=\"list criteria\">\n<tbody>\n{rows}</tbody>\n</table>\n"
    )
}

/// Each threshold, its number and where it comes from; nothing where none were handed in.
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
        "<h2>Thresholds, and where they come from</h2>\n<p>Skills are shares of the way from the floor to what right scenes hardly fall below; keys that \
         end in <code>_c</code> are in °C. <code>--thresholds FILE</code> takes others.</p>\n\
         <table class=\"list thresholds\">\n<tbody>\n{rows}</tbody>\n</table>\n"
    )
}
