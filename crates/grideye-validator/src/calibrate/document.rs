//! A calibrated scene's text: values, comments, and the `[[calibrated]]` table.

use crate::calibrate::types::Estimate;
use grideye_scene::uncertain::Uncertain;
use grideye_scene::{Calibrated, Scene};
use serde_json::json;
use std::ops::Range;

/// Start of the comments in a scene; those of an earlier calibration are replaced.
const REMARK: &str = "# found: ";
const MARKS_PER_LINE: usize = 12;
/// Of a normal law, in standard deviations: few degrees of freedom make a wider one of the 95 % interval.
const NORMAL_97_5: f64 = 1.959_963_985;

/// The text with the values found, their comments, and the table of what they were fitted to.
pub(crate) fn scene(
    text: &str,
    (scene, unknowns): (&Scene, &[Uncertain]),
    found: &[Estimate],
    fitted: &Calibrated,
) -> String {
    let mut edits = Vec::new();
    if !fitted.keys.is_empty() {
        let old = scene.calibrated().iter();
        // Values of an earlier calibration that this one did not fit stay in the scene, and so does its table.
        let replaced = old.filter(|old| old.keys.iter().all(|key| fitted.keys.contains(key)));
        edits.extend(replaced.map(|old| (with_blank_line(text, &old.lines), String::new())));
        edits.push((text.len()..text.len(), table(text, fitted, found)));
    }
    for (one, found) in unknowns.iter().zip(found) {
        if let Some(span) = &one.value_span {
            edits.push((span.clone(), found.value.to_string()));
        }
        let mut remark = String::new();
        if one.is_mean_the_value {
            // Otherwise the value found would be taken for what was known before.
            remark.push_str(&format!("mean = {}\n", one.value));
        }
        remark.push_str(&format!("{REMARK}{}\n", found.told()));
        edits.push((earlier_remark(text, one.remark_at), remark));
    }
    edits.sort_by_key(|(span, _)| std::cmp::Reverse((span.start, span.end)));
    let mut text = text.to_owned();
    for (span, new) in edits {
        text.replace_range(span, &new);
    }
    text
}

/// The line before `at` if it is a comment of an earlier calibration, else nothing.
fn earlier_remark(text: &str, at: usize) -> Range<usize> {
    let before = text[..at].trim_end_matches('\n');
    let start = before.rfind('\n').map_or(0, |newline| newline + 1);
    let is_remark = before[start..].starts_with(REMARK) && text[..at].ends_with('\n');
    if is_remark { start..at } else { at..at }
}

/// The lines of a table, with the blank line before them.
fn with_blank_line(text: &str, lines: &Range<usize>) -> Range<usize> {
    let is_after_blank = !lines.is_empty() && text[..lines.start].ends_with("\n\n");
    lines.start - usize::from(is_after_blank)..lines.end
}

fn table(text: &str, fitted: &Calibrated, found: &[Estimate]) -> String {
    let end_of_line = if text.ends_with('\n') { "" } else { "\n" };
    let keys = json!(fitted.keys);
    let known = found.iter().filter(|found| found.law.is_some());
    let known = known.filter(|found| fitted.keys.contains(&found.key));
    let known = known.filter_map(|found| {
        let sd = found.half_width_95.filter(|half| *half > 0.0)? / NORMAL_97_5;
        let decimals = (0..12).find(|place| sd * 10.0_f64.powi(*place) >= 100.0);
        let digits = usize::try_from(decimals.unwrap_or(12)).unwrap_or_default();
        Some(format!("{} = {sd:.digits$}", json!(found.key)))
    });
    let known: Vec<String> = known.collect();
    let sd = match known.as_slice() {
        [] => String::new(),
        known => format!("sd = {{ {} }}\n", known.join(", ")),
    };
    let marks: Vec<String> = fitted
        .frames
        .iter()
        .map(|frame| format!("{frame:08x}"))
        .collect();
    let lines: Vec<String> = marks
        .chunks(MARKS_PER_LINE)
        .map(|line| line.join(" "))
        .collect();
    format!(
        "{end_of_line}\n[[calibrated]]\n# The frames that these values were fitted to. `grideye compare` does not judge the scene by them.\nkeys = {keys}\n{sd}every_s = {}\nframes = \"\"\"\n{}\"\"\"\n",
        fitted.every_s,
        lines.join("\n")
    )
}
