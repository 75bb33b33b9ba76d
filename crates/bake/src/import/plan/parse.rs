//! What does the text of a floor plan say? [`headers`](super::headers) line by line, then the [`drawing`](super::drawing) character by character.

use super::Plan;
use super::drawing::read_drawing;
use super::error::PlanError;
use super::headers::{Headers, header_key, read_headers, says_something};

/// Reads a floor plan: headers and a drawing, or a bare drawing.
///
/// # Errors
/// The first thing that is wrong, with its line, its column and the way out.
pub fn parse(text: &str) -> Result<Plan, PlanError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let lines: Vec<&str> = text.lines().collect();
    let first = lines.iter().position(|line| says_something(line));
    let (headers, drawing_at) = if has_headers(text) {
        read_headers(&lines)?
    } else {
        (Headers::bare(), first.unwrap_or(0))
    };
    read_drawing(headers, &lines, drawing_at)
}

/// Whether a text begins with headers of a floor plan, whatever follows.
#[must_use]
pub fn has_headers(text: &str) -> bool {
    let first = text.lines().find(|line| says_something(line));
    first.is_some_and(|line| header_key(line).is_some())
}
