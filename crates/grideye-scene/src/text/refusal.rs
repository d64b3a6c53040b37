//! What a refusal tells: the rule that a number breaks, and an excerpt of what was found.

/// The numbers that a key may have; not-a-number breaks every rule.
pub(crate) struct Rule {
    pub(crate) key: &'static str,
    pub(crate) holds: fn(f64) -> bool,
    pub(crate) expected: &'static str,
    pub(crate) hint: &'static str,
}

/// The beginning of what a file has in a place, on one line.
pub(crate) fn excerpt(text: &str) -> String {
    let mut excerpt: String = text.chars().take(EXCERPT_CHARACTERS_MAX).collect();
    if excerpt.len() < text.len() {
        excerpt.push('…');
    }
    excerpt.replace(char::is_control, " ")
}

const EXCERPT_CHARACTERS_MAX: usize = 60;
